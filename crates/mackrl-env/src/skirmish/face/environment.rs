//! A skirmish as an environment.

use std::sync::Arc;

use crate::{
    Action, AgentId, Environment, EnvironmentSpec, EpisodeEnd, EpisodeKey, EpisodeStatistics,
    IllegalAction, ObservationMut, PriorKnowledge, TimeStep,
    skirmish::{
        actions::{DIRECTIONS, MOVES_FROM, NO_OPERATION, STOP, TARGETS_FROM},
        error::SkirmishError,
        face::{
            knowledge::SkirmishKnowledge,
            layout::Layout,
            observation::Scene,
            reward::{Outcome, Rewards},
            state_vector::cooldown_scale,
        },
        rules::{Battle, BattleState, Chance, Order, Stance, Team, UnitIndex},
        scenario::{EnemyOrder, Scenario},
        settings::SkirmishSettings,
    },
};

/// A StarCraft micromanagement map: agents against the game's own units, with SMAC's interface.
///
/// A step gives every living agent one order, plays `step_mul` loops and shows what has come of it.
#[derive(Debug, Clone)]
pub struct Skirmish {
    scenario: Arc<Scenario>,
    settings: SkirmishSettings,
    spec: EnvironmentSpec,
    layout: Layout,
    knowledge: Arc<SkirmishKnowledge>,
    cooldown_scales: Vec<f32>,
    /// The state in which every episode starts, but for the enemies' orders.
    muster: BattleState,
    pub(super) battle: Battle,
    rewards: Rewards,
    last_actions: Vec<Option<Action>>,
    key: EpisodeKey,
    steps: usize,
    statistics: EpisodeStatistics,
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

impl Skirmish {
    /// Sets up `scenario` to be played under `settings`.
    ///
    /// # Errors
    /// [`SkirmishError::Setting`] if a setting is out of range.
    pub fn new(scenario: Arc<Scenario>, settings: SkirmishSettings) -> Result<Self, SkirmishError> {
        settings.validate()?;
        let layout = Layout::new(&scenario, &settings);
        let mut battle = Battle::new(scenario.field.clone(), scenario.recruits.len());
        for recruit in &scenario.recruits {
            let stance = match recruit.team {
                Team::Ally => Stance::Passive,
                Team::Enemy => Stance::Aggressive,
            };
            battle.add(recruit.kind, recruit.team, stance, recruit.at);
        }
        let profiles = &scenario.field.profiles;
        Ok(Self {
            spec: layout.spec(&scenario, &settings),
            knowledge: Arc::new(SkirmishKnowledge::new(&scenario, &settings)),
            cooldown_scales: profiles
                .iter()
                .map(|profile| cooldown_scale(&profile.name))
                .collect(),
            muster: battle.state().clone(),
            rewards: Rewards::new(battle.state(), scenario.agents, &settings),
            last_actions: vec![None; scenario.agents],
            key: EpisodeKey::new(0, crate::Stream::Other, 0),
            steps: 0,
            statistics: EpisodeStatistics::default(),
            tally: BattleTally::default(),
            layout,
            battle,
            settings,
            scenario,
        })
    }

    /// The battle as it stands.
    #[must_use]
    pub fn battle(&self) -> &Battle {
        &self.battle
    }

    /// Sizes of what agents and critics are shown.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The greatest return before scaling: the enemies' life and shields, their deaths, and the victory.
    #[must_use]
    pub fn max_reward(&self) -> f32 {
        self.rewards.greatest()
    }

    /// The map.
    #[must_use]
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Episodes ended and won since the environment was made.
    #[must_use]
    pub fn tally(&self) -> BattleTally {
        self.tally
    }

    /// How it is played and shown to agents.
    #[must_use]
    pub fn settings(&self) -> &SkirmishSettings {
        &self.settings
    }

    /// A number that differs, but for chance, when two states of the battle differ; the same on every machine.
    #[must_use]
    pub fn state_hash(&self) -> u64 {
        self.battle.state().hash()
    }

    pub(super) fn write(&self, out: &mut ObservationMut<'_>) {
        let scene = self.scene();
        scene.write(out);
        if self.layout.obs_instead_of_state {
            out.state_g.copy_from_slice(out.observation_no);
        } else {
            scene.write_state(&self.cooldown_scales, out.state_g);
        }
    }

    fn scene(&self) -> Scene<'_> {
        Scene {
            layout: &self.layout,
            knowledge: &self.knowledge,
            battle: &self.battle,
            last_actions: &self.last_actions,
            sight_range: self.settings.sight_range,
            time: self.steps as f32 / self.spec.episode_limit as f32,
        }
    }

