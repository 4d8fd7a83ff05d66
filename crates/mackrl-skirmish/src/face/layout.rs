//! Sizes of an observation and of its parts, derived from a scenario and the settings.

use mackrl_env::EnvironmentSpec;

use crate::{
    actions::{DIRECTIONS, TARGETS_FROM},
    face::statistics::BattleStatistics,
    rules::Team,
    scenario::{Race, Scenario},
    settings::{Compatibility, SkirmishSettings},
};

/// Sizes and positions of all that agents and critics are shown: what SMAC's `get_obs_enemy_feats_size` and the like tell.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// N: agents.
    pub agents: usize,
    /// Their enemies.
    pub enemies: usize,
    /// A: actions of an agent.
    pub actions: usize,
    /// 1 if allies are observed with shields, else 0.
    pub ally_shields: usize,
    /// 1 if enemies are observed with shields, else 0.
    pub enemy_shields: usize,
    /// Length of SMAC's one-hot of types: the number of types on both sides, 0 if each side is all of one type.
    pub type_bits: usize,
    /// Per kind: its place in the one-hot of an ally.
    pub(super) ally_type: Vec<Option<usize>>,
    /// Per kind: its place in the one-hot of an enemy.
    pub(super) enemy_type: Vec<Option<usize>>,
    /// Whether agents see the last actions of allies.
    pub(super) obs_last_action: bool,
    /// Whether agents see their own life and shield.
    pub(super) obs_own_health: bool,
    /// Whether agents see the life and shields of others.
    pub(super) obs_all_health: bool,
    /// Whether agents see where one can walk around them.
    pub(super) obs_pathing_grid: bool,
    /// Whether agents see how high the ground around them is.
    pub(super) obs_terrain_height: bool,
    /// Whether agents see the time.
    pub(super) obs_timestep_number: bool,
    /// Whether the state is all agents' observations.
    pub(super) obs_instead_of_state: bool,
    /// Whether the state ends with the time.
    pub(super) state_timestep_number: bool,
    /// Whether the state ends with last actions.
    pub(super) state_last_action: bool,
    /// Whether entity features have a shield.
    pub(super) entity_shields: bool,
    /// Length of the one-hot of an entity's kind: 0 if there is one kind only.
    pub(super) entity_kinds: usize,
}

impl Layout {
    pub(super) fn new(scenario: &Scenario, settings: &SkirmishSettings) -> Self {
        let kinds = scenario.field.profiles.len();
        // Where both sides have the same kinds, as on all maps of SMAC on which there is something to tell apart, these are the
        // numbers of SMAC, which knows the kinds of allies alone.
        let is_mixed = |team: Team| {
            let mut army = scenario.recruits.iter().filter(|unit| unit.team == team);
            let first = army.next();
            army.any(|unit| Some(unit.kind) != first.map(|first| first.kind))
        };
        let type_bits = if is_mixed(Team::Ally) || is_mixed(Team::Enemy) {
            kinds
        } else {
            0
        };
        let place = |order: &[usize], kind: usize| {
            order
                .iter()
                .position(|other| *other == kind)
                .filter(|_| type_bits > 0)
        };
        let ally_order: Vec<usize> = (0..kinds).collect();
        let enemy_order = enemy_type_order(scenario, settings.compat, &ally_order);
        Self {
            agents: scenario.agents,
            enemies: scenario.enemies(),
            actions: TARGETS_FROM + targets(scenario),
            ally_shields: usize::from(scenario.races[0] == Race::Protoss),
            enemy_shields: usize::from(scenario.races[1] == Race::Protoss),
            type_bits,
            ally_type: (0..kinds).map(|kind| place(&ally_order, kind)).collect(),
            enemy_type: (0..kinds).map(|kind| place(&enemy_order, kind)).collect(),
            obs_last_action: settings.obs_last_action,
            state_last_action: settings.state_last_action,
            obs_own_health: settings.obs_own_health,
            obs_all_health: settings.obs_all_health,
            obs_pathing_grid: settings.obs_pathing_grid,
            obs_terrain_height: settings.obs_terrain_height,
            obs_timestep_number: settings.obs_timestep_number,
            obs_instead_of_state: settings.obs_instead_of_state,
            state_timestep_number: settings.state_timestep_number,
            entity_shields: scenario
                .field
                .profiles
                .iter()
                .any(|profile| profile.shield > 0.0),
            entity_kinds: if kinds > 1 { kinds } else { 0 },
        }
    }

