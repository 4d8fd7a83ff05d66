//! The matrix game of the paper: two agents, five actions, one step.
//!
//! Chance deals two bits. The *common-knowledge bit* is seen by both agents and tells them whether they also both see the
//! second one, which selects the payoff matrix; without it each agent sees the matrix by its own luck alone. The whole
//! question of the paper is in that difference: an agent that sees the matrix may know what to do, but only if it knows that
//! the other sees it too can the two rely on each other.
//!
//! The game is data ([`payoff`], [`deals`](ObservationDistribution::deals)) before it is a world: there are ten deals, so
//! the tabular learners of Figure 5 enumerate them and sample nothing. [`MatrixGame`] deals the same cards one at a time for
//! everybody else.

mod information;
mod payoffs;
mod world;

pub use information::{
    CommonKnowledge, Deal, DealtCards, InvalidProbability, Observation, ObservationDistribution,
};
pub use payoffs::{ACTIONS, Matrix, Payoffs, payoff, payoff_text};
pub use world::{MatrixGame, MatrixGameKind, MatrixGameSettings};

/// The name by which configurations and commands call the game.
pub const MATRIX_GAME: &str = "matrix-game";

/// N: agents of the game.
pub const AGENTS: usize = 2;