    fn order_enemies(&mut self, chance: &mut Chance) {
        let to = match self.scenario.enemy_order {
            EnemyOrder::None => return,
            EnemyOrder::Hunt => None,
            EnemyOrder::AttackMove(to) => Some(to),
            EnemyOrder::AttackMoveBetween([from, to]) => {
                let part = chance.uniform();
                Some([0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * part))
            }
        };
        for index in self.layout.agents..self.scenario.recruits.len() {
            let order = to.map_or(Order::Hunt, |to| Order::AttackMove {
                to: self.place_in_formation(index, to),
            });
            self.battle.order(unit_index(index), order);
        }
    }

    /// Where an enemy goes when the army is sent to `to`: the army keeps its formation, as far as there is ground.
    fn place_in_formation(&self, index: usize, to: [f32; 2]) -> [f32; 2] {
        let at = self.scenario.recruits[index].at;
        let place = [0, 1].map(|axis| to[axis] + at[axis] - self.scenario.enemy_centre[axis]);
        let field = &self.scenario.field;
        let radius = field.profiles[usize::from(self.scenario.recruits[index].kind)].inner_radius;
        let (x, y) = field
            .terrain
            .pushed_out_of_walls(place[0], place[1], radius);
        if [x, y] == place { place } else { to }
    }

    fn order_agents(&mut self, actions: &[Action]) {
        for (agent, action) in actions.iter().enumerate() {
            let (x, y) = (self.battle.state().x[agent], self.battle.state().y[agent]);
            let far = self.settings.move_amount;
            let order = match action.index() {
                NO_OPERATION => continue,
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
                        .expect("actions are checked to be available");
                    let target = unit_index(target);
                    if self.knowledge.is_healer(agent) {
                        Order::Heal { target }
                    } else {
                        Order::Attack { target }
                    }
                }
            };
            self.battle.order(unit_index(agent), order);
        }
    }

    fn outcome(&self) -> Outcome {
        let state = self.battle.state();
        let (allies, enemies) = (state.living(Team::Ally), state.living(Team::Enemy));
        // Where the team has healers, SMAC ends the battle when only healers are left: the team's own first, even if all
        // are dead, then a single one of the enemy's.
        let has_healers = (0..self.layout.agents).any(|agent| self.knowledge.is_healer(agent));
        if has_healers && self.fighters(Team::Ally) == 0 {
            return Outcome::Lost;
        }
        match (allies, enemies) {
            (0, 0) => Outcome::BothDead,
            (0, _) => Outcome::Lost,
            (_, 0) => Outcome::Won,
            (_, 1) if has_healers && self.fighters(Team::Enemy) == 0 => Outcome::Won,
            _ => Outcome::Undecided,
        }
    }

    /// Living units of `team` that do not heal.
    fn fighters(&self, team: Team) -> usize {
        let (state, field) = (self.battle.state(), self.battle.field());
        state
            .units
            .iter()
            .filter(|unit| {
                unit.team == team
                    && unit.is_alive()
                    && field.profiles[usize::from(unit.kind)].care.is_none()
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

impl Environment for Skirmish {
    fn spec(&self) -> &EnvironmentSpec {
        &self.spec
    }

    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        self.knowledge.clone()
    }

    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) {
        self.key = key;
        self.steps = 0;
        self.battle.restore(&self.muster);
        self.order_enemies(&mut Chance::new(key, 0));
        self.rewards.remember(self.battle.state());
        self.last_actions.fill(None);
        self.statistics = EpisodeStatistics::default();
        self.write(out);
    }

    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, IllegalAction> {
        assert_eq!(actions.len(), self.layout.agents, "one action per agent");
        let scene = self.scene();
        for (agent, action) in actions.iter().enumerate() {
            if !scene.is_available(agent, action.index()) {
                return Err(IllegalAction {
                    agent: AgentId::new(agent),
                    action: *action,
                });
            }
        }
        self.order_agents(actions);
        for (last_action, action) in self.last_actions.iter_mut().zip(actions) {
            *last_action = Some(*action);
        }
        self.steps += 1;
        let mut chance = Chance::new(self.key, self.steps);
        for _ in 0..self.settings.step_mul {
            self.battle.advance(&mut chance);
        }
        let outcome = self.outcome();
        let reward = self
            .rewards
            .settle(self.battle.state(), outcome, &self.settings);
        let state = self.battle.state();
        self.statistics = EpisodeStatistics {
            battle_won: outcome == Outcome::Won,
            dead_allies: self.layout.agents - state.living(Team::Ally),
            dead_enemies: self.layout.enemies - state.living(Team::Enemy),
        };
        self.write(out);
        let end = self.end(outcome);
        self.tally.battles_game += u64::from(end.is_some());
        self.tally.battles_won += u64::from(outcome == Outcome::Won);
        self.tally.timeouts += u64::from(end == Some(EpisodeEnd::Truncated));
        Ok(TimeStep { reward, end })
    }

    fn statistics(&self) -> EpisodeStatistics {
        self.statistics
    }
}

fn unit_index(index: usize) -> UnitIndex {
    UnitIndex::try_from(index).expect("a battle has ≤ 256 units")
}
