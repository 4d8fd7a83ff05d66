//! Say what you see.

use std::sync::Arc;

use super::{Alone, deal, refuse_unknown, show_alone, success};
use crate::{
    Action, AgentId, Environment, EnvironmentSpec, EpisodeEnd, EpisodeKey, ObservationMut,
    PriorKnowledge, StepError, TimeStep, declare_settings, settings::Accepts,
};

declare_settings! {
    /// Settings of [`Observe`].
    #[derive(Copy)]
    pub struct ObserveSettings {
        /// Agents of the team.
        agents: usize = 2, Accepts::integer(1, 128);
        /// Symbols, each with its action.
        symbols: usize = 3, Accepts::integer(2, 100);
    }
}

/// A world of one step: each agent is shown a symbol of its own, and the team earns the share of agents that name theirs.
///
/// The observation is the symbol, one-hot, and so is the state, agent by agent. Nobody sees anybody.
#[derive(Debug, Clone)]
pub struct Observe {
    spec: EnvironmentSpec,
    shown_n: Vec<usize>,
    named: f32,
}

impl Observe {
    /// The world of these settings.
    #[must_use]
    pub fn new(ObserveSettings { agents, symbols }: ObserveSettings) -> Self {
        Self {
            spec: EnvironmentSpec {
                name: "sanity-observe".to_owned(),
                agents,
                entities: agents,
                entity_features: 1,
                position_features: 0,
                actions: symbols,
                observation_size: symbols,
                state_size: agents * symbols,
                episode_limit: 1,
                distance_scale: 1.0,
                statistics: success("share of agents that named their symbol"),
                success: Some(0),
            },
            shown_n: vec![0; agents],
            named: 0.0,
        }
    }

    fn show(&self, out: &mut ObservationMut<'_>) {
        show_alone(out);
        for (agent, shown) in self.shown_n.iter().enumerate() {
            out.observation_no[agent * self.spec.actions + shown] = 1.0;
        }
        out.state_g.copy_from_slice(out.observation_no);
    }
}

impl Environment for Observe {
    fn spec(&self) -> &EnvironmentSpec {
        &self.spec
    }

    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        Arc::new(Alone)
    }

    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) {
        for (agent, shown) in self.shown_n.iter_mut().enumerate() {
            *shown = deal(key, agent, self.spec.actions);
        }
        self.named = 0.0;
        self.show(out);
    }

    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError> {
        refuse_unknown(actions, self.spec.actions)?;
        let named = self.shown_n.iter().zip(actions);
        let named = named.filter(|(shown, action)| **shown == action.index());
        self.named = named.count() as f32 / self.spec.agents as f32;
        self.show(out);
        Ok(TimeStep {
            reward: self.named,
            end: Some(EpisodeEnd::Terminated),
        })
    }

    fn statistics(&self, statistics_s: &mut [f64]) {
        statistics_s[0] = self.named.into();
    }

    fn alter_unseen(
        &mut self,
        agent: AgentId,
        _key: EpisodeKey,
        out: &mut ObservationMut<'_>,
    ) -> bool {
        for (other, shown) in self.shown_n.iter_mut().enumerate() {
            if other != agent.index() {
                *shown = (*shown + 1) % self.spec.actions;
            }
        }
        self.show(out);
        self.spec.agents > 1
    }
}
