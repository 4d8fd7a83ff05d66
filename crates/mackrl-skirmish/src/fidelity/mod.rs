//! How far the simulator is the game: the same policies in both, quantity by quantity.
//!
//! People have committed the training logs of hundreds of runs on the real StarCraft II to public repositories. The first
//! episodes of a run are random play, and the first tests of an untrained network repeat one action; both are policies that can
//! be played here without any learning. [`References`] holds what the logs say (numbers only, each with its repositories),
//! [`Sample`] what the same policy does here, and [`judge`] sets one beside the other.
//!
//! Learning curves are no part of this: a game that is fitted to the curve of a learner agrees with that learner's defects.

mod checks;
mod distribution;
mod heuristic;
mod policy;
mod reference;
mod sample;

pub use checks::{Finding, judge, passed};
pub use distribution::{QUANTILES, Spread};
pub use policy::Policy;
pub use reference::{Lengths, Quantity, Reference, References, Source};
pub use sample::{Played, Sample, play};

#[cfg(test)]
mod tests;
