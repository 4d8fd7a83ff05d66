//! Statistics of unit types, as a file of `units/` states them: in seconds and map units.
//!
//! The rules run in game loops; [`crate::rules`] converts once, when a battle is set up. Nothing here is known to
//! the reinforcement-learning face except names, life and shields.

use std::sync::{Arc, OnceLock};

use mackrl_env::declare_words;
use serde::{Deserialize, Serialize};

use crate::error::SkirmishError;

/// Game loops in a second at normal speed, the unit of all data.
pub const LOOPS_PER_SECOND: f32 = 16.0;

declare_words! {
    /// Which statistics units have.
    pub enum UnitData {
        /// Base Wings of Liberty, on whose data SMAC's maps depend by their files.
        Liberty = "liberty",
        /// Legacy of the Void 4.10, with which recorded runs of the game agree better.
        #[default]
        Lotv = "lotv",
    }
}

impl UnitData {
    /// The file of `units/` that states them.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::Liberty => include_str!("../units/liberty.toml"),
            Self::Lotv => include_str!("../units/lotv.toml"),
        }
    }
}

/// All unit types and the constants that they share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnitTypes {
    /// Least and greatest time added to a weapon's period, in seconds.
    pub cooldown_jitter_s: [f32; 2],
    /// Shield points that recharge in a second.
    pub shield_regeneration_per_s: f32,
    /// Seconds without damage until shields recharge.
    pub shield_delay_s: f32,
    /// Least damage of a hit, whatever the armour; ≥ 0.
    pub minimum_damage: f32,
    /// Least distance, edge to edge, at which a unit notices targets by itself.
    pub scan_range: f32,
    /// Distance within which friends hear a call for help.
    pub help_radius: f32,
    /// Seconds between two calls for help of one unit.
    pub help_period_s: f32,
    /// How much farther than its weapon reaches a unit notices targets by itself, if that is more than `scan_range`.
    #[serde(default)]
    pub scan_margin: f32,
    /// Distance from where a chase began at which it is given up.
    pub leash: f32,
    /// The types.
    #[serde(rename = "unit")]
    pub types: Vec<UnitType>,
}

/// Statistics of one type of unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnitType {
    /// Name in map files.
    pub name: String,
    /// The game's number of this type.
    pub type_id: u32,
    /// Hit points, > 0.
    pub life: f32,
    /// Shield points, ≥ 0.
    #[serde(default)]
    pub shield: f32,
    /// Hit points that grow back in a second.
    #[serde(default)]
    pub life_regeneration_per_s: f32,
    /// Damage that life is spared per hit.
    pub armour: f32,
    /// Map units per second; 0 for structures.
    pub speed: f32,
    /// Radius that ranges are measured from.
    pub radius: f32,
    /// Radius within which no other unit of the layer may stand.
    pub separation_radius: f32,
    /// Radius that has to fit between walls.
    pub inner_radius: f32,
    /// Sight in map units; unused while the maps lift the fog for everybody.
    pub sight: f32,
    /// Where it moves: what it collides with, and which weapons reach it.
    #[serde(default)]
    pub layer: Layer,
    /// Map units per second by which its speed grows in a second; absent if it is at full speed at once.
    pub acceleration: Option<f32>,
    /// What bonus damage and healing ask for.
    pub attributes: Vec<Attribute>,
    /// Energy, if it has any.
    pub energy: Option<Energy>,
    /// How it heals friends, if it does.
    pub heal: Option<Heal>,
    /// The weapon, if it has one.
    pub weapon: Option<Weapon>,
}

/// A property that other units' weapons ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Attribute {
    /// Light.
    Light,
    /// Armoured.
    Armoured,
    /// Biological.
    Biological,
    /// Mechanical.
    Mechanical,
    /// Massive.
    Massive,
    /// A building.
    Structure,
}

/// Where a unit moves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layer {
    /// On the ground, kept off by walls.
    #[default]
    Ground,
    /// So tall that it walks over troops and cliffs, and that weapons against air reach it too.
    Tall,
    /// In the air.
    Air,
}

/// Energy of a unit that casts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Energy {
    /// At the start of an episode, ≤ `maximum`.
    pub initial: f32,
    /// Full energy, > 0.
    pub maximum: f32,
    /// What comes back in a second.
    pub regeneration_per_s: f32,
}

/// How a unit heals its friends, one at a time and without a pause.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Heal {
    /// Greatest distance from edge to edge.
    pub range: f32,
    /// Distance from edge to edge within which it looks for patients by itself.
    pub autocast_range: f32,
    /// Least energy with which it begins by itself.
    pub autocast_energy: f32,
    /// Life that it gives in a second.
    pub life_per_s: f32,
    /// Energy that a point of life costs, > 0.
    pub energy_per_life: f32,
    /// Which patients it can heal.
    pub patients: Attribute,
}

