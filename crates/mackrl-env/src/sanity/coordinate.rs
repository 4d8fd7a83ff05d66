//! Press together what both see, and nothing else.

use std::sync::Arc;

use super::{refuse_unknown, show_alone, success};
use crate::{
    Action, AgentId, Draw, EntityId, EntitySet, Environment, EnvironmentSpec, EpisodeEnd,
    EpisodeKey, KnownEntities, ObservationMut, PriorKnowledge, StepError, TimeStep,
    declare_settings, settings::Accepts,
};

const AGENTS: usize = 2;
/// The entity beside the agents.
const LAMP: usize = AGENTS;
/// Whether an agent's eyes are open, then the colour of a lamp.
const FEATURES: usize = 3;
/// Red and blue.
const COLOURS: usize = 2;
/// To wait, to press red, to press blue.
const ACTIONS: usize = 1 + COLOURS;

declare_settings! {
    /// Settings of [`Coordinate`].
    #[derive(Copy)]
    pub struct CoordinateSettings {
        /// Probability that the lamp is seen by both; otherwise one alone sees it.
        common: f64 = 0.5, Accepts::within(0.0, 1.0);
    }
}

/// A world of one step with a lamp, red or blue, and a button for each colour. Two agents who press the lamp's button together
/// earn 1, two who wait earn 0, and whatever else they do costs 1.
///
/// Either both have their eyes open and see the lamp and each other: then the colour is common knowledge, and pressing pays. Or
/// one alone has: it sees the colour as well as ever, but the other does not, so that pressing never pays. The observation is
/// the colour, one-hot, or zeros. The state is the colour, and whose eyes are open.
#[derive(Debug, Clone)]
pub struct Coordinate {
    spec: EnvironmentSpec,
    common: f64,
    colour: usize,
    is_open: [bool; AGENTS],
    did_best: bool,
}

impl Coordinate {
    /// The world of these settings.
    #[must_use]
    pub fn new(settings: CoordinateSettings) -> Self {
        Self {
            spec: EnvironmentSpec {
                name: "sanity-coordinate".to_owned(),
                agents: AGENTS,
                entities: AGENTS + 1,
                entity_features: FEATURES,
                position_features: 0,
                actions: ACTIONS,
                observation_size: COLOURS,
                state_size: COLOURS + AGENTS,
                episode_limit: 1,
                distance_scale: 1.0,
                statistics: success(
                    "1 if both pressed the button of a lamp that both saw, or waited where one alone saw it, else 0",
                ),
                success: Some(0),
            },
            common: settings.common,
            colour: 0,
            is_open: [true; AGENTS],
            did_best: false,
        }
    }

    fn show(&self, out: &mut ObservationMut<'_>) {
        show_alone(out);
        out.entity_mf[LAMP * FEATURES + 1 + self.colour] = 1.0;
        out.state_g[self.colour] = 1.0;
        for agent in (0..AGENTS).filter(|&agent| self.is_open[agent]) {
            out.entity_mf[agent * FEATURES] = 1.0;
            out.state_g[COLOURS + agent] = 1.0;
            out.observation_no[agent * COLOURS + self.colour] = 1.0;
            out.visible_n[agent].insert(EntityId::new(LAMP));
        }
        if self.is_open == [true; AGENTS] {
            out.visible_n.fill(EntitySet::first(AGENTS + 1));
        }
    }
}

impl Environment for Coordinate {
    fn spec(&self) -> &EnvironmentSpec {
        &self.spec
    }

    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        Arc::new(Eyes)
    }

    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) {
        let [common, colour, who] = [0, 1, 2].map(|i| key.uniform(0, Draw::World(i)));
        self.colour = usize::from(colour < 0.5);
        self.is_open = match (common < self.common, who < 0.5) {
            (true, _) => [true, true],
            (false, true) => [true, false],
            (false, false) => [false, true],
        };
        self.did_best = false;
        self.show(out);
    }

    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError> {
        refuse_unknown(actions, ACTIONS)?;
        let all_do = |wanted: usize| actions.iter().all(|action| action.index() == wanted);
        let is_common = self.is_open == [true; AGENTS];
        let reward = match (all_do(1 + self.colour), all_do(0)) {
            (true, _) if is_common => 1.0,
            (_, true) => 0.0,
            _ => -1.0,
        };
        self.did_best = reward == f32::from(u8::from(is_common));
        self.show(out);
        Ok(TimeStep {
            reward,
            end: Some(EpisodeEnd::Terminated),
        })
    }

    fn statistics(&self, statistics_s: &mut [f64]) {
        statistics_s[0] = f64::from(u8::from(self.did_best));
    }

    /// For the agent who sees nothing, the lamp has the other colour. Who sees it sees all there is, but for an agent whose
    /// eyes are closed: of that nothing can be altered.
    fn alter_unseen(
        &mut self,
        agent: AgentId,
        _key: EpisodeKey,
        out: &mut ObservationMut<'_>,
    ) -> bool {
        if self.is_open[agent.index()] {
            return false;
        }
        self.colour = 1 - self.colour;
        self.show(out);
        true
    }
}

/// Who has open eyes sees the lamp, and whoever has open eyes too.
#[derive(Debug)]
struct Eyes;

impl PriorKnowledge for Eyes {
    fn sees(
        &self,
        observer: AgentId,
        observer_f: &[f32],
        entity: EntityId,
        entity_f: &[f32],
    ) -> bool {
        let is_open = |features_f: &[f32]| features_f[0] > 0.5;
        entity == observer.into()
            || is_open(observer_f) && (entity.index() == LAMP || is_open(entity_f))
    }

    fn available(&self, known: KnownEntities<'_>, agent: AgentId, available_a: &mut [bool]) {
        available_a.fill(known.set().contains(agent));
    }

    fn action_on(&self, _entity: EntityId) -> Option<Action> {
        None
    }
}
