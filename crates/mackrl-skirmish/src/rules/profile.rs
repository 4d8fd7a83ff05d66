//! Unit types as the rules use them: in loops instead of seconds, with pairings worked out.

use std::sync::Arc;

use crate::{
    terrain::Terrain,
    unit_types::{Attribute, Delivery, Heal, LOOPS_PER_SECOND, Layer, UnitType, UnitTypes, Weapon},
};

/// What never changes during a battle.
#[derive(Debug, Clone, PartialEq)]
pub struct Battlefield {
    /// Where units can walk.
    pub terrain: Arc<Terrain>,
    /// The unit types that take part; a unit's kind is an index into them.
    pub profiles: Vec<Profile>,
    /// Least and greatest loops added to a weapon's period.
    pub jitter_loops: [f32; 2],
    /// Shield points that recharge in a loop.
    pub shield_per_loop: f32,
    /// Loops without damage until shields recharge.
    pub shield_delay_loops: f32,
    /// Square of the distance within which friends hear a call for help.
    pub help_radius_squared: f32,
    /// Loops between two calls for help of one unit.
    pub help_period_loops: f32,
    /// Square of the distance at which a chase is given up.
    pub leash_squared: f32,
}

/// One unit type, in loops and map units.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Name of the type.
    pub name: String,
    /// Full life.
    pub life: f32,
    /// Full shield.
    pub shield: f32,
    /// Life that grows back in a loop.
    pub life_per_loop: f32,
    /// Map units a loop.
    pub speed: f32,
    /// Map units a loop by which its speed grows in a loop.
    pub acceleration: f32,
    /// Where it moves.
    pub layer: Layer,
    /// Energy at the start.
    pub energy: f32,
    /// Full energy; 0 for units that cast nothing.
    pub greatest_energy: f32,
    /// Energy that comes back in a loop.
    pub energy_per_loop: f32,
    /// Radius that ranges are measured from.
    pub radius: f32,
    /// Radius that keeps units apart.
    pub separation_radius: f32,
    /// Radius that keeps the unit off walls.
    pub inner_radius: f32,
    /// Distance, edge to edge, at which it notices targets by itself.
    pub scan_range: f32,
    /// The weapon, if any.
    pub strike: Option<Strike>,
    /// How it heals, if it does.
    pub care: Option<Care>,
}

/// How a unit heals, in loops and map units.
#[derive(Debug, Clone, PartialEq)]
pub struct Care {
    /// Greatest distance from edge to edge.
    pub range: f32,
    /// Distance from edge to edge within which it looks for patients by itself.
    pub autocast_range: f32,
    /// Least energy with which it begins by itself.
    pub autocast_energy: f32,
    /// Life that it gives in a loop.
    pub life_per_loop: f32,
    /// Energy that a point of life costs.
    pub energy_per_life: f32,
    /// Whether it can heal units of each kind.
    pub can_heal: Vec<bool>,
}

/// Beams that sweep across a target, in loops and map units.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Distances of the sweep's points from the target, left to right.
    pub points: Vec<f32>,
    /// Distance from a point to a victim's edge within which a beam touches it.
    pub radius: f32,
    /// Loops between two points.
    pub interval: f32,
    /// Loops from the touch to the hit.
    pub delay: f32,
    /// Loops from the start to the hit on the target.
    pub target_delay: f32,
}

/// A weapon, in loops and map units.
#[derive(Debug, Clone, PartialEq)]
pub struct Strike {
    /// Greatest distance from edge to edge.
    pub range: f32,
    /// How much farther the target may get during the attack.
    pub range_slop: f32,
    /// Loops from one attack to the next, before jitter.
    pub period: f32,
    /// Loops from the start of an attack to its effect.
    pub damage_point: f32,
    /// Loops after the effect without walking.
    pub backswing: f32,
    /// Hits of an attack.
    pub hits: u8,
    /// Loops between its hits.
    pub hit_interval: f32,
    /// Map units that its missile flies in a loop, if it has one.
    pub missile_speed: Option<f32>,
    /// Distance from its centre to a victim's edge at which the attacker's own explosion harms, if it explodes.
    pub burst_radius: Option<f32>,
    /// Its beams, if it has such.
    pub sweep: Option<Sweep>,
    /// Against each kind: whether it can be attacked, and what a hit does to shields and to life.
    pub effects: Vec<Effect>,
}

/// What one hit of a weapon does to units of one kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effect {
    /// Whether the weapon reaches this kind at all.
    pub can_hit: bool,
    /// Damage before armour, which shields suffer in full.
    pub damage: f32,
    /// What armour takes off when the hit gets to life.
    pub armour: f32,
    /// Least damage of a hit.
    pub minimum: f32,
}

