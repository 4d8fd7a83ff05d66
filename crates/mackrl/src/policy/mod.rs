//! What acting and learning share: one step's table of log-probabilities, and the traits of a policy that learns from the
//! marginal of the joint action.
//!
//! A [`Policy`] says which controllers there are and how their parameters are called; an [`Actor`] is the working memory of
//! a few environments that are played together. The split is what lets shards run on any number of threads: parameters are read by all, and everything written
//! belongs to one actor. An actor keeps the activations of its episodes, so that learning needs no second forward pass:
//! parameters do not change between acting and the update.

mod tables;
mod tally;
mod thought;

use std::fmt::Debug;

use mackrl_env::{Action, AgentId, EpisodeKey, Observations};
use serde::{Deserialize, Serialize};

pub use tables::{DELEGATE, PolicyShape, PolicyTable};
pub use tally::Tally;
pub(crate) use thought::most_probable;
pub use thought::{
    AgentThought, Choice, JointOption, PairThought, PartitionThought, SoloOption, Thought,
};

use crate::{
    NotFinite, Stopwatch,
    nn::{Named, ParameterLayout, RecurrentWeights},
};

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

/// The weights of all controllers as they are computed with: a copy of the parameters, refreshed after every update.
#[derive(Debug, Clone)]
pub struct Weights {
    /// Of the pair selector, if partitions are chosen.
    pub(crate) selector: Option<RecurrentWeights<f32>>,
    /// Of the pair controllers, if there are pairs.
    pub(crate) pairs: Option<RecurrentWeights<f32>>,
    /// Of the agent controllers.
    pub(crate) agents: RecurrentWeights<f32>,
}

/// A team's policy: the controllers and the names of their parameters.
pub trait Policy: Send + Sync + Debug {
    /// Names and shapes of the parameters.
    fn layout(&self) -> &ParameterLayout;

    /// Random initial parameters, a function of `seed`.
    fn initialise(&self, seed: u64) -> Vec<f32>;

    /// The controllers' weights under `parameters`.
    fn weights(&self, parameters: &[f32]) -> Weights;

    /// Brings `weights` up to date with `parameters`, without allocating.
    fn refresh(&self, parameters: &[f32], weights: &mut Weights);

    /// Working memory for `environments` environments.
    fn actor(&self, environments: usize) -> Box<dyn Actor>;
}

/// Plays a team in several environments at once and remembers what learning needs.
pub trait Actor: Send {
    /// Starts new episodes, with all hidden states zero.
    fn begin(&mut self, recording: Recording);

    /// Chooses the actions of one step in every environment that is still playing.
    ///
    /// # Shapes
    /// `actions_bn` \[B, N\]; rows of environments that have left are not touched.
    ///
    /// # Errors
    /// [`NotFinite`] if a controller's logit is not finite: there is nothing to choose from then.
    fn act(
        &mut self,
        weights: &Weights,
        situation: Situation<'_>,
        actions_bn: &mut [Action],
    ) -> Result<(), NotFinite>;

    /// Adds `Σ_{b,t} weight_bt ∇ log p(u_t)` to `gradient` and returns `Σ_{b,t} weight_bt log p(u_t)`, where p is the
    /// marginal probability (eq. 5) of the joint action that was taken.
    ///
    /// # Shapes
    /// `weight_bt` \[B\]\[T\], each episode with its own T; `gradient` as the policy's layout.
    fn backward(&mut self, weights: &Weights, weight_bt: &[Vec<f32>], gradient: &mut [f32]) -> f64;

    /// Adds what was seen since [`Self::begin`] (entropies, delegation, …) to `tally`.
    fn report(&self, tally: &mut Tally);

    /// Measures where the time of this actor and of the environments that it plays in goes, once it is started.
    fn stopwatch(&mut self) -> &mut Stopwatch;

    /// What was computed since [`Self::begin`], in that order, for whoever looks for a number that is not finite. An actor
    /// that keeps nothing has nothing to show.
    fn activations(&self) -> Vec<Named<'_, f32>> {
        Vec::new()
    }

    /// What the latest backward pass computed on its way to the parameters' gradients, in that order.
    fn gradients(&self) -> Vec<Named<'_, f32>> {
        Vec::new()
    }

    /// What the controllers of environment `b` read at the latest step.
    fn controller_inputs(&self, b: usize) -> Vec<ControllerInput>;

    /// What the controllers of environment `b` computed at the latest step, which was `situation` and led to `action_n` \[N\].
    /// Nothing, for actors that have no controllers to look into.
    fn thought(&mut self, b: usize, situation: Situation<'_>, action_n: &[Action]) -> Thought {
        let _ = (b, situation, action_n);
        Thought::default()
    }
}

/// Names one controller of the hierarchy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ControllerId {
    /// `π_ps`
    PairSelector,
    /// `π_pc` of these two agents, the lower first.
    PairController(AgentId, AgentId),
    /// `π_a` of this agent.
    AgentController(AgentId),
}

/// What one controller read at one step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControllerInput {
    /// Whose input.
    pub controller: ControllerId,
    /// The numbers, in the order of the controller's encoding.
    pub values: Vec<f32>,
}