    /// \[move available north, south, east, west, (walkable around), (heights around)\].
    #[must_use]
    pub fn move_row(&self) -> usize {
        let pathing = if self.obs_pathing_grid { 8 } else { 0 };
        let heights = if self.obs_terrain_height { 9 } else { 0 };
        DIRECTIONS.len() + pathing + heights
    }

    /// \[attackable, distance, x, y, (life, (shield)), (type)\].
    #[must_use]
    pub fn enemy_row(&self) -> usize {
        4 + self.health(self.enemy_shields) + self.type_bits
    }

    /// Entries for the life and shield of somebody else.
    fn health(&self, shields: usize) -> usize {
        if self.obs_all_health { 1 + shields } else { 0 }
    }

    /// \[visible, distance, x, y, (life, (shield)), (type), (last action)\].
    #[must_use]
    pub fn ally_row(&self) -> usize {
        let last_action = if self.obs_last_action {
            self.actions
        } else {
            0
        };
        4 + self.health(self.ally_shields) + self.type_bits + last_action
    }

    /// \[(life, (shield)), (type)\].
    #[must_use]
    pub fn own_row(&self) -> usize {
        let health = if self.obs_own_health {
            1 + self.ally_shields
        } else {
            0
        };
        health + self.type_bits
    }

    /// O: moves, enemies, allies, the agent itself, the time if shown.
    #[must_use]
    pub fn observation_size(&self) -> usize {
        self.move_row()
            + usize::from(self.obs_timestep_number)
            + self.enemies * self.enemy_row()
            + (self.agents - 1) * self.ally_row()
            + self.own_row()
    }

    /// \[life, cooldown, x, y, (shield), (type)\].
    #[must_use]
    pub fn state_ally_row(&self) -> usize {
        4 + self.ally_shields + self.type_bits
    }

    /// \[life, x, y, (shield), (type)\].
    #[must_use]
    pub fn state_enemy_row(&self) -> usize {
        3 + self.enemy_shields + self.type_bits
    }

    /// One-hot of an agent's last action, if the state holds it.
    #[must_use]
    pub fn state_last_action_row(&self) -> usize {
        if self.state_last_action {
            self.actions
        } else {
            0
        }
    }

    /// G.
    #[must_use]
    pub fn state_size(&self) -> usize {
        if self.obs_instead_of_state {
            return self.agents * self.observation_size();
        }
        self.agents * self.state_ally_row()
            + self.enemies * self.state_enemy_row()
            + self.agents * self.state_last_action_row()
            + usize::from(self.state_timestep_number)
    }

    /// F: \[x, y, life, (shield), (kind)\].
    pub(super) fn entity_features(&self) -> usize {
        3 + usize::from(self.entity_shields) + self.entity_kinds
    }

    pub(super) fn spec(&self, scenario: &Scenario, settings: &SkirmishSettings) -> EnvironmentSpec {
        EnvironmentSpec {
            name: scenario.name.clone(),
            agents: self.agents,
            entities: self.agents + self.enemies,
            entity_features: self.entity_features(),
            position_features: 2,
            actions: self.actions,
            observation_size: self.observation_size(),
            state_size: self.state_size(),
            episode_limit: match settings.episode_limit {
                0 => scenario.episode_limit,
                limit => limit,
            },
            distance_scale: settings.sight_range,
            statistics: BattleStatistics::declared().to_vec(),
            success: Some(0),
        }
    }
}

/// Actions with a target: as many as there are enemies, or agents that a healer can choose if those are more.
fn targets(scenario: &Scenario) -> usize {
    let patients = scenario.patients().count();
    let has_healers = patients < scenario.agents;
    scenario
        .enemies()
        .max(if has_healers { patients } else { 0 })
}

/// Kinds in the order of the one-hot of enemies. SMAC numbers allies by their own type ids, which are alphabetical, and
/// enemies by the game's, which differ on maps of stalkers (74) and zealots (73): there an enemy zealot comes first.
fn enemy_type_order(
    scenario: &Scenario,
    compat: Compatibility,
    ally_order: &[usize],
) -> Vec<usize> {
    let mut order = ally_order.to_vec();
    let names: Vec<&str> = order
        .iter()
        .map(|kind| scenario.field.profiles[*kind].name.as_str())
        .collect();
    if compat == Compatibility::Smac && names == ["stalker", "zealot"] {
        order.sort_by_key(|kind| scenario.type_ids[*kind]);
    }
    order
}
