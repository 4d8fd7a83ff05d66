//! What verdicts are made from: measured means with their errors, and when two of them count as equal or apart.
//!
//! Learners at one point start from the same logits, run by run, so differences between them are means of paired
//! differences with their own standard error. "Equal" needs evidence as much as "greater" does: it means that the whole
//! interval of two standard errors lies within [`EQUAL`] of zero, so a noisy experiment cannot prove equality.

use mackrl::tabular::{Curve, Learner, Optima, Run, Sweep};
use mackrl_env::matrix_game::ObservationDistribution;

use super::report::{Delegation, Published, Quantity};

/// Learners that differ by no more than this count as equal; the game's returns lie in [0, 1].
pub(super) const EQUAL: f64 = 0.01;
/// A curve within this of another, of which one was read from a picture or is an ideal, counts as near it.
pub(super) const NEAR: f64 = 0.02;
/// Standard errors on either side of a mean that are believed.
pub(super) const ERRORS: f64 = 2.0;
/// Rounding of sums of a few hundred products.
pub(super) const ROUNDING: f64 = 1e-12;

/// All that verdicts are made from.
pub(super) struct Findings<'a> {
    pub(super) distribution: ObservationDistribution,
    pub(super) points: &'a [f64],
    pub(super) sweep: &'a Sweep,
    pub(super) optima: &'a [Optima],
    pub(super) published: Published,
    pub(super) delegation: Delegation,
}

impl Findings<'_> {
    pub(super) const fn quantity(&self) -> Quantity {
        self.published.quantity
    }

    pub(super) fn curve(&self, learner: Learner) -> Curve {
        let quantity = self.quantity();
        self.sweep.curve(learner, |run| quantity.of(run))
    }

    /// Mean and standard error of `first` − `second` at `point`.
    fn difference(&self, first: Learner, second: Learner, point: usize) -> (f64, f64) {
        let quantity = self.quantity();
        let curve = self.sweep.difference(first, second, |run| quantity.of(run));
        (curve.mean[point], curve.sem[point])
    }

    /// Whether `first` equals `second` at `point`, and their difference in words.
    pub(super) fn equal(&self, first: Learner, second: Learner, point: usize) -> (bool, String) {
        let (mean, sem) = self.difference(first, second, point);
        let equal = mean.abs() + ERRORS * sem <= EQUAL;
        let words = in_words(mean, sem);
        if equal || mean.abs() <= ERRORS * sem {
            return (equal, words);
        }
        (
            false,
            format!("{words} ({:.1} standard errors from 0)", mean.abs() / sem),
        )
    }

    /// Whether `first` is above `second` at `point`, and their difference in words.
    pub(super) fn greater(&self, first: Learner, second: Learner, point: usize) -> (bool, String) {
        let (mean, sem) = self.difference(first, second, point);
        (mean > ERRORS * sem + ROUNDING, in_words(mean, sem))
    }

    /// What was published for both learners at `p`.
    pub(super) fn published_pair(&self, first: Learner, second: Learner, p: f64) -> String {
        let pair = (self.published.at(first, p)).zip(self.published.at(second, p));
        pair.map_or_else(String::new, |(above, below)| {
            let difference = signed(above - below);
            format!("Published: {above:.3} against {below:.3}, {difference}.")
        })
    }
}

/// The name that people know a learner by.
pub(super) const fn name(learner: Learner) -> &'static str {
    match learner {
        Learner::Iac => "IAC",
        Learner::Jal => "JAL",
        Learner::Mackrl => "MACKRL",
    }
}

/// Mean of `quantity` over `runs`.
pub(super) fn mean(runs: &[&Run], quantity: Quantity) -> f64 {
    runs.iter().map(|run| quantity.of(run)).sum::<f64>() / runs.len() as f64
}

/// The smallest and the largest of `probabilities`.
pub(super) fn range<'a>(probabilities: impl IntoIterator<Item = &'a f64>) -> [f64; 2] {
    let start = [f64::INFINITY, f64::NEG_INFINITY];
    (probabilities.into_iter()).fold(start, |[low, high], &value| {
        [low.min(value), high.max(value)]
    })
}

fn in_words(mean: f64, sem: f64) -> String {
    format!("{} ± {sem:.3}", signed(mean))
}

fn signed(value: f64) -> String {
    format!("{value:+.3}").replace('-', "−")
}
