//! Maps: who fights whom, where, under which order.
//!
//! A map file states only what cannot be derived. Sizes, agent order, type bits and rewards follow from it.

use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, de::Error};

use crate::{
    error::SkirmishError,
    rules::{Battlefield, Profile, Team, spread_around},
    terrain::{Terrain, TerrainName},
    unit_types::{UnitType, UnitTypes},
};

/// Every shipped map, in the order in which they are listed: its name and its file.
const MAPS: &[(&str, &str)] = &[
    ("3m", include_str!("../maps/3m.toml")),
    ("8m", include_str!("../maps/8m.toml")),
    ("25m", include_str!("../maps/25m.toml")),
    ("5m_vs_6m", include_str!("../maps/5m_vs_6m.toml")),
    ("8m_vs_9m", include_str!("../maps/8m_vs_9m.toml")),
    ("10m_vs_11m", include_str!("../maps/10m_vs_11m.toml")),
    ("27m_vs_30m", include_str!("../maps/27m_vs_30m.toml")),
    ("MMM", include_str!("../maps/MMM.toml")),
    ("MMM2", include_str!("../maps/MMM2.toml")),
    ("2s3z", include_str!("../maps/2s3z.toml")),
    ("3s5z", include_str!("../maps/3s5z.toml")),
    ("3s5z_vs_3s6z", include_str!("../maps/3s5z_vs_3s6z.toml")),
    ("3s_vs_3z", include_str!("../maps/3s_vs_3z.toml")),
    ("3s_vs_4z", include_str!("../maps/3s_vs_4z.toml")),
    ("3s_vs_5z", include_str!("../maps/3s_vs_5z.toml")),
    ("1c3s5z", include_str!("../maps/1c3s5z.toml")),
    ("2m_vs_1z", include_str!("../maps/2m_vs_1z.toml")),
    ("corridor", include_str!("../maps/corridor.toml")),
    ("6h_vs_8z", include_str!("../maps/6h_vs_8z.toml")),
    ("2s_vs_1sc", include_str!("../maps/2s_vs_1sc.toml")),
    (
        "so_many_baneling",
        include_str!("../maps/so_many_baneling.toml"),
    ),
    ("bane_vs_bane", include_str!("../maps/bane_vs_bane.toml")),
    ("2c_vs_64zg", include_str!("../maps/2c_vs_64zg.toml")),
];

/// SMAC's names for teams: the types in alphabetical order, which is that of agents, and the name.
const MAP_TYPES: &[(&[&str], &str)] = &[
    (&["marine"], "marines"),
    (&["marauder", "marine", "medivac"], "MMM"),
    (&["stalker", "zealot"], "stalkers_and_zealots"),
    (&["stalker"], "stalkers"),
    (
        &["colossus", "stalker", "zealot"],
        "colossi_stalkers_zealots",
    ),
    (&["zealot"], "zealots"),
    (&["hydralisk"], "hydralisks"),
    (&["baneling", "zergling"], "bane"),
    (&["colossus"], "colossus"),
];

/// A map file as it is written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapFile {
    /// Where units can walk.
    pub terrain: TerrainName,
    /// Steps after which an episode is truncated, ≥ 1.
    pub episode_limit: usize,
    /// The agents' side.
    pub allies: Allies,
    /// The other side.
    pub enemies: Enemies,
}

/// The agents' side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Allies {
    /// Its race; only protoss units are observed with shields.
    pub race: Race,
    /// Its units in order of creation.
    pub groups: Vec<Group>,
}

/// The other side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Enemies {
    /// Its race.
    pub race: Race,
    /// What all of them are ordered at the start.
    pub order: EnemyOrder,
    /// Its units in order of creation.
    pub groups: Vec<Group>,
}

/// Units that appear together around a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Group {
    /// Name of the unit type.
    pub unit: String,
    /// How many, ≥ 1.
    pub count: usize,
    /// The point, in map units.
    #[serde(deserialize_with = "exactly")]
    pub at: [f32; 2],
}

/// The peoples of StarCraft.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Race {
    /// Humans.
    Terran,
    /// With shields.
    Protoss,
    /// Life grows back.
    Zerg,
}

/// What enemies are ordered when they appear.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EnemyOrder {
    /// Nothing: they fight what comes near.
    None,
    /// Attack-move to a point. The army keeps its formation, as a group does that is ordered beyond its own extent.
    AttackMove(#[serde(deserialize_with = "exactly")] [f32; 2]),
    /// Attack-move to a random point between two, drawn once an episode.
    AttackMoveBetween(#[serde(deserialize_with = "exactly_points")] [[f32; 2]; 2]),
    /// Attack the other side's units, wherever they are.
    Hunt,
}

/// One unit at the start of an episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recruit {
    /// Index of its type among the battlefield's profiles.
    pub kind: u8,
    /// Its side.
    pub team: Team,
    /// Where it appears.
    pub at: [f32; 2],
}

