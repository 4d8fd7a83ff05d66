//! Who is who: from the units that a game reports to the state that agents are shown.

use mackrl_skirmish::{
    Scenario,
    rules::{BattleState, Profile},
    terrain::MAP_SIZE,
};

use super::fault::GameFault;
use crate::{
    protocol::{OWNER_ALLY, OWNER_ENEMY, Unit},
    units,
};

const REQUEST: &str = "observation";
/// Loops that no weapon needs to reload.
const COOLDOWN_MAX: f32 = 1000.0;
/// Part by which a full value may be exceeded: games keep fixed-point numbers.
const SLACK: f32 = 1.001;

/// The armies of one episode by their tags: agents in SMAC's order, then enemies in the game's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Roster {
    tags: Vec<u64>,
}

impl Roster {
    /// Reads the armies at the beginning of an episode into `state`; `None` as long as they are incomplete.
    ///
    /// Agents are ordered by type, x and y. Their types are numbered from an unknown number on, the least that is there.
    pub(crate) fn read(
        scenario: &Scenario,
        found: &[Unit],
        state: &mut BattleState,
    ) -> Result<Option<Self>, GameFault> {
        let of = |owner: i32| found.iter().filter(move |unit| unit.owner == Some(owner));
        let mut allies: Vec<&Unit> = of(OWNER_ALLY).collect();
        let enemies: Vec<&Unit> = of(OWNER_ENEMY).collect();
        if allies.len() != scenario.agents || enemies.len() != scenario.enemies() {
            return Ok(None);
        }
        allies.sort_by(|a, b| {
            let ([ax, ay], [bx, by]) = (place(a), place(b));
            let by_place = ax.total_cmp(&bx).then(ay.total_cmp(&by));
            a.unit_type.cmp(&b.unit_type).then(by_place)
        });
        let first_type = allies
            .iter()
            .filter_map(|unit| unit.unit_type)
            .min()
            .unwrap_or_default();
        let kinds = units::ally_kinds(scenario);
        for (index, unit) in allies.iter().chain(&enemies).enumerate() {
            let number = unit.unit_type.unwrap_or_default();
            let kind = if index < scenario.agents {
                let place =
                    usize::try_from(number.saturating_sub(first_type)).unwrap_or(usize::MAX);
                kinds
                    .get(place)
                    .copied()
                    .filter(|kind| *kind == scenario.recruits[index].kind)
            } else {
                let place = scenario.type_ids.iter().position(|known| *known == number);
                place.and_then(|place| u8::try_from(place).ok())
            };
            let kind = kind.ok_or_else(|| {
                GameFault::garbage(
                    REQUEST,
                    format!("unit {index} has type {number}, which does not belong there"),
                )
            })?;
            state.units[index].kind = kind;
            check_statistics(&scenario.field.profiles[usize::from(kind)], unit)?;
        }
        let tags = allies
            .iter()
            .chain(&enemies)
            .filter_map(|unit| unit.tag)
            .collect();
        let roster = Self { tags };
        roster.check()?;
        state.units.iter_mut().for_each(|unit| unit.life = 1.0);
        roster.update(scenario, found, state)?;
        Ok(Some(roster))
    }

    /// The tag of unit number `index`.
    pub(crate) fn tag(&self, index: usize) -> u64 {
        self.tags[index]
    }

    /// Whether any unit is one of `tags`.
    pub(crate) fn has_any(&self, tags: &[u64]) -> bool {
        self.tags.iter().any(|tag| tags.contains(tag))
    }

    /// Takes over how everybody is now. Whoever is not reported is dead; others than the roster's are ignored, as SMAC does:
    /// new armies may have appeared since the last of these died.
    pub(crate) fn update(
        &self,
        scenario: &Scenario,
        found: &[Unit],
        state: &mut BattleState,
    ) -> Result<(), GameFault> {
        for (index, tag) in self.tags.iter().enumerate() {
            let mut own = found.iter().filter(|unit| unit.tag == Some(*tag));
            let (first, second) = (own.next(), own.next());
            let unit = &mut state.units[index];
            let wrong =
                |problem: &str| GameFault::garbage(REQUEST, format!("unit {index} {problem}"));
            match (first, second) {
                (None, _) => unit.life = 0.0,
                (Some(_), Some(_)) => return Err(wrong("is there twice")),
                (Some(_), None) if !unit.is_alive() => return Err(wrong("is back from the dead")),
                (Some(seen), None) => {
                    let profile = &scenario.field.profiles[usize::from(unit.kind)];
                    check_condition(profile, seen).map_err(|problem| wrong(&problem))?;
                    unit.life = seen.health.unwrap_or_default();
                    unit.shield = seen.shield.unwrap_or_default();
                    unit.energy = seen.energy.unwrap_or_default();
                    unit.cooldown = seen.weapon_cooldown.unwrap_or_default();
                    [state.x[index], state.y[index]] = place(seen);
                }
            }
        }
        Ok(())
    }

    fn check(&self) -> Result<(), GameFault> {
        let mut sorted = self.tags.clone();
        sorted.sort_unstable();
        if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(GameFault::garbage(REQUEST, "two units have one tag"));
        }
        Ok(())
    }
}

fn place(unit: &Unit) -> [f32; 2] {
    let pos = unit.pos.unwrap_or_default();
    [pos.x.unwrap_or(f32::NAN), pos.y.unwrap_or(f32::NAN)]
}

/// Whether the game's numbers for a type are those that we compute with.
fn check_statistics(profile: &Profile, unit: &Unit) -> Result<(), GameFault> {
    let pairs = [
        ("hit points", unit.health_max, profile.life),
        ("shield points", unit.shield_max, profile.shield),
    ];
    for (name, found, expected) in pairs {
        let found = found.unwrap_or_default();
        if (found - expected).abs() > 0.01 {
            return Err(GameFault::Version(format!(
                "its {} has {found} {name}, expected {expected}; env.units chooses between the game's data",
                profile.name
            )));
        }
    }
    Ok(())
}

/// Whether a living unit can be as it is said to be.
fn check_condition(profile: &Profile, unit: &Unit) -> Result<(), String> {
    let [x, y] = place(unit);
    let map = -1.0..=MAP_SIZE as f32 + 1.0;
    if !map.contains(&x) || !map.contains(&y) {
        return Err(format!("is at ({x}, {y}), outside the map"));
    }
    let health = unit.health.unwrap_or_default();
    if !(health > 0.0 && health <= profile.life * SLACK) {
        return Err(format!(
            "lives with {health} of {} hit points",
            profile.life
        ));
    }
    let ranges = [
        ("shield points", unit.shield, profile.shield * SLACK),
        (
            "energy",
            unit.energy,
            profile.greatest_energy.max(200.0) * SLACK,
        ),
        ("loops of cooldown", unit.weapon_cooldown, COOLDOWN_MAX),
    ];
    for (name, found, most) in ranges {
        let found = found.unwrap_or_default();
        if !(0.0..=most).contains(&found) {
            return Err(format!("has {found} {name}, expected at most {most}"));
        }
    }
    Ok(())
}
