//! Say what you saw.

use std::sync::Arc;

use super::{Alone, deal, refuse_unknown, show_alone, success};
use crate::{
    Action, AgentId, Environment, EnvironmentSpec, EpisodeEnd, EpisodeKey, ObservationMut,
    PriorKnowledge, StepError, TimeStep, declare_settings, settings::Accepts,
};

declare_settings! {
    /// Settings of [`Remember`].
    #[derive(Copy)]
    pub struct RememberSettings {
        /// Agents of the team.
        agents: usize = 2, Accepts::integer(1, 128);
        /// Symbols, each with its action.
        symbols: usize = 2, Accepts::integer(2, 100);
        /// Steps between seeing a symbol and the step in which it has to be named.
        delay: usize = 3, Accepts::integer(0, 1000);
    }
}

/// Each agent is shown a symbol of its own before the first step and nothing after it; the team earns the share of agents that
/// name theirs in the last step. What is done before counts for nothing.
///
/// The observation is the symbol, one-hot, or zeros, and whether this is the last step. The state is all symbols, and the
/// same. Nobody sees anybody.
#[derive(Debug, Clone)]
pub struct Remember {
    spec: EnvironmentSpec,
    shown_n: Vec<usize>,
    steps: usize,
    named: f32,
}

impl Remember {
    /// The world of these settings.
    #[must_use]
    pub fn new(settings: RememberSettings) -> Self {
        let RememberSettings {
            agents, symbols, ..
        } = settings;
        Self {
            spec: EnvironmentSpec {
                name: "sanity-remember".to_owned(),
                agents,
                entities: agents,
                entity_features: 1,
                position_features: 0,
                actions: symbols,
                observation_size: symbols + 1,
                state_size: agents * symbols + 1,
                episode_limit: settings.delay + 1,
                distance_scale: 1.0,
                statistics: success("share of agents that named their symbol in the last step"),
                success: Some(0),
            },
            shown_n: vec![0; agents],
            steps: 0,
            named: 0.0,
        }
    }

    fn show(&self, out: &mut ObservationMut<'_>) {
        show_alone(out);
        let symbols = self.spec.actions;
        let is_last = f32::from(u8::from(self.steps + 1 == self.spec.episode_limit));
        out.state_g[self.spec.state_size - 1] = is_last;
        for (agent, shown) in self.shown_n.iter().enumerate() {
            let observation_o = &mut out.observation_no[agent * (symbols + 1)..][..=symbols];
            observation_o[symbols] = is_last;
            if self.steps == 0 {
                observation_o[*shown] = 1.0;
            }
            out.state_g[agent * symbols + shown] = 1.0;
        }
    }
}

impl Environment for Remember {
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
        (self.steps, self.named) = (0, 0.0);
        self.show(out);
    }

    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError> {
        refuse_unknown(actions, self.spec.actions)?;
        self.steps += 1;
        let is_over = self.steps == self.spec.episode_limit;
        if is_over {
            let named = self.shown_n.iter().zip(actions);
            let named = named.filter(|(shown, action)| **shown == action.index());
            self.named = named.count() as f32 / self.spec.agents as f32;
        }
        self.show(out);
        Ok(TimeStep {
            reward: self.named,
            end: is_over.then_some(EpisodeEnd::Terminated),
        })
    }

    fn statistics(&self, statistics_s: &mut [f64]) {
        statistics_s[0] = self.named.into();
    }

    /// Other agents, and once it is gone also this one, were shown something else.
    fn alter_unseen(
        &mut self,
        agent: AgentId,
        _key: EpisodeKey,
        out: &mut ObservationMut<'_>,
    ) -> bool {
        for (other, shown) in self.shown_n.iter_mut().enumerate() {
            if other != agent.index() || self.steps > 0 {
                *shown = (*shown + 1) % self.spec.actions;
            }
        }
        self.show(out);
        true
    }
}