impl Battlefield {
    /// A battlefield on `terrain` for the named types, in the given order, which becomes their kind.
    #[must_use]
    pub fn new(terrain: Arc<Terrain>, data: &UnitTypes, types: &[&UnitType]) -> Self {
        let loops = LOOPS_PER_SECOND;
        Self {
            terrain,
            profiles: types
                .iter()
                .map(|unit| Profile::new(unit, data, types))
                .collect(),
            jitter_loops: data.cooldown_jitter_s.map(|seconds| seconds * loops),
            shield_per_loop: data.shield_regeneration_per_s / loops,
            shield_delay_loops: data.shield_delay_s * loops,
            help_radius_squared: data.help_radius * data.help_radius,
            help_period_loops: data.help_period_s * loops,
            leash_squared: data.leash * data.leash,
        }
    }
}

impl Profile {
    fn new(unit: &UnitType, data: &UnitTypes, types: &[&UnitType]) -> Self {
        let loops = LOOPS_PER_SECOND;
        let weapon_range = unit.weapon.as_ref().map_or(0.0, |weapon| weapon.range);
        Self {
            name: unit.name.clone(),
            life: unit.life,
            shield: unit.shield,
            life_per_loop: unit.life_regeneration_per_s / loops,
            speed: unit.speed / loops,
            acceleration: unit
                .acceleration
                .map_or(unit.speed, |acceleration| acceleration / loops)
                / loops,
            layer: unit.layer,
            energy: unit.energy.map_or(0.0, |energy| energy.initial),
            greatest_energy: unit.energy.map_or(0.0, |energy| energy.maximum),
            energy_per_loop: unit
                .energy
                .map_or(0.0, |energy| energy.regeneration_per_s / loops),
            care: unit.heal.as_ref().map(|heal| Care::new(heal, types)),
            radius: unit.radius,
            separation_radius: unit.separation_radius,
            inner_radius: unit.inner_radius,
            scan_range: (weapon_range + data.scan_margin).max(data.scan_range),
            strike: unit.weapon.as_ref().map(|weapon| Strike {
                range: weapon.range,
                range_slop: weapon.range_slop,
                period: weapon.period_s * loops,
                damage_point: weapon.damage_point_s * loops,
                backswing: weapon.backswing_s * loops,
                hits: weapon.hits,
                hit_interval: weapon.hit_interval_s * loops,
                missile_speed: match weapon.delivery {
                    Delivery::Missile { speed } => Some(speed / loops),
                    _ => None,
                },
                burst_radius: match weapon.delivery {
                    Delivery::Burst { radius, .. } => Some(radius),
                    _ => None,
                },
                sweep: Sweep::of(weapon.delivery),
                effects: types
                    .iter()
                    .map(|target| Effect {
                        can_hit: weapon
                            .targets
                            .iter()
                            .any(|plane| target.layer.is_in(*plane)),
                        damage: damage_of_hit(weapon, target),
                        armour: target.armour,
                        minimum: data.minimum_damage,
                    })
                    .collect(),
            }),
        }
    }

    /// Whether the unit stays where it is built.
    #[must_use]
    pub fn is_immobile(&self) -> bool {
        self.speed == 0.0
    }
}

impl Care {
    fn new(heal: &Heal, types: &[&UnitType]) -> Self {
        Self {
            range: heal.range,
            autocast_range: heal.autocast_range,
            autocast_energy: heal.autocast_energy,
            life_per_loop: heal.life_per_s / LOOPS_PER_SECOND,
            energy_per_life: heal.energy_per_life,
            can_heal: types
                .iter()
                .map(|patient| patient.has(heal.patients))
                .collect(),
        }
    }
}

impl Sweep {
    fn of(delivery: Delivery) -> Option<Self> {
        let Delivery::Sweep {
            half_width,
            spacing,
            radius,
            interval_s,
            delay_s,
            target_delay_s,
        } = delivery
        else {
            return None;
        };
        let mut points = Vec::new();
        let mut point = -half_width;
        while point <= half_width + 1e-3 {
            points.push(point);
            point += spacing;
        }
        Some(Self {
            points,
            radius,
            interval: interval_s * LOOPS_PER_SECOND,
            delay: delay_s * LOOPS_PER_SECOND,
            target_delay: target_delay_s * LOOPS_PER_SECOND,
        })
    }
}

impl Strike {
    /// Square of the greatest distance between centres at which an attack may begin.
    #[must_use]
    pub fn reach_squared(&self, own: &Profile, target: &Profile) -> f32 {
        let reach = self.range + own.radius + target.radius;
        reach * reach
    }

    /// Square of the greatest distance between centres at which an attack under way still takes effect.
    #[must_use]
    pub fn slack_reach_squared(&self, own: &Profile, target: &Profile) -> f32 {
        let reach = self.range + self.range_slop + own.radius + target.radius;
        reach * reach
    }
}

/// Damage of one hit of `weapon` on units of type `target`, before armour.
fn damage_of_hit(weapon: &Weapon, target: &UnitType) -> f32 {
    if let Delivery::Burst {
        structure_damage, ..
    } = weapon.delivery
        && target.has(Attribute::Structure)
    {
        return structure_damage;
    }
    let bonus = weapon.bonus.filter(|bonus| target.has(bonus.against));
    weapon.damage + bonus.map_or(0.0, |bonus| bonus.damage)
}
