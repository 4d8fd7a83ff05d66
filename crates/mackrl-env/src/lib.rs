//! The worlds that MACKRL's agents act in.
//!
//! An environment here does one thing that most do not: besides an observation vector it hands every agent a
//! [`LocalView`], the set of *entities* that the agent sees with their features in absolute coordinates. Absolute
//! coordinates are what makes common knowledge computable: two agents that see the same enemy hold bit-identical numbers
//! about it, so any function of commonly known entities gives both the same result.
//!
//! The crate knows nothing of tensors, learning or common knowledge. Buffers belong to the caller: [`Environment::step`]
//! fills an [`ObservationMut`], one row of an [`Observations`] that holds a whole batch of environments, and allocates
//! nothing. Randomness is a pure function of an [`EpisodeKey`], so an episode can be repeated from its key alone.
//!
//! A program that plays in worlds chooses a [`WorldKind`] by name, configures it by a table, and gets a [`World`], which is
//! built once and makes as many environments as are wanted. [`contract::check_environment`] tells whether a world keeps its
//! promises; `docs/environments.md` leads through one of your own.
//!
//! Axes, used in the names of buffers: `B` environment, `N` agent, `M` entity, `A` action, `F` entity feature,
//! `O` observation, `G` state, `S` statistic.

// Macros name this crate by its name, here too.
extern crate self as mackrl_env;

/// For the macros of [`settings`], so that a crate that uses them needs no version of its own.
#[doc(hidden)]
pub use serde;

pub mod contract;
mod entity_set;
mod environment;
mod ids;
pub mod matrix_game;
mod observations;
pub mod random;
pub mod random_play;
pub mod sanity;
pub mod settings;
mod world;

pub use entity_set::EntitySet;
pub use environment::{
    Environment, EnvironmentSpec, EpisodeEnd, IllegalAction, Interruption, InvalidSpec,
    PriorKnowledge, Statistic, StepError, TimeStep,
};
pub use ids::{Action, AgentId, EntityId};
pub use observations::{KnownEntities, LocalView, ObservationMut, Observations};
pub use random::{Draw, EpisodeKey, Stream};
pub use world::{Counter, DeclaredKind, Prototype, World, WorldError, WorldKind};

#[cfg(doctest)]
#[doc = include_str!("../../../docs/environments.md")]
struct EnvironmentsPage;
