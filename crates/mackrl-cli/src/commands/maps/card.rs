//! All about one map.

use std::fmt;

use mackrl_env::EnvironmentSpec;
use mackrl_skirmish::{
    Skirmish,
    rules::Team,
    scenario::{EnemyOrder, Group, Race, Recruit},
    terrain::{MAP_SIZE, Terrain},
};
use serde::Serialize;

use super::{known::Known, row::Row};

/// A map with its armies and its terrain.
#[derive(Debug, Serialize)]
pub(super) struct Card {
    #[serde(flatten)]
    row: Row,
    /// Groups of agents, as the map's file states them.
    allies: Vec<Group>,
    /// Groups of enemies.
    enemies: Vec<Group>,
    enemy_order: EnemyOrder,
    /// Who stands where at the start: agents in their order, then enemies in theirs.
    starts: Vec<Start>,
    /// The terrain in the form that a scenario file takes: `.` walkable, `#` not, the northernmost line first.
    terrain: Vec<String>,
    #[serde(skip)]
    races: [Race; 2],
}

#[derive(Debug, Serialize)]
struct Start {
    team: Team,
    unit: String,
    at: [f32; 2],
}

/// The matrix game, which has neither enemies nor terrain.
#[derive(Debug, Serialize)]
pub(super) struct MatrixGameCard {
    name: String,
    n_agents: usize,
    n_actions: usize,
    obs_size: usize,
    state_size: usize,
    episode_limit: usize,
}

impl Card {
    pub(super) fn of(skirmish: &Skirmish, known: Option<Known>) -> Self {
        let scenario = skirmish.scenario();
        let [allies, enemies] = scenario.armies.clone();
        let start = |recruit: &Recruit| Start {
            team: recruit.team,
            unit: scenario.field.profiles[usize::from(recruit.kind)]
                .name
                .clone(),
            at: recruit.at,
        };
        Self {
            row: Row::of(skirmish, known),
            allies,
            enemies,
            enemy_order: scenario.enemy_order,
            starts: scenario.recruits.iter().map(start).collect(),
            terrain: drawing(&scenario.field.terrain),
            races: scenario.races,
        }
    }

    /// Two characters for each cell, so that the map looks square, with the units at their starts.
    fn picture(&self) -> String {
        let line = |(index, cells): (usize, &String)| {
            let y = MAP_SIZE - 1 - index;
            let cell = |(x, ground)| match (self.who_starts_in(x, y), ground) {
                (Some(Team::Ally), _) => "A ",
                (Some(Team::Enemy), _) => "e ",
                (None, '.') => ". ",
                (None, _) => "##",
            };
            let line: String = cells.chars().enumerate().map(cell).collect();
            line.trim_end().to_owned() + "\n"
        };
        self.terrain.iter().enumerate().map(line).collect()
    }

    fn who_starts_in(&self, x: usize, y: usize) -> Option<Team> {
        let is_here = |start: &&Start| {
            let inside = |coordinate: f32, cell: usize| (coordinate - cell as f32).floor() == 0.0;
            inside(start.at[0], x) && inside(start.at[1], y)
        };
        self.starts.iter().find(is_here).map(|start| start.team)
    }
}

impl MatrixGameCard {
    pub(super) fn new(spec: &EnvironmentSpec) -> Self {
        Self {
            name: spec.name.clone(),
            n_agents: spec.agents,
            n_actions: spec.actions,
            obs_size: spec.observation_size,
            state_size: spec.state_size,
            episode_limit: spec.episode_limit,
        }
    }
}

