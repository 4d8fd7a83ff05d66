//! Execution by one agent alone, and the certificate that it equals the central run.
//!
//! Training is central; what it yields must not be. An [`Executor`] is one agent with the weights, the shared seed and its own
//! local views, and nothing else. [`certify`](mod@certify) plays whole episodes with N executors beside the central run and
//! compares every action, and plays the central run again in worlds where everything that an agent does not see is different.

mod executor;

use mackrl_env::{Action, AgentId, EpisodeKey, LocalView};

use self::executor::{AgentExecutor, PairwiseExecutor};
use crate::{
    baselines::CentralV,
    hierarchy::PairwiseMackrl,
    policy::{Behaviour, ControllerInput, Policy, Weights},
};

/// A policy that single agents can execute.
pub trait Decentralised: Policy {
    /// Working memory for `agent` alone.
    fn executor(&self, agent: AgentId) -> Box<dyn Executor>;
}

/// Plays one agent from its own local views.
pub trait Executor: Send {
    /// Starts a new episode, with all hidden states zero.
    fn begin(&mut self);

    /// Chooses the agent's action at `step` of the episode `key`. Draws that concern a group are derived from the key by
    /// each member alone.
    fn act(
        &mut self,
        weights: &Weights,
        view: LocalView<'_>,
        key: &EpisodeKey,
        step: usize,
        behaviour: Behaviour,
    ) -> Action;

    /// What this agent's controllers read at the latest step.
    fn controller_inputs(&self) -> Vec<ControllerInput>;
}

impl Decentralised for PairwiseMackrl {
    fn executor(&self, agent: AgentId) -> Box<dyn Executor> {
        Box::new(PairwiseExecutor::new(self.hierarchy.clone(), agent))
    }
}

impl Decentralised for CentralV {
    fn executor(&self, agent: AgentId) -> Box<dyn Executor> {
        Box::new(AgentExecutor::new(self.agents.clone(), agent))
    }
}
