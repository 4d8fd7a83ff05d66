//! Execution by one agent alone, and the certificate that it equals the central run.
//!
//! Training is central; what it yields must not be. An [`Executor`] is one agent with the weights, the shared seed and its own
//! local views, and nothing else. [`Subject::certify`] plays whole episodes with N executors beside the central run and compares
//! every action, and plays the central run again in worlds where everything that an agent does not see is different.

mod certificate;
mod executor;
mod message;

use mackrl_env::{Action, AgentId, EpisodeKey, LocalView};

use self::executor::{AgentExecutor, PairwiseExecutor};
pub use self::{
    certificate::{AgentLink, Certificate, Check, CounterExample, DifferingInput, Subject},
    message::{Answer, ReceivedView, Request, ViewMessage, serve_agent},
};
use crate::{
    Error,
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

/// An agent in this process, reached through the same messages as one in another.
pub struct InProcessAgent<'a> {
    executor: Box<dyn Executor>,
    weights: &'a Weights,
    episode: Option<(EpisodeKey, Behaviour)>,
}

impl<'a> InProcessAgent<'a> {
    /// An agent that acts with `executor` and `weights`.
    #[must_use]
    pub fn new(executor: Box<dyn Executor>, weights: &'a Weights) -> Self {
        Self {
            executor,
            weights,
            episode: None,
        }
    }
}

impl AgentLink for InProcessAgent<'_> {
    fn ask(&mut self, request: Request) -> Result<Option<Answer>, Error> {
        message::answer(
            &mut *self.executor,
            self.weights,
            &mut self.episode,
            request,
        )
    }
}

impl std::fmt::Debug for InProcessAgent<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("InProcessAgent")
            .field("episode", &self.episode)
            .finish_non_exhaustive()
    }
}