impl fmt::Display for Card {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let row = &self.row;
        let [ally, enemy] = self.races.map(in_words);
        writeln!(
            formatter,
            "{}: {} ({ally}) against {} ({enemy}), at most {} steps\n",
            row.name,
            counted(row.n_agents, ["agent", "agents"]),
            counted(row.n_enemies, ["enemy", "enemies"]),
            row.episode_limit
        )?;
        let order = order_in_words(self.enemy_order);
        let product = |[rows, length]: [usize; 2]| format!("{rows} × {length}");
        let lines = [
            ("agents", groups_in_words(&self.allies)),
            ("enemies", groups_in_words(&self.enemies) + "; " + &order),
            (
                "n_actions",
                format!("{} = 6 + {} for targets", row.n_actions, row.n_actions - 6),
            ),
            (
                "type_bits",
                match row.unit_type_bits {
                    0 => "0, because each side is of one type".to_owned(),
                    bits => format!("{bits}, one for each type on either side"),
                },
            ),
            (
                "obs_size",
                format!(
                    "{} = {} for moves + {} for enemies + {} for allies + {} for itself",
                    row.obs_size,
                    row.obs_move_feats,
                    product(row.obs_enemy_feats),
                    product(row.obs_ally_feats),
                    row.obs_own_feats
                ),
            ),
            (
                "state_size",
                format!(
                    "{} = {} for agents + {} for enemies + {} for last actions",
                    row.state_size,
                    product(row.state_ally_feats),
                    product(row.state_enemy_feats),
                    product(row.state_last_actions)
                ),
            ),
            (
                "max_reward",
                format!(
                    "{} = {} of life and shields + 10 for each enemy + 200 for the victory, scaled to 20",
                    row.max_reward, row.enemy_health
                ),
            ),
        ];
        for (name, value) in lines {
            writeln!(formatter, "{name:<12}{value}")?;
        }
        if let Some(known) = &row.known {
            writeln!(
                formatter,
                "{:<12}{}, on the real game",
                "difficulty", known.difficulty
            )?;
            writeln!(formatter, "{:<12}{}", "won", known.words())?;
        }
        let edge = MAP_SIZE;
        writeln!(
            formatter,
            "\nThe start: A agents, e enemies, ## where no unit can walk. {edge} × {edge} cells of one map unit, (0, 0) at the lower left.\n"
        )?;
        formatter.write_str(&self.picture())
    }
}

impl fmt::Display for MatrixGameCard {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name,
            n_agents,
            n_actions,
            obs_size,
            state_size,
            episode_limit,
        } = self;
        writeln!(
            formatter,
            "{name}: {n_agents} agents earn the entry of a payoff matrix that they choose together, in {episode_limit} step\n"
        )?;
        for (name, value) in [
            ("n_actions", n_actions),
            ("obs_size", obs_size),
            ("state_size", state_size),
        ] {
            writeln!(formatter, "{name:<12}{value}")?;
        }
        writeln!(
            formatter,
            "\nSettings: env.payoffs, env.distribution and env.common_knowledge; `mackrl reproduce figure5` is the paper's experiment."
        )
    }
}

/// The terrain as a scenario file draws it.
fn drawing(terrain: &Terrain) -> Vec<String> {
    let cells = 0..i32::try_from(MAP_SIZE).unwrap_or(i32::MAX);
    let line = |y: i32| {
        let cell = |x: i32| if terrain.is_walkable(x, y) { '.' } else { '#' };
        cells.clone().map(cell).collect()
    };
    cells.clone().rev().map(line).collect()
}

fn groups_in_words(groups: &[Group]) -> String {
    let group = |group: &Group| format!("{} {} at {}", group.count, group.unit, point(group.at));
    groups.iter().map(group).collect::<Vec<_>>().join(", ")
}

fn order_in_words(order: EnemyOrder) -> String {
    match order {
        EnemyOrder::None => "they stay and fight what comes near".to_owned(),
        EnemyOrder::Hunt => "they hunt the agents".to_owned(),
        EnemyOrder::AttackMove(to) => format!("they attack-move to {}", point(to)),
        EnemyOrder::AttackMoveBetween([from, to]) => format!(
            "they attack-move to a random point between {} and {}",
            point(from),
            point(to)
        ),
    }
}

fn counted(count: usize, [one, many]: [&str; 2]) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

fn point([x, y]: [f32; 2]) -> String {
    format!("({x}, {y})")
}

const fn in_words(race: Race) -> &'static str {
    match race {
        Race::Terran => "terran",
        Race::Protoss => "protoss",
        Race::Zerg => "zerg",
    }
}