/// What a weapon can hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Plane {
    /// Units on the ground.
    Ground,
    /// Flying units.
    Air,
}

/// How a unit attacks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weapon {
    /// Greatest distance from edge to edge.
    pub range: f32,
    /// How much farther than `range` a target may get while the attack is under way.
    #[serde(default = "default_range_slop")]
    pub range_slop: f32,
    /// Seconds from one attack to the next, before jitter.
    pub period_s: f32,
    /// Seconds from the start of an attack to its effect.
    pub damage_point_s: f32,
    /// Seconds after the effect in which the unit does not walk unless ordered to.
    #[serde(default = "default_backswing_s")]
    pub backswing_s: f32,
    /// Damage of one hit.
    pub damage: f32,
    /// Extra damage against some.
    pub bonus: Option<Bonus>,
    /// Hits of one attack, ≥ 1.
    #[serde(default = "default_hits")]
    pub hits: u8,
    /// Seconds between the hits of one attack.
    #[serde(default)]
    pub hit_interval_s: f32,
    /// How damage gets to the target.
    #[serde(default)]
    pub delivery: Delivery,
    /// What it can hit.
    pub targets: Vec<Plane>,
}

/// Extra damage per hit against units with an attribute.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bonus {
    /// Who suffers it.
    pub against: Attribute,
    /// Damage added to each hit.
    pub damage: f32,
}

/// How damage gets from the attacker to its target.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Delivery {
    /// At once.
    #[default]
    Instant,
    /// By a missile that follows its target and outlives its shooter.
    Missile {
        /// Map units per second, > 0.
        speed: f32,
    },
    /// By the attacker's own explosion, which it does not survive and which also comes when it is killed. It harms all units of
    /// the other side that the weapon can hit, and no friends.
    Burst {
        /// Distance from the centre to a victim's edge, > 0.
        radius: f32,
        /// Damage to structures, instead of the weapon's own.
        structure_damage: f32,
    },
    /// By beams that sweep across the target, at right angles to the line of fire. Each of the weapon's hits is a beam: the
    /// first sweeps from left to right, the next back, and so on. A beam hits everybody at most once.
    Sweep {
        /// Map units from the target to either end.
        half_width: f32,
        /// Map units between two points of the sweep, > 0.
        spacing: f32,
        /// Distance from a point to a victim's edge within which the beam touches it.
        radius: f32,
        /// Seconds between two points.
        interval_s: f32,
        /// Seconds from the touch to the hit.
        delay_s: f32,
        /// Seconds from the start of the sweep to the hit on the target itself.
        target_delay_s: f32,
    },
}

impl UnitTypes {
    /// The statistics called `data`, parsed once.
    ///
    /// # Errors
    /// [`SkirmishError::UnitFile`] if the embedded file is damaged.
    pub fn load(data: UnitData) -> Result<Arc<Self>, SkirmishError> {
        type Parsed = OnceLock<Result<Arc<UnitTypes>, SkirmishError>>;
        static LIBERTY: Parsed = OnceLock::new();
        static LOTV: Parsed = OnceLock::new();
        let parsed = match data {
            UnitData::Liberty => &LIBERTY,
            UnitData::Lotv => &LOTV,
        };
        parsed
            .get_or_init(|| Self::parse(data.text()).map(Arc::new))
            .clone()
    }

    /// Reads the contents of a file of `units/`.
    ///
    /// # Errors
    /// [`SkirmishError::UnitFile`] for broken TOML, unknown keys and numbers out of range.
    pub fn parse(text: &str) -> Result<Self, SkirmishError> {
        let types: Self =
            toml::from_str(text).map_err(|error| SkirmishError::UnitFile(error.to_string()))?;
        types.validate()?;
        Ok(types)
    }

    /// The type called `name`.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<&UnitType> {
        self.types.iter().find(|unit| unit.name == name)
    }

    fn validate(&self) -> Result<(), SkirmishError> {
        let [least, greatest] = self.cooldown_jitter_s;
        require(
            least <= greatest,
            "cooldown_jitter_s is [least, greatest]",
            "all",
        )?;
        let shared = [
            self.shield_regeneration_per_s,
            self.shield_delay_s,
            self.minimum_damage,
            self.scan_range,
            self.scan_margin,
            self.help_radius,
            self.help_period_s,
            self.leash,
        ];
        require(
            shared.iter().all(|x| is_magnitude(*x)),
            "shared constants are ≥ 0",
            "all",
        )?;
        self.types.iter().try_for_each(|unit| unit.validate(least))
    }
}

impl Layer {
    /// Whether weapons against `plane` reach units of this layer.
    #[must_use]
    pub fn is_in(self, plane: Plane) -> bool {
        match self {
            Self::Ground => plane == Plane::Ground,
            Self::Tall => true,
            Self::Air => plane == Plane::Air,
        }
    }

