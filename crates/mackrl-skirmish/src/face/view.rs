//! What a team is shown of a battle and paid for it, from nothing but everybody's state.
//!
//! It does not matter where the state comes from: [`crate::Skirmish`] takes it from the simulator, and a client of the real
//! game fills it with what the game reports. Both therefore compute observations, availability, rewards and endings by the
//! same code.

use std::sync::Arc;

use mackrl_env::{
    Action, AgentId, EnvironmentSpec, EpisodeEnd, IllegalAction, ObservationMut, TimeStep,
};

use crate::{
    actions::{DIRECTIONS, MOVES_FROM, NO_OPERATION, STOP, TARGETS_FROM},
    error::SkirmishError,
    face::{
        knowledge::SkirmishKnowledge,
        layout::Layout,
        observation::Scene,
        reward::{Outcome, Rewards},
        state_vector::cooldown_scale,
        statistics::BattleStatistics,
    },
    rules::{BattleState, Order, Team, UnitIndex},
    scenario::Scenario,
    settings::SkirmishSettings,
};

/// The reinforcement-learning side of one battle: sizes, observations, orders, rewards, ends.
#[derive(Debug, Clone)]
pub struct Face {
    scenario: Arc<Scenario>,
    settings: SkirmishSettings,
    spec: EnvironmentSpec,
    layout: Layout,
    knowledge: Arc<SkirmishKnowledge>,
    cooldown_scales: Vec<f32>,
    rewards: Rewards,
    last_actions: Vec<Option<Action>>,
    steps: usize,
    statistics: BattleStatistics,
    tally: BattleTally,
}

/// Episodes that have ended since the environment was made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct BattleTally {
    /// All of them.
    pub battles_game: u64,
    /// Those that the agents won.
    pub battles_won: u64,
    /// Those that ran out of time, which SMAC also counts as draws.
    pub timeouts: u64,
}

impl BattleTally {
    /// Battles won of battles ended; 0 before the first.
    #[must_use]
    pub fn win_rate(&self) -> f64 {
        self.battles_won as f64 / self.battles_game.max(1) as f64
    }
}

impl Face {
    /// Shows battles of `scenario` under `settings`. Rewards are scaled by the enemies of `start`, where every episode begins.
    ///
    /// # Errors
    /// [`SkirmishError::Setting`] if a setting is out of range.
    pub fn new(
        scenario: Arc<Scenario>,
        settings: SkirmishSettings,
        start: &BattleState,
    ) -> Result<Self, SkirmishError> {
        settings.validate()?;
        let layout = Layout::new(&scenario, &settings);
        let profiles = &scenario.field.profiles;
        Ok(Self {
            spec: layout.spec(&scenario, &settings),
            knowledge: Arc::new(SkirmishKnowledge::new(&scenario, &settings)),
            cooldown_scales: profiles.iter().map(cooldown_scale).collect(),
            rewards: Rewards::new(start, scenario.agents, &settings),
            last_actions: vec![None; scenario.agents],
            steps: 0,
            statistics: BattleStatistics::default(),
            tally: BattleTally::default(),
            layout,
            settings,
            scenario,
        })
    }

    /// Sizes and limits.
    #[must_use]
    pub const fn spec(&self) -> &EnvironmentSpec {
        &self.spec
    }

    /// Sizes of what agents and critics are shown.
    #[must_use]
    pub const fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The greatest return before scaling.
    #[must_use]
    pub const fn max_reward(&self) -> f32 {
        self.rewards.greatest()
    }

    /// What agents know before the battle.
    #[must_use]
    pub const fn knowledge(&self) -> &Arc<SkirmishKnowledge> {
        &self.knowledge
    }

    /// How it is played and shown to agents.
    #[must_use]
    pub const fn settings(&self) -> &SkirmishSettings {
        &self.settings
    }

    /// How the current episode stands.
    #[must_use]
    pub const fn statistics(&self) -> BattleStatistics {
        self.statistics
    }

    /// Episodes ended and won so far.
    #[must_use]
    pub const fn tally(&self) -> BattleTally {
        self.tally
    }

    /// Steps of the current episode.
    #[must_use]
    pub const fn steps(&self) -> usize {
        self.steps
    }

    /// Begins an episode that starts in `state`, and shows it.
    pub fn begin(&mut self, state: &BattleState, out: &mut ObservationMut<'_>) {
        self.steps = 0;
        self.rewards.remember(state);
        self.last_actions.fill(None);
        self.statistics = BattleStatistics::default();
        self.write(state, out);
    }

    /// Whether all `actions` are available in `state`.
    ///
    /// # Errors
    /// [`IllegalAction`] names the first agent whose action is not.
    ///
    /// # Panics
    /// If `actions` does not hold one action per agent.
    pub fn check(&self, state: &BattleState, actions: &[Action]) -> Result<(), IllegalAction> {
        assert_eq!(actions.len(), self.layout.agents, "one action per agent");
        let is_illegal =
            |(agent, action): &(usize, &Action)| !self.is_available(state, *agent, **action);
        match actions.iter().enumerate().find(is_illegal) {
            None => Ok(()),
            Some((agent, action)) => Err(IllegalAction {
                agent: AgentId::new(agent),
                action: *action,
            }),
        }
    }

