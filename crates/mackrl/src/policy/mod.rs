//! What acting and learning share: the declared hierarchy, one step's table of log-probabilities, the walk down it, and the
//! traits of what acts.
//!
//! A [`Policy`] says how its parameters are called and makes what acts; an [`Actor`] is the working memory of a few
//! environments that are played together, an [`Executor`] that of one agent alone. The split is what lets shards run on any
//! number of threads: parameters are read by all, and everything written belongs to one actor.

mod declaration;
mod parameters;
mod table;
mod tally;
mod thought;
mod walk;

use std::{any::Any, borrow::Cow, fmt::Debug};

use mackrl_env::{Action, AgentId, EpisodeKey, LocalView, Observations};
use serde::{Deserialize, Serialize};

pub use declaration::{
    Declaration, Delegation, Division, DivisionBuffer, Exploring, LEVELS_MAX, Level, Memory, Part,
    Reads, Selection, TEAM,
};
pub use parameters::Parameters;
pub use table::PolicyTable;
pub use tally::Tally;
pub(crate) use thought::most_probable;
pub use thought::{
    AgentThought, GroupChoice, GroupThought, JointOption, PairThought, PartitionThought,
    SoloOption, TeamOption, Thought,
};
pub use walk::{Path, Sampler};

use crate::{Error, Stopwatch, experience::Experience, nn::ParameterLayout};

/// How a controller turns its distribution into a choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Draws from the distribution; used in training.
    Sampled,
    /// Takes the most probable choice, ties to the lowest index; used in tests.
    Greedy,
}

/// Whether an actor keeps what learning needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recording {
    /// The episodes will be learnt from.
    ForLearning,
    /// The episodes are only watched.
    Off,
}

/// How choices are made during an episode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Behaviour {
    /// Sampled or greedy.
    pub mode: Mode,
    /// ε of the bounded softmax, in [0, 1].
    pub exploration: f32,
}

impl Behaviour {
    /// What tests use: the most probable choice, without exploration.
    pub const GREEDY: Self = Self {
        mode: Mode::Greedy,
        exploration: 0.0,
    };

    /// What training uses: draws, with exploration ε in [0, 1].
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "ε is rounded to the networks' precision"
    )]
    pub const fn sampled(exploration: f64) -> Self {
        Self {
            mode: Mode::Sampled,
            exploration: exploration as f32,
        }
    }
}

/// One step of the environments that an actor plays in.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// t, from 0.
    pub step: usize,
    /// The environments that are still playing, ascending. An environment that has left does not come back.
    pub playing: &'a [usize],
    /// Names of the episodes \[B\], from which all random draws follow.
    pub keys: &'a [EpisodeKey],
    /// What everybody observes \[B\]. Actors read the local views alone.
    pub observations: &'a Observations,
    /// How to choose.
    pub behaviour: Behaviour,
}

/// A team's policy: the names of its parameters, and what acts with them.
pub trait Policy: Send + Sync + Debug {
    /// Names and shapes of the parameters.
    fn layout(&self) -> &ParameterLayout;

    /// What the networks are made of and what they read, for those who compute with the weights alone; nothing, for a policy
    /// without networks.
    fn description(&self) -> Vec<ControllerDescription> {
        Vec::new()
    }

    /// Names (or the parts before a number) and meanings of what its actors report, and of what a learner finds out about its
    /// controllers.
    fn metrics(&self) -> Vec<(String, String)> {
        Vec::new()
    }

    /// The partitions that a team chooses from \[P\]\[groups\]\[members\], in the order of the selector's columns; nothing, where
    /// they change from step to step or there is no choice.
    fn partitions(&self) -> Vec<Vec<Vec<AgentId>>> {
        Vec::new()
    }

    /// Random initial parameters, a function of `seed`.
    fn initialise(&self, seed: u64) -> Vec<f32>;

    /// Working memory for `environments` environments that are played together.
    fn actor(&self, environments: usize) -> Box<dyn Actor>;

    /// Working memory for `agent` alone.
    fn executor(&self, agent: AgentId) -> Box<dyn Executor>;

    /// Whether the key of an episode decides anything in greedy play, such as which partition is in force. If it does not, another
    /// key has to lead to the same actions, which the certificate checks.
    fn draws_when_greedy(&self) -> bool {
        true
    }

    /// Whether the key of an episode decides since when a controller takes part and remembers, such as that of a pair whose partition
    /// takes turns. What it computes is then a function of the key as well, and another key need not lead to the same.
    fn is_drawn(&self, controller: &ControllerId) -> bool {
        let _ = controller;
        false
    }
}

/// Plays a team in several environments at once.
pub trait Actor: Send {
    /// Starts new episodes, with all hidden states zero, and takes over the banks of `experience`, which keep their memory.
    fn begin(&mut self, recording: Recording, experience: &mut Experience);

