//! The controllers of pairwise MACKRL and the sampler that walks down them.

mod sampling;

pub use sampling::{Mode, PairChoice, Path, Sampler};
