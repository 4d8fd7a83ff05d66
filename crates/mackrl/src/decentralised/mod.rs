//! Execution by one agent alone, and the certificate that it equals the central run.
//!
//! Training is central; what it yields must not be. An [`Executor`] is one agent with the weights, the shared seed and its own
//! local views, and nothing else. [`Subject::certify`] plays whole episodes with N executors beside the central run and compares
//! every action, and plays the central run again in worlds where everything that an agent does not see is different.

mod alteration;
mod central;
mod certificate;
mod computed;
mod message;
mod report;

use mackrl_env::EpisodeKey;

pub use self::{
    certificate::{AgentLink, Repetition, Subject},
    computed::{Difference, Fingerprints},
    message::{Answer, ReceivedView, Request, ViewMessage, serve_agent},
    report::{Certificate, Check, CounterExample, DifferingInput, Isolation},
};
use crate::{
    Error,
    policy::{Behaviour, Executor, Parameters},
};

/// An agent in this process, reached through the same messages as one in another.
pub struct InProcessAgent<'a> {
    executor: Box<dyn Executor>,
    parameters: &'a Parameters,
    episode: Option<(EpisodeKey, Behaviour)>,
}

impl<'a> InProcessAgent<'a> {
    /// An agent that acts with `executor` and `parameters`.
    #[must_use]
    pub fn new(executor: Box<dyn Executor>, parameters: &'a Parameters) -> Self {
        Self {
            executor,
            parameters,
            episode: None,
        }
    }
}

impl AgentLink for InProcessAgent<'_> {
    fn ask(&mut self, request: Request) -> Result<Option<Answer>, Error> {
        message::answer(
            &mut *self.executor,
            self.parameters,
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
