//! Unit types as the rules use them: in loops instead of seconds, with pairings worked out.

use std::sync::Arc;

use crate::skirmish::{
    terrain::Terrain,
    unit_types::{Attribute, Delivery, LOOPS_PER_SECOND, Plane, UnitType, UnitTypes, Weapon},
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
            radius: unit.radius,
            separation_radius: unit.separation_radius,
            inner_radius: unit.inner_radius,
            scan_range: weapon_range.max(data.scan_range),
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
                    Delivery::Instant | Delivery::Burst { .. } => None,
                },
                burst_radius: match weapon.delivery {
                    Delivery::Burst { radius, .. } => Some(radius),
                    Delivery::Instant | Delivery::Missile { .. } => None,
                },
                effects: types
                    .iter()
                    .map(|target| Effect {
                        // No unit of these maps flies yet; those that do will say so in their file.
                        can_hit: weapon.targets.contains(&Plane::Ground),
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
