//! Scenarios that users write: a map file with, if wanted, a terrain of its own and unit types of its own.
//!
//! The text may come from anybody, so everything in it has a bound: its length, the number of units and of types, and every
//! number of every type. Whatever is wrong is reported with line and column, what was found and what was expected. Rules are
//! checked on paths (`enemies.groups.1.count`) and a path is looked up in the text only when its rule is broken; the shipped
//! maps, which nobody can get wrong, keep the shorter way of [`Scenario::parse`].

mod drawing;
mod places;
mod types;
mod words;

use std::{fmt, sync::Arc};

use mackrl_env::EntitySet;
use places::{Path, Places};
use serde::Deserialize;

use crate::{
    Scenario,
    scenario::{Allies, Enemies, EnemyOrder, Group, MapFile, exactly},
    terrain::{MAP_SIZE, Terrain, TerrainName},
    unit_types::UnitTypes,
};

/// Greatest length of a scenario in bytes.
pub const LENGTH_MAX: usize = 256 * 1024;
/// Greatest time limit of an episode in steps.
const EPISODE_LIMIT_MAX: i64 = 100_000;
/// Greatest number of units that a group states.
const GROUP_MAX: i64 = 100;

/// What is wrong with a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenarioProblem {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What was found and what was expected.
    pub message: String,
}

impl fmt::Display for ScenarioProblem {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}: {}", self.line, self.column, self.message)
    }
}

