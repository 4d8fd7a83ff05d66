//! Multi-Agent Common Knowledge Reinforcement Learning (MACKRL; Foerster, Schroeder de Witt and others, 2018).
//!
//! A team that may not communicate can still act jointly on what its members *commonly know*. This crate is the paper and its
//! algorithms; it writes no file and names no game. What a reader looks for first:
//!
//! | | |
//! |---|---|
//! | a world | [`mackrl_env::Environment`], and `mackrl_env::World` to make many of it |
//! | what can learn | [`algorithms::Algorithm`], [`algorithms::built_in`] |
//! | a run on disk, with tests, checkpoints and metrics | the crate `mackrl-run`, and the program `mackrl` |
//!
//! ```
//! use mackrl::{
//!     Stopwatch,
//!     algorithms::{AlgorithmKind, Mackrl, Team},
//!     experience::{Collector, Piece, PlaySettings},
//!     policy::Recording,
//! };
//! use mackrl_env::{EpisodeKey, Stream, sanity};
//!
//! // Two agents are to press together what both see, and nothing else.
//! let world = sanity::kinds()[2].build(&Default::default())?;
//! let prior = world.prior_knowledge();
//! let team = Team { spec: world.spec(), prior: &prior, seed: 1, threads: 1 };
//! let mut team = Mackrl.build(&Mackrl.defaults(), team)?;
//!
//! let environments = (0..team.environments()).map(|_| world.make()).collect();
//! let mut collector = Collector::new(team.policy(), environments, team.shards(), 1);
//! for batch in 0..3 {
//!     let keys = [0, 1, 2, 3].map(|episode| EpisodeKey::new(1, Stream::Training, 4 * batch + episode));
//!     let behaviour = team.behaviour(4 * batch);
//!     let settings = PlaySettings { behaviour, recording: Recording::ForLearning };
//!     collector.play(team.parameters(), &keys, settings)?;
//!     let mut experience: Vec<&mut Piece> = collector.pieces().collect();
//!     team.learn(&mut experience, &mut Stopwatch::default())?;
//! }
//! assert_eq!(team.updates(), 3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The folders are the concepts of the paper: [`common_knowledge`] finds what a group commonly knows, [`partition`] divides the
//! team, [`policy`] declares a hierarchy of groups and walks down it, [`hierarchy`] holds its networks, [`marginalisation`] gives
//! the probability of the joint action over all ways to it. [`experience`] is what acting leaves for learning, [`objectives`] are
//! what is to become large (eq. (6) in one function), [`critics`] judge, and [`algorithms`] put them together. [`decentralised`]
//! runs the result one agent at a time and certifies that nothing was communicated. [`statistics`] says what many runs say together.
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
