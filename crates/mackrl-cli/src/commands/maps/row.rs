//! A map as a line of a list.

use mackrl_env::Environment;
use mackrl_skirmish::{Skirmish, rules::Team, scenario::Race};
use serde::Serialize;

use super::known::{self, Known};
use crate::output;

/// The numbers of a map, by the names that SMAC users know. A pair of features is how many rows there are and how long each is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Row {
    pub(super) name: String,
    pub(super) n_agents: usize,
    pub(super) n_enemies: usize,
    a_race: char,
    b_race: char,
    pub(super) episode_limit: usize,
    shield_bits_ally: usize,
    shield_bits_enemy: usize,
    pub(super) unit_type_bits: usize,
    /// SMAC's word for the team; `null` for a scenario that has none.
    map_type: Option<&'static str>,
    pub(super) n_actions: usize,
    pub(super) obs_size: usize,
    pub(super) obs_move_feats: usize,
    pub(super) obs_enemy_feats: [usize; 2],
    pub(super) obs_ally_feats: [usize; 2],
    pub(super) obs_own_feats: usize,
    pub(super) state_size: usize,
    pub(super) state_ally_feats: [usize; 2],
    pub(super) state_enemy_feats: [usize; 2],
    pub(super) state_last_actions: [usize; 2],
    /// Hit points and shields of all enemies.
    pub(super) enemy_health: f64,
    /// The greatest return before scaling.
    pub(super) max_reward: f64,
    /// What rewards are multiplied by.
    pub(super) reward_scale: f64,
    /// How hard it is and the best results; `null` for a scenario.
    pub(super) known: Option<Known>,
}

impl Row {
    pub(super) fn of(skirmish: &Skirmish, known: Option<Known>) -> Self {
        let (spec, layout, scenario) = (skirmish.spec(), skirmish.layout(), skirmish.scenario());
        let max_reward = f64::from(skirmish.max_reward());
        let health = |kind: u8| {
            let profile = &scenario.field.profiles[usize::from(kind)];
            f64::from(profile.life + profile.shield)
        };
        let enemies = scenario.recruits.iter();
        let enemies = enemies.filter(|recruit| recruit.team == Team::Enemy);
        Self {
            name: spec.name.clone(),
            n_agents: layout.agents,
            n_enemies: layout.enemies,
            a_race: letter(scenario.races[0]),
            b_race: letter(scenario.races[1]),
            episode_limit: spec.episode_limit,
            shield_bits_ally: layout.ally_shields,
            shield_bits_enemy: layout.enemy_shields,
            unit_type_bits: layout.type_bits,
            map_type: scenario.map_type(),
            n_actions: spec.actions,
            obs_size: spec.observation_size,
            obs_move_feats: layout.move_row(),
            obs_enemy_feats: [layout.enemies, layout.enemy_row()],
            obs_ally_feats: [layout.agents - 1, layout.ally_row()],
            obs_own_feats: layout.own_row(),
            state_size: spec.state_size,
            state_ally_feats: [layout.agents, layout.state_ally_row()],
            state_enemy_feats: [layout.enemies, layout.state_enemy_row()],
            state_last_actions: [layout.agents, layout.state_last_action_row()],
            enemy_health: enemies.map(|enemy| health(enemy.kind)).sum(),
            max_reward,
            reward_scale: f64::from(skirmish.settings().reward_scale_rate) / max_reward,
            known,
        }
    }

    /// One line for each row, under a heading.
    pub(super) fn table(rows: &[Self]) -> String {
        let heading = [
            "name",
            "sides",
            "races",
            "kind",
            "steps",
            "difficulty",
            "scripted",
            "trained",
        ];
        let mut cells = vec![heading.map(str::to_owned).to_vec()];
        cells.extend(rows.iter().map(|row| {
            let known = row.known.as_ref();
            let share = |result: Option<&known::Result>| {
                result.map_or_else(String::new, known::Result::share)
            };
            vec![
                row.name.clone(),
                format!("{} v {}", row.n_agents, row.n_enemies),
                format!("{} v {}", row.a_race, row.b_race),
                row.map_type.unwrap_or_default().to_owned(),
                row.episode_limit.to_string(),
                known.map_or_else(String::new, |known| known.difficulty.to_owned()),
                share(known.and_then(Known::scripted)),
                share(known.and_then(Known::trained)),
            ]
        }));
        output::table(&cells)
    }
}

/// The letter by which SMAC's map parameters name a race.
const fn letter(race: Race) -> char {
    match race {
        Race::Terran => 'T',
        Race::Protoss => 'P',
        Race::Zerg => 'Z',
    }
}
