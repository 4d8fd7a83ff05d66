//! What a world promises to those who act in it.
//!
//! Two things are kept apart that many interfaces merge. The *end of an episode* has a cause: the game was decided, or time
//! ran out; only the learner decides whether the second has a value beyond it. And what the agents *know before the game
//! starts* (the map, the ranges, everybody's field of view) is an object of its own, [`PriorKnowledge`], which a decentralised
//! agent owns without owning a world.

use std::{fmt::Debug, sync::Arc};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{Action, AgentId, EntityId, EpisodeKey, KnownEntities, ObservationMut};

/// Sizes of an environment's arrays and its time limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EnvironmentSpec {
    /// Name in the registry, such as `3m`.
    pub name: String,
    /// N: agents, at least 1. They are the first N entities.
    pub agents: usize,
    /// M: everything that can be seen, at most [`crate::EntitySet::CAPACITY`].
    pub entities: usize,
    /// F: features of an entity. The first two are its position (x, y) in map units; the others are attributes of about
    /// unit size.
    pub entity_features: usize,
    /// A: actions of an agent.
    pub actions: usize,
    /// O: length of an agent's observation vector.
    pub observation_size: usize,
    /// G: length of the state vector, which only the critic sees.
    pub state_size: usize,
    /// Steps after which an episode is truncated.
    pub episode_limit: usize,
    /// Map units by which relative positions are divided to become network inputs (the sight range in StarCraft), > 0.
    pub distance_scale: f32,
}

/// Why an episode is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EpisodeEnd {
    /// The game was decided: nothing comes after this state.
    Terminated,
    /// The time limit was reached: the game would have gone on.
    Truncated,
}

/// What one step gave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeStep {
    /// Reward shared by the team.
    pub reward: f32,
    /// Set if this was the episode's last step.
    pub end: Option<EpisodeEnd>,
}

/// How an episode stands, for reports; agents never see it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct EpisodeStatistics {
    /// Whether the team has won.
    pub battle_won: bool,
    /// Agents that have died.
    pub dead_allies: usize,
    /// Enemies that have died.
    pub dead_enemies: usize,
}

/// An action that was not available to its agent. The world has not moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("agent {agent} chose action {action}, which is not available to it")]
pub struct IllegalAction {
    /// The agent that chose.
    pub agent: AgentId,
    /// What it chose.
    pub action: Action,
}

/// The world failed under the episode, which is void: nothing of it may be learnt from or counted.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("the episode is void: {reason}")]
pub struct Interruption {
    /// What failed, in words.
    pub reason: String,
    /// Whether a new episode may be tried; otherwise the world cannot be brought back.
    pub can_be_repeated: bool,
}

/// Why a step was not played.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum StepError {
    /// The policy chose what it must not; the world is unchanged.
    #[error(transparent)]
    IllegalAction(#[from] IllegalAction),
    /// The world failed. Worlds that are computed never do; games in other processes may.
    #[error(transparent)]
    Interrupted(#[from] Interruption),
}

/// A world with N agents that share one reward.
///
/// Every implementation passes [`crate::contract::check_environment`].
pub trait Environment: Send {
    /// Sizes and limits; constant over the environment's life.
    fn spec(&self) -> &EnvironmentSpec;

    /// What every agent knows before the first step.
    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge>;

    /// Starts the episode named `key` and writes its first observations, wherever the latest episode stands. If a world fails
    /// at it, every agent is shown as dead, and the first step tells.
    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>);

    /// Plays one step and writes the observations that follow it. Nothing is allocated.
    ///
    /// # Errors
    /// [`IllegalAction`] names the first agent whose action was not available; the world is unchanged. [`Interruption`] tells
    /// that the episode is void; only `reset` may follow.
    ///
    /// # Panics
    /// If `actions` does not hold one action per agent.
    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError>;

    /// How the current episode stands.
    fn statistics(&self) -> EpisodeStatistics;
}

/// What is common knowledge before the game starts (τ₀ in the paper): everybody's field of view and the rules of availability.
///
/// All methods are pure functions of features, so every agent computes the same answers from the same entities.
pub trait PriorKnowledge: Send + Sync + Debug {
    /// μ^a(s^a, s^e): whether agent `observer` with features `observer_f` sees `entity` with features `entity_f`.
    ///
    /// # Shapes
    /// `observer_f` and `entity_f` have F elements each.
    fn sees(
        &self,
        observer: AgentId,
        observer_f: &[f32],
        entity: EntityId,
        entity_f: &[f32],
    ) -> bool;

    /// Writes which actions of `agent` are *surely* available to someone who knows only `known`: a subset of the truth, and
    /// equal to it if `known` is all that the agent itself sees. All false if `agent` is not in `known`.
    ///
    /// # Shapes
    /// `available_a` has A elements.
    fn available(&self, known: KnownEntities<'_>, agent: AgentId, available_a: &mut [bool]);

    /// The action by which an agent acts on `entity`, if there is one (attack this enemy).
    fn action_on(&self, entity: EntityId) -> Option<Action>;
}