    /// Whether units of two layers are in each other's way; the tall walk over those on the ground.
    #[must_use]
    pub fn collides_with(self, other: Self) -> bool {
        (self == Self::Ground) == (other == Self::Ground)
    }
}

impl UnitType {
    /// Whether the type has `attribute`.
    #[must_use]
    pub fn has(&self, attribute: Attribute) -> bool {
        self.attributes.contains(&attribute)
    }

    pub(super) fn validate(&self, least_jitter_s: f32) -> Result<(), SkirmishError> {
        let lengths = [self.radius, self.separation_radius, self.inner_radius];
        require(
            is_magnitude(self.life) && self.life > 0.0,
            "life is > 0",
            &self.name,
        )?;
        require(
            lengths.iter().all(|x| (0.0..=4.0).contains(x)),
            "radii are in [0, 4]",
            &self.name,
        )?;
        require(
            (0.0..=4.0).contains(&self.speed),
            "speed is in [0, 4]",
            &self.name,
        )?;
        let others = [
            self.shield,
            self.life_regeneration_per_s,
            self.armour,
            self.sight,
        ];
        require(
            others.iter().all(|x| is_magnitude(*x)),
            "statistics are ≥ 0",
            &self.name,
        )?;
        self.validate_casting()?;
        let Some(weapon) = &self.weapon else {
            return Ok(());
        };
        let numbers = [
            weapon.range,
            weapon.range_slop,
            weapon.damage_point_s,
            weapon.backswing_s,
            weapon.damage,
            weapon.hit_interval_s,
        ];
        require(
            numbers.iter().all(|x| is_magnitude(*x)),
            "weapon numbers are ≥ 0",
            &self.name,
        )?;
        require(
            (1..=8).contains(&weapon.hits),
            "hits are in 1..=8",
            &self.name,
        )?;
        require(
            weapon.period_s + least_jitter_s > weapon.damage_point_s + 1.0 / LOOPS_PER_SECOND,
            "a weapon's period exceeds its damage point by more than a loop",
            &self.name,
        )?;
        match weapon.delivery {
            Delivery::Instant => Ok(()),
            Delivery::Burst {
                radius,
                structure_damage,
            } => require(
                (0.0..=16.0).contains(&radius) && is_magnitude(structure_damage),
                "a burst's radius is in [0, 16] and its damage to structures ≥ 0",
                &self.name,
            ),
            Delivery::Missile { speed } => require(
                speed >= 1.0 && speed.is_finite(),
                "a missile's speed is ≥ 1",
                &self.name,
            ),
            Delivery::Sweep {
                half_width,
                spacing,
                radius,
                interval_s,
                delay_s,
                target_delay_s,
            } => require(
                (0.0..=16.0).contains(&half_width)
                    && spacing >= 0.05
                    && [radius, interval_s, delay_s, target_delay_s]
                        .iter()
                        .all(|x| (0.0..=16.0).contains(x)),
                "a sweep's spacing is ≥ 0.05 and its other numbers are in [0, 16]",
                &self.name,
            ),
        }
    }

    fn validate_casting(&self) -> Result<(), SkirmishError> {
        require(
            self.acceleration
                .is_none_or(|rate| rate > 0.0 && is_magnitude(rate)),
            "acceleration is > 0",
            &self.name,
        )?;
        require(
            self.energy.is_none_or(|energy| {
                energy.maximum > 0.0
                    && is_magnitude(energy.maximum)
                    && (0.0..=energy.maximum).contains(&energy.initial)
                    && is_magnitude(energy.regeneration_per_s)
            }),
            "energy is initial ≤ maximum, maximum > 0, regeneration ≥ 0",
            &self.name,
        )?;
        let Some(heal) = self.heal else { return Ok(()) };
        let numbers = [
            heal.range,
            heal.autocast_range,
            heal.autocast_energy,
            heal.life_per_s,
        ];
        require(
            numbers.iter().all(|x| is_magnitude(*x))
                && heal.energy_per_life > 0.0
                && is_magnitude(heal.energy_per_life)
                && self.energy.is_some()
                && self.weapon.is_none(),
            "healers have energy and no weapon, energy_per_life is > 0 and other numbers are ≥ 0",
            &self.name,
        )
    }
}

fn is_magnitude(value: f32) -> bool {
    (0.0..=1e6).contains(&value)
}

fn require(holds: bool, rule: &str, unit: &str) -> Result<(), SkirmishError> {
    if holds {
        Ok(())
    } else {
        Err(SkirmishError::UnitFile(format!("unit `{unit}`: {rule}")))
    }
}

fn default_range_slop() -> f32 {
    1.0
}

fn default_backswing_s() -> f32 {
    0.5
}

fn default_hits() -> u8 {
    1
}
