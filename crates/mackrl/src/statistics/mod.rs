//! What runs say together: averages, their uncertainty, comparisons, and how soon something is reached.
//!
//! A handful of seeds is all that deep reinforcement learning usually affords, and a mean with a standard error hides how much
//! such a handful can tell. So this module also has what Agarwal and others ("Deep Reinforcement Learning at the Edge of the
//! Statistical Precipice", 2021) recommend and their package `rliable` computes: the interquartile mean, which outliers do not
//! move and which uses more of the runs than a median; stratified-bootstrap intervals, which assume no distribution; and the
//! probability of improvement, which asks how often a run of one algorithm is better than a run of another.
//!
//! Scores are lists of tasks, each a list of its runs. Numbers are f64 and finite. Draws are counter-based, so an interval is a
//! function of the scores and a seed.

mod bootstrap;
mod comparison;
mod crossing;
mod sample;
mod student;

pub use bootstrap::{Aggregate, Bootstrap, Interval};
pub use comparison::probability_of_improvement;
pub use crossing::{Crossings, first_crossing, interpolate};
pub use sample::{interquartile_mean, mean, mean_and_standard_error, median, quantile};
pub use student::student_factor;

#[cfg(test)]
mod tests;
