//! Multi-Agent Common Knowledge Reinforcement Learning (MACKRL; Foerster, Schroeder de Witt and others, 2018).
//!
//! A team that may not communicate can still act jointly on what its members *commonly know*. The folders of this crate are
//! the concepts of the paper: [`common_knowledge`] finds what a group commonly knows, [`partition`] divides the team into
//! pairs, [`hierarchy`] holds the controllers that act jointly or delegate, [`marginalisation`] gives the probability of the
//! joint action over all paths through them, [`central_critic`] and [`learner`] learn from it, and [`decentralised`] runs
//! the result one agent at a time and certifies that nothing was communicated. [`statistics`] says what many runs say together.
//!
//! Axes, used at the end of tensor names: `T` time, `B` environment, `N` agent, `M` entity, `K` pair, `P` partition,
//! `A` action, `C` column of a pair's table (delegate, then A·A joint actions), `F` feature, `G` state, `H` hidden.
//! The order is always T, B, then the rest.

pub mod algorithms;
pub mod common_knowledge;
pub mod critics;
pub mod decentralised;
mod error;
pub mod experience;
pub mod hierarchy;
pub mod marginalisation;
pub mod nn;
pub mod objectives;
mod parallel;
pub mod partition;
pub mod policy;
mod real;

pub mod statistics;
mod stopwatch;
pub mod tabular;

pub use error::{Broken, Error, Moment, NotFinite};
pub use real::Real;
pub use stopwatch::{Phase, Stopwatch};