    /// Whether `action` is available to `agent` in `state`.
    #[must_use]
    pub fn is_available(&self, state: &BattleState, agent: usize, action: Action) -> bool {
        self.scene(state).is_available(agent, action.index())
    }

    /// The order by which `agent` does an available `action` in `state`; none if it rests because it is dead.
    ///
    /// # Panics
    /// If the action has a target that the agent can never aim at.
    #[must_use]
    pub fn order(&self, state: &BattleState, agent: usize, action: Action) -> Option<Order> {
        let (x, y) = (state.x[agent], state.y[agent]);
        let far = self.settings.move_amount;
        Some(match action.index() {
            NO_OPERATION => return None,
            STOP => Order::Stop,
            direction @ MOVES_FROM..TARGETS_FROM => {
                let [dx, dy] = DIRECTIONS[direction - MOVES_FROM];
                Order::Move {
                    to: [x + dx * far, y + dy * far],
                }
            }
            target => {
                let target = self
                    .knowledge
                    .target(agent, target - TARGETS_FROM)
                    .and_then(|target| UnitIndex::try_from(target).ok())
                    .expect("actions are checked to be available");
                if self.knowledge.is_healer(agent) {
                    Order::Heal { target }
                } else {
                    Order::Attack { target }
                }
            }
        })
    }

    /// Closes the step in which the team did `actions` and that led to `state`: shows the state and pays for it.
    pub fn settle(
        &mut self,
        state: &BattleState,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> TimeStep {
        for (last_action, action) in self.last_actions.iter_mut().zip(actions) {
            *last_action = Some(*action);
        }
        self.steps += 1;
        let outcome = self.outcome(state);
        let reward = self.rewards.settle(state, outcome, &self.settings);
        let end = self.end(outcome);
        self.statistics = BattleStatistics {
            battle_won: outcome == Outcome::Won,
            dead_allies: self.layout.agents - state.living(Team::Ally),
            dead_enemies: self.layout.enemies - state.living(Team::Enemy),
            timed_out: end == Some(EpisodeEnd::Truncated),
        };
        self.write(state, out);
        self.tally.battles_game += u64::from(end.is_some());
        self.tally.battles_won += u64::from(outcome == Outcome::Won);
        self.tally.timeouts += u64::from(end == Some(EpisodeEnd::Truncated));
        TimeStep { reward, end }
    }

    pub(super) fn write(&self, state: &BattleState, out: &mut ObservationMut<'_>) {
        let scene = self.scene(state);
        scene.write(out);
        if self.layout.obs_instead_of_state {
            out.state_g.copy_from_slice(out.observation_no);
        } else {
            scene.write_state(&self.cooldown_scales, out.state_g);
        }
    }

    fn scene<'a>(&'a self, state: &'a BattleState) -> Scene<'a> {
        Scene {
            layout: &self.layout,
            knowledge: &self.knowledge,
            field: &self.scenario.field,
            state,
            last_actions: &self.last_actions,
            sight_range: self.settings.sight_range,
            time: self.steps as f32 / self.spec.episode_limit as f32,
        }
    }

    fn outcome(&self, state: &BattleState) -> Outcome {
        let (allies, enemies) = (state.living(Team::Ally), state.living(Team::Enemy));
        // Where the team has healers, SMAC ends the battle when only healers are left: the team's own first, even if all
        // are dead, then a single one of the enemy's.
        let has_healers = (0..self.layout.agents).any(|agent| self.knowledge.is_healer(agent));
        if has_healers && self.fighters(state, Team::Ally) == 0 {
            return Outcome::Lost;
        }
        match (allies, enemies) {
            (0, 0) => Outcome::BothDead,
            (0, _) => Outcome::Lost,
            (_, 0) => Outcome::Won,
            (_, 1) if has_healers && self.fighters(state, Team::Enemy) == 0 => Outcome::Won,
            _ => Outcome::Undecided,
        }
    }

    /// Living units of `team` that do not heal.
    fn fighters(&self, state: &BattleState, team: Team) -> usize {
        let profiles = &self.scenario.field.profiles;
        state
            .units
            .iter()
            .filter(|unit| {
                unit.team == team
                    && unit.is_alive()
                    && profiles[usize::from(unit.kind)].care.is_none()
            })
            .count()
    }

    fn end(&self, outcome: Outcome) -> Option<EpisodeEnd> {
        if outcome != Outcome::Undecided {
            Some(EpisodeEnd::Terminated)
        } else if self.steps >= self.spec.episode_limit {
            Some(EpisodeEnd::Truncated)
        } else {
            None
        }
    }
}