/// A map with everything looked up and placed.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Name in the registry.
    pub name: String,
    /// Steps after which an episode is truncated.
    pub episode_limit: usize,
    /// Terrain and unit types; types in alphabetical order, which is the order of SMAC's own type ids.
    pub field: Arc<Battlefield>,
    /// Everybody at the start: agents in their order (type, x, y), then enemies in order of creation.
    pub recruits: Vec<Recruit>,
    /// N: how many of `recruits` are agents.
    pub agents: usize,
    /// What enemies are ordered at the start.
    pub enemy_order: EnemyOrder,
    /// Middle of the enemies' places, which formations are relative to.
    pub enemy_centre: [f32; 2],
    /// Groups of allies and of enemies, as they were written.
    pub armies: [Vec<Group>; 2],
    /// Races of allies and enemies.
    pub races: [Race; 2],
    /// The game's numbers of the types, as `field.profiles`.
    pub type_ids: Vec<u32>,
}

/// Names of all maps.
#[must_use]
pub fn map_names() -> Vec<&'static str> {
    MAPS.iter().map(|(name, _)| *name).collect()
}

/// The file of the shipped map called `name`; `None` if there is no such map.
#[must_use]
pub fn map_text(name: &str) -> Option<&'static str> {
    let (_, text) = MAPS.iter().find(|(shipped, _)| *shipped == name)?;
    Some(text)
}

impl Scenario {
    /// The shipped map called `name` with the given statistics; `None` if there is no such map.
    #[must_use]
    pub fn shipped(name: &str, units: &UnitTypes) -> Option<Result<Self, SkirmishError>> {
        Some(Self::parse(name, map_text(name)?, units))
    }

    /// Reads a map file.
    ///
    /// # Errors
    /// [`SkirmishError::MapFile`] for broken TOML, unknown keys, types or terrains, and armies that are empty, too large or
    /// have no room.
    pub fn parse(name: &str, text: &str, units: &UnitTypes) -> Result<Self, SkirmishError> {
        let problem = |problem: String| SkirmishError::MapFile {
            map: name.to_owned(),
            problem,
        };
        let file: MapFile = toml::from_str(text).map_err(|error| problem(error.to_string()))?;
        file.validate(units).map_err(problem)?;
        Self::build(name, &file, Terrain::named(file.terrain), units).map_err(problem)
    }

    /// Looks up types and finds a place for everybody.
    pub(super) fn build(
        name: &str,
        file: &MapFile,
        terrain: Arc<Terrain>,
        units: &UnitTypes,
    ) -> Result<Self, String> {
        let mut names: Vec<&str> = file
            .groups()
            .map(|(_, group)| group.unit.as_str())
            .collect();
        names.sort_unstable();
        names.dedup();
        let types: Vec<&UnitType> = names.iter().filter_map(|name| units.find(name)).collect();
        let field = Battlefield::new(terrain, units, &types);
        let recruits = place_armies(file, &field, &names)?;
        let (mut allies, enemies): (Vec<Recruit>, Vec<Recruit>) = recruits
            .into_iter()
            .partition(|recruit| recruit.team == Team::Ally);
        allies.sort_by(|a, b| {
            let by_place = a.at[0]
                .total_cmp(&b.at[0])
                .then(a.at[1].total_cmp(&b.at[1]));
            a.kind.cmp(&b.kind).then(by_place)
        });
        let middle = |axis: usize| {
            enemies.iter().map(|enemy| enemy.at[axis]).sum::<f32>() / enemies.len() as f32
        };
        Ok(Self {
            name: name.to_owned(),
            episode_limit: file.episode_limit,
            field: Arc::new(field),
            agents: allies.len(),
            enemy_centre: [middle(0), middle(1)],
            recruits: allies.into_iter().chain(enemies).collect(),
            enemy_order: file.enemies.order,
            armies: [file.allies.groups.clone(), file.enemies.groups.clone()],
            races: [file.allies.race, file.enemies.race],
            type_ids: types.iter().map(|unit| unit.type_id).collect(),
        })
    }

    /// What SMAC calls a team of these types (`map_type`), if it has a name for it.
    #[must_use]
    pub fn map_type(&self) -> Option<&'static str> {
        let mut kinds: Vec<&str> = self.recruits[..self.agents]
            .iter()
            .map(|agent| self.field.profiles[usize::from(agent.kind)].name.as_str())
            .collect();
        kinds.dedup();
        let known = MAP_TYPES.iter().find(|(types, _)| *types == kinds);
        known.map(|(_, name)| *name)
    }

    /// Whether an agent is a healer, which chooses friends instead of enemies.
    #[must_use]
    pub fn is_healer(&self, agent: usize) -> bool {
        let kind = usize::from(self.recruits[agent].kind);
        self.field.profiles[kind].care.is_some()
    }

    /// The agents that a healer chooses from, all that are none themselves, in the order in which it numbers them.
    pub fn patients(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.agents).filter(|agent| !self.is_healer(*agent))
    }

    /// Number of enemies.
    #[must_use]
    pub fn enemies(&self) -> usize {
        self.recruits.len() - self.agents
    }
}