/// A scenario file as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ScenarioFile {
    /// The name of a shipped terrain, or a drawing in lines.
    terrain: String,
    episode_limit: i64,
    allies: Army,
    enemies: EnemyArmy,
    /// Unit types that are new or replace shipped ones.
    #[serde(default, rename = "unit")]
    types: Vec<toml::Table>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Army {
    race: crate::scenario::Race,
    groups: Vec<Squad>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct EnemyArmy {
    race: crate::scenario::Race,
    order: EnemyOrder,
    groups: Vec<Squad>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Squad {
    unit: String,
    count: i64,
    #[serde(deserialize_with = "exactly")]
    at: [f32; 2],
}

/// A broken rule: where, and in which words.
type Broken = (Path, String);

/// Reads the scenario `text`, to be called `name`; types that it does not define are taken from `units`.
///
/// # Errors
/// [`ScenarioProblem`] for text that is too long or not TOML, for unknown keys, types and terrains, for numbers out of range,
/// and for armies that are empty, too large or have no room.
pub fn parse(name: &str, text: &str, units: &UnitTypes) -> Result<Scenario, ScenarioProblem> {
    if text.len() > LENGTH_MAX {
        return Err(ScenarioProblem {
            line: 1,
            column: 1,
            message: format!(
                "the scenario has {} bytes, expected at most {LENGTH_MAX}",
                text.len()
            ),
        });
    }
    let places = Places::new(text)?;
    let file: ScenarioFile = toml::from_str(text).map_err(|error| places.of_error(&error))?;
    file.scenario(name, units)
        .map_err(|(path, message)| places.problem(&path, message))
}

impl ScenarioFile {
    fn scenario(self, name: &str, units: &UnitTypes) -> Result<Scenario, Broken> {
        let terrain = terrain(&self.terrain)?;
        if !(1..=EPISODE_LIMIT_MAX).contains(&self.episode_limit) {
            let message = format!(
                "episode_limit is {}, expected an integer in [1, {EPISODE_LIMIT_MAX}]",
                self.episode_limit
            );
            return Err((Path::new("episode_limit"), message));
        }
        let units = types::extended(units, &self.types)?;
        check_army("allies", &self.allies.groups, &units, &terrain)?;
        check_army("enemies", &self.enemies.groups, &units, &terrain)?;
        check_order(self.enemies.order)?;
        self.check_size()?;
        let file = self.map_file();
        Scenario::build(name, &file, terrain, &units)
            .map_err(|message| (Path::new("allies"), message))
    }

    fn check_size(&self) -> Result<(), Broken> {
        let size = |groups: &[Squad]| groups.iter().map(|group| group.count).sum::<i64>();
        let (allies, enemies) = (size(&self.allies.groups), size(&self.enemies.groups));
        if usize::try_from(allies + enemies).is_ok_and(|units| units <= EntitySet::CAPACITY) {
            return Ok(());
        }
        let message = format!(
            "{allies} allies and {enemies} enemies, expected at most {} units in all",
            EntitySet::CAPACITY
        );
        Err((Path::new("allies").field("groups"), message))
    }

    /// The same battle in the words of the shipped maps; its terrain is looked up apart.
    fn map_file(self) -> MapFile {
        let groups = |squads: Vec<Squad>| {
            let group = |Squad { unit, count, at }| Group {
                unit,
                count: usize::try_from(count).unwrap_or_default(),
                at,
            };
            squads.into_iter().map(group).collect()
        };
        MapFile {
            terrain: TerrainName::Open,
            episode_limit: usize::try_from(self.episode_limit).unwrap_or_default(),
            allies: Allies {
                race: self.allies.race,
                groups: groups(self.allies.groups),
            },
            enemies: Enemies {
                race: self.enemies.race,
                order: self.enemies.order,
                groups: groups(self.enemies.groups),
            },
        }
    }
}

/// The terrain of this name, or the one that is drawn.
fn terrain(text: &str) -> Result<Arc<Terrain>, Broken> {
    let path = Path::new("terrain");
    if text.contains('\n') {
        return drawing::terrain(text).map_err(|message| (path, message));
    }
    let named = TerrainName::deserialize(toml::Value::String(text.to_owned()));
    named.map(Terrain::named).map_err(|error| {
        let names = error.message().split_once("expected ");
        let names = names.map_or_else(String::new, |(_, names)| names.to_owned());
        let meant = words::nearest(text, names.split('`').skip(1).step_by(2));
        let message = format!(
            "terrain `{}` is unknown, expected {names}, or a drawing of {MAP_SIZE} lines{}",
            shortened(text),
            in_question(meant)
        );
        (path, message)
    })
}

fn check_army(
    side: &'static str,
    groups: &[Squad],
    units: &UnitTypes,
    terrain: &Terrain,
) -> Result<(), Broken> {
    let path = Path::new(side).field("groups");
    if !(1..=EntitySet::CAPACITY).contains(&groups.len()) {
        let message = format!(
            "{side}.groups has {} groups, expected 1 to {}",
            groups.len(),
            EntitySet::CAPACITY
        );
        return Err((path, message));
    }
    for (index, group) in groups.iter().enumerate() {
        let path = path.clone().item(index);
        if units.find(&group.unit).is_none() {
            let message = types::unknown(&group.unit, units);
            return Err((path.field("unit"), message));
        }
        if !(1..=GROUP_MAX).contains(&group.count) {
            let message = format!(
                "count is {}, expected an integer in [1, {GROUP_MAX}]",
                group.count
            );
            return Err((path.field("count"), message));
        }
        check_point(group.at, &path.clone().field("at"))?;
        let [x, y] = group.at.map(crate::terrain::cell_of);
        if !terrain.is_walkable(x, y) {
            let message = format!(
                "at is {:?}, where nobody can stand, expected a walkable cell of the terrain",
                group.at
            );
            return Err((path.field("at"), message));
        }
    }
    Ok(())
}

fn check_order(order: EnemyOrder) -> Result<(), Broken> {
    let path = Path::new("enemies").field("order");
    match order {
        EnemyOrder::None | EnemyOrder::Hunt => Ok(()),
        EnemyOrder::AttackMove(to) => check_point(to, &path.field("attack-move")),
        EnemyOrder::AttackMoveBetween(ends) => {
            let path = path.field("attack-move-between");
            ends.into_iter().try_for_each(|end| check_point(end, &path))
        }
    }
}

fn check_point(point: [f32; 2], path: &Path) -> Result<(), Broken> {
    let edge = MAP_SIZE as f32;
    if point.iter().all(|x| (0.0..=edge).contains(x)) {
        return Ok(());
    }
    let message = format!("the point is {point:?}, expected coordinates in [0, {edge}]");
    Err((path.clone(), message))
}

/// The end of a message about a name that may be a misspelling.
fn in_question(meant: Option<&str>) -> String {
    meant.map_or_else(String::new, |name| format!(", did you mean `{name}`?"))
}

/// The beginning of a text that may be long.
fn shortened(text: &str) -> String {
    const LONG: usize = 40;
    match text.char_indices().nth(LONG) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests;