    /// Chooses the actions of one step in every environment that is still playing, and adds to `experience` what the
    /// controllers read.
    ///
    /// # Shapes
    /// `actions_bn` \[B, N\]; rows of environments that have left are not touched.
    ///
    /// # Errors
    /// [`Error::NotFinite`] if a controller's logit is not finite: there is nothing to choose from then. [`Error::Config`] if the
    /// policy is not made for such a situation.
    fn act(
        &mut self,
        parameters: &Parameters,
        situation: Situation<'_>,
        experience: &mut Experience,
        actions_bn: &mut [Action],
    ) -> Result<(), Error>;

    /// Whether what it leaves is learnt from by what each agent observed, the observations after the last step included, so that
    /// episodes recorded for learning have to hold it.
    fn needs_views(&self) -> bool {
        false
    }

    /// Adds what was seen since [`Self::begin`] (entropies, delegation, …) to `tally`.
    fn report(&self, tally: &mut Tally) {
        let _ = tally;
    }

    /// Measures where the time of this actor and of the environments that it plays in goes, once it is started.
    fn stopwatch(&mut self) -> &mut Stopwatch;

    /// What was computed while acting and can save a learner of the same kind a forward pass: a cache beside the experience,
    /// and never a part of it.
    fn cache(&mut self) -> Option<&mut dyn Any> {
        None
    }

    /// What the controllers of environment `b` read at the latest step.
    fn controller_inputs(&self, experience: &Experience, b: usize) -> Vec<ControllerInput>;

    /// The log-probabilities that the controllers of environment `b` gave at the latest step, of those that were asked. Nothing,
    /// for actors that keep none.
    fn controller_outputs(&self, experience: &Experience, b: usize) -> Vec<ControllerOutput> {
        let _ = (experience, b);
        Vec::new()
    }

    /// All log-probabilities of environment `b` at the latest step, which was `situation`; nothing, for actors without a
    /// hierarchy.
    fn table(&mut self, b: usize, situation: Situation<'_>) -> Option<PolicyTable<'_, f32>> {
        let _ = (b, situation);
        None
    }

    /// What the controllers of environment `b` computed at the latest step, which was `situation` and led to `action_n` \[N\].
    /// Nothing, for actors that have no controllers to look into.
    fn thought(&mut self, b: usize, situation: Situation<'_>, action_n: &[Action]) -> Thought {
        let _ = (b, situation, action_n);
        Thought::default()
    }
}

/// Plays one agent from its own local views.
pub trait Executor: Send {
    /// Starts a new episode, with all hidden states zero.
    fn begin(&mut self);

    /// Chooses the agent's action at `step` of the episode `key`. Draws that concern a group are derived from the key by
    /// each member alone.
    fn act(
        &mut self,
        parameters: &Parameters,
        view: LocalView<'_>,
        key: &EpisodeKey,
        step: usize,
        behaviour: Behaviour,
    ) -> Action;

    /// What this agent's controllers read at the latest step.
    fn controller_inputs(&self) -> Vec<ControllerInput>;

    /// The log-probabilities that this agent's controllers gave at the latest step; as [`Actor::controller_outputs`].
    fn controller_outputs(&self) -> Vec<ControllerOutput> {
        Vec::new()
    }
}

/// The network that the controllers of one level share: Linear and `ReLU`, a gated recurrent unit, Linear, masked log-softmax.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ControllerDescription {
    /// As the tensors of its network begin: `pair_controller`.
    pub name: &'static str,
    /// The members of each group \[G\]\[members\].
    pub groups: Vec<Vec<AgentId>>,
    /// What stands in a row of inputs, one behind the other, and how many numbers each has.
    pub inputs: Vec<(&'static str, usize)>,
    /// H: units of the first layer and of the recurrent unit.
    pub hidden: usize,
    /// Ways to divide: the first columns of a row of outputs.
    pub divisions: usize,
    /// Joint actions, which follow them: of members (i, j) column i·A + j.
    pub joint_actions: usize,
    /// When its groups divide, where they may act jointly.
    pub acts: Option<Delegation>,
    /// Whether exploration is mixed into its choices.
    pub explores: bool,
    /// How long its controllers remember.
    pub memory: Memory,
    /// Whether a row of inputs, of the first layer's outputs after `ReLU`, and of what the last layer reads is normalised:
    /// `(x − μ) / √(σ² + 1e-5)`.
    pub normalised: bool,
}

/// Names one controller: its level's name, and whose it is.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerId {
    /// As the tensors of its network begin: `pair_controller`.
    pub name: Cow<'static, str>,
    /// The members of its group, ascending.
    pub agents: Vec<AgentId>,
}

/// What one controller read at one step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControllerInput {
    /// Whose input.
    pub controller: ControllerId,
    /// The numbers, in the order of the controller's encoding.
    pub values: Vec<f32>,
}

/// What one controller gave at one step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControllerOutput {
    /// Whose output.
    pub controller: ControllerId,
    /// The logarithms of the probabilities of its choices \[C\].
    pub log_p: Vec<f32>,
}
