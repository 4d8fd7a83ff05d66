//! A skirmish as an environment.

use std::sync::Arc;

use mackrl_env::{
    Action, AgentId, Draw, EntityId, Environment, EnvironmentSpec, EpisodeKey, ObservationMut,
    PriorKnowledge, StepError, Stream, TimeStep,
};

use crate::{
    Encounter,
    actions::STOP,
    error::SkirmishError,
    face::{
        layout::Layout,
        statistics::BattleStatistics,
        view::{BattleTally, Face},
    },
    rules::{Battle, Chance, Order, UnitIndex},
    scenario::Scenario,
    settings::SkirmishSettings,
};

/// A StarCraft micromanagement map: agents against the game's own units, with SMAC's interface.
///
/// A step gives every living agent one order, plays `step_mul` loops and shows what has come of it.
#[derive(Debug, Clone)]
pub struct Skirmish {
    pub(super) encounter: Encounter,
    pub(super) face: Face,
    key: EpisodeKey,
}

impl Skirmish {
    /// Sets up `scenario` to be played under `settings`.
    ///
    /// # Errors
    /// [`SkirmishError::Setting`] if a setting is out of range.
    pub fn new(scenario: Arc<Scenario>, settings: SkirmishSettings) -> Result<Self, SkirmishError> {
        let encounter = Encounter::new(Arc::clone(&scenario), &settings);
        Ok(Self {
            face: Face::new(scenario, settings, encounter.muster())?,
            encounter,
            key: EpisodeKey::new(0, Stream::Other, 0),
        })
    }

    /// The battle as it stands.
    #[must_use]
    pub fn battle(&self) -> &Battle {
        self.encounter.battle()
    }

    /// Sizes of what agents and critics are shown.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        self.face.layout()
    }

    /// The greatest return before scaling: the enemies' life and shields, their deaths, and the victory.
    #[must_use]
    pub fn max_reward(&self) -> f32 {
        self.face.max_reward()
    }

    /// The map.
    #[must_use]
    pub fn scenario(&self) -> &Scenario {
        self.encounter.scenario()
    }

    /// How the current episode stands.
    #[must_use]
    pub const fn battle_statistics(&self) -> BattleStatistics {
        self.face.statistics()
    }

    /// Episodes ended and won since the environment was made.
    #[must_use]
    pub fn tally(&self) -> BattleTally {
        self.face.tally()
    }

    /// How it is played and shown to agents.
    #[must_use]
    pub fn settings(&self) -> &SkirmishSettings {
        self.face.settings()
    }

    /// A number that differs, but for chance, when two states of the battle differ; the same on every machine.
    #[must_use]
    pub fn state_hash(&self) -> u64 {
        self.battle().state().hash()
    }

    /// Plays a step by orders instead of actions, available or not: agents without one go on with what they do.
    pub(crate) fn command(
        &mut self,
        orders: &[Option<Order>],
        out: &mut ObservationMut<'_>,
    ) -> TimeStep {
        for (agent, order) in orders.iter().enumerate() {
            if let Some(order) = order {
                let agent = UnitIndex::try_from(agent).expect("a battle has ≤ 256 units");
                self.encounter.order(agent, *order);
            }
        }
        let actions = vec![Action::new(STOP); orders.len()];
        self.play(&actions, out)
    }

    /// Plays the loops of a step under the orders that everybody has.
    fn play(&mut self, actions: &[Action], out: &mut ObservationMut<'_>) -> TimeStep {
        let mut chance = Chance::new(self.key, self.face.steps() + 1);
        for _ in 0..self.face.settings().step_mul {
            self.encounter.advance(&mut chance);
        }
        let state = self.encounter.battle().state();
        self.face.settle(state, actions, out)
    }

    fn order_agents(&mut self, actions: &[Action]) {
        for (agent, action) in actions.iter().enumerate() {
            let order = self
                .face
                .order(self.encounter.battle().state(), agent, *action);
            if let Some(order) = order {
                let agent = UnitIndex::try_from(agent).expect("a battle has ≤ 256 units");
                self.encounter.order(agent, order);
            }
        }
    }
}

impl Environment for Skirmish {
    fn spec(&self) -> &EnvironmentSpec {
        self.face.spec()
    }

    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        self.face.knowledge().clone()
    }

    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) {
        self.key = key;
        self.encounter.begin(key);
        self.face.begin(self.encounter.battle().state(), out);
    }

    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError> {
        self.face.check(self.encounter.battle().state(), actions)?;
        self.order_agents(actions);
        Ok(self.play(actions, out))
    }

    fn statistics(&self, statistics_s: &mut [f64]) {
        statistics_s.copy_from_slice(&self.face.statistics().values());
    }

    /// Moves living units that the agent does not see, as far as they stay unseen, and wounds them.
    fn alter_unseen(
        &mut self,
        agent: AgentId,
        key: EpisodeKey,
        out: &mut ObservationMut<'_>,
    ) -> bool {
        const FARTHEST: f64 = 3.0;
        let seen = out.visible_n[agent.index()];
        let mut state = self.encounter.battle().state().clone();
        let (x, y) = (state.x[agent.index()], state.y[agent.index()]);
        let mut is_altered = false;
        for unit in 0..state.units.len() {
            if seen.is_empty()
                || seen.contains(EntityId::new(unit))
                || !state.units[unit].is_alive()
            {
                continue;
            }
            let uniform = |draw| key.uniform(self.face.steps(), Draw::Setup(3 * unit + draw));
            let [dx, dy] = [0, 1].map(|draw| to_f32(FARTHEST * (2.0 * uniform(draw) - 1.0)));
            let place = (state.x[unit] + dx, state.y[unit] + dy);
            if !self.face.knowledge().is_in_sight(place.0 - x, place.1 - y) {
                (state.x[unit], state.y[unit]) = place;
            }
            state.units[unit].life *= to_f32(1.0 - uniform(2));
            is_altered = true;
        }
        self.encounter.battle.restore(&state);
        self.face.write(&state, out);
        is_altered
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "an alteration may be rounded"
)]
const fn to_f32(number: f64) -> f32 {
    number as f32
}