impl MapFile {
    fn groups(&self) -> impl Iterator<Item = (Team, &Group)> {
        let allies = self.allies.groups.iter().map(|group| (Team::Ally, group));
        allies.chain(self.enemies.groups.iter().map(|group| (Team::Enemy, group)))
    }

    pub(super) fn validate(&self, units: &UnitTypes) -> Result<(), String> {
        if !(1..=100_000).contains(&self.episode_limit) {
            return Err(format!(
                "episode_limit is {}, expected 1..=100000",
                self.episode_limit
            ));
        }
        let mut sizes = [0_usize; 2];
        for (team, group) in self.groups() {
            if units.find(&group.unit).is_none() {
                return Err(format!(
                    "no statistics for unit `{}`, expected one of {}",
                    group.unit,
                    units
                        .types
                        .iter()
                        .map(|unit| unit.name.as_str())
                        .collect::<Vec<_>>()
                        .join(", ")
                ));
            }
            if !(1..=100).contains(&group.count) {
                return Err(format!(
                    "a group has {} units, expected 1..=100",
                    group.count
                ));
            }
            check_point(group.at)?;
            sizes[usize::from(team == Team::Enemy)] += group.count;
        }
        let [allies, enemies] = sizes;
        if allies == 0 || enemies == 0 || allies + enemies > mackrl_env::EntitySet::CAPACITY {
            return Err(format!(
                "{allies} allies and {enemies} enemies, expected at least one each and at most {} in all",
                mackrl_env::EntitySet::CAPACITY
            ));
        }
        match self.enemies.order {
            EnemyOrder::None | EnemyOrder::Hunt => Ok(()),
            EnemyOrder::AttackMove(to) => check_point(to),
            EnemyOrder::AttackMoveBetween(ends) => ends.into_iter().try_for_each(check_point),
        }
    }
}

/// Reads a point. Arrays as such would be read up to their length, and what is written beyond it passed over.
pub(super) fn exactly<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f32; 2], D::Error> {
    pair(Vec::deserialize(deserializer)?, "numbers, [x, y]")
}

fn exactly_points<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[[f32; 2]; 2], D::Error> {
    let points: Vec<Vec<f32>> = Vec::deserialize(deserializer)?;
    let [from, to] = pair(points, "points, [[x, y], [x, y]]")?;
    Ok([pair(from, "numbers, [x, y]")?, pair(to, "numbers, [x, y]")?])
}

fn pair<T, E: Error>(list: Vec<T>, of_what: &str) -> Result<[T; 2], E> {
    let length = list.len();
    let expected = || E::custom(format!("found an array of {length}, expected 2 {of_what}"));
    list.try_into().map_err(|_| expected())
}

/// Mean of the groups' points, weighted by their sizes.
fn centre(groups: &[Group]) -> [f32; 2] {
    let units: usize = groups.iter().map(|group| group.count).sum();
    [0, 1].map(|axis| {
        groups
            .iter()
            .map(|group| group.at[axis] * group.count as f32)
            .sum::<f32>()
            / units as f32
    })
}

fn check_point(point: [f32; 2]) -> Result<(), String> {
    if point
        .iter()
        .all(|coordinate| (0.0..=32.0).contains(coordinate))
    {
        Ok(())
    } else {
        Err(format!(
            "point {point:?} lies outside the map, expected coordinates in [0, 32]"
        ))
    }
}

fn place_armies(
    file: &MapFile,
    field: &Battlefield,
    names: &[&str],
) -> Result<Vec<Recruit>, String> {
    let fronts = [centre(&file.enemies.groups), centre(&file.allies.groups)];
    let mut taken = Vec::new();
    let mut recruits = Vec::new();
    for (team, group) in file.groups() {
        let kind = names
            .iter()
            .position(|name| *name == group.unit)
            .unwrap_or_default();
        let profiles: Vec<&Profile> = vec![&field.profiles[kind]; group.count];
        let places = spread_around(
            group.at,
            fronts[usize::from(team == Team::Enemy)],
            &profiles,
            &field.terrain,
            &mut taken,
        )
        .ok_or_else(|| {
            format!(
                "no room for {} {} at {:?}",
                group.count, group.unit, group.at
            )
        })?;
        let kind = u8::try_from(kind).map_err(|_| "more than 256 unit types".to_owned())?;
        recruits.extend(places.into_iter().map(|at| Recruit { kind, team, at }));
    }
    Ok(recruits)
}
