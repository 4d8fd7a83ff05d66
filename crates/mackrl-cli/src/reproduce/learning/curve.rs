//! Means over seeds.

use mackrl::statistics::mean_and_standard_error;
use serde::{Deserialize, Serialize};

use crate::plot::Point;

/// Means with their standard errors, one entry per test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Curve {
    /// Mean over seeds.
    pub(crate) mean: Vec<f64>,
    /// Its standard error.
    pub(crate) sem: Vec<f64>,
    /// Number of seeds.
    pub(crate) runs: usize,
}

/// A difference of two means of independent samples, with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Difference {
    /// First mean − second mean.
    pub(crate) mean: f64,
    /// Standard error of the difference (Welch).
    pub(crate) error: f64,
}

impl Curve {
    /// The curve of some runs, each with a number per test; cut to the shortest.
    ///
    /// # Panics
    /// If there are fewer than two runs, which have no standard error.
    #[must_use]
    pub(crate) fn of(runs: &[&[f64]]) -> Self {
        assert!(runs.len() > 1, "a standard error needs two runs");
        let tests = runs.iter().map(|run| run.len()).min().unwrap_or(0);
        let at = |test: usize| runs.iter().map(|run| run[test]).collect::<Vec<f64>>();
        let (mean, sem) = (0..tests)
            .map(|test| mean_and_standard_error(&at(test)))
            .unzip();
        Self {
            mean,
            sem,
            runs: runs.len(),
        }
    }

    /// The curve over the environment steps of its tests, with a band of one standard error.
    #[must_use]
    pub(crate) fn points(&self, steps: &[u64]) -> Vec<Point> {
        (steps.iter().zip(self.mean.iter().zip(&self.sem)))
            .map(|(&step, (&mean, &error))| Point::with_error(step as f64, mean, error))
            .collect()
    }
}

impl Difference {
    /// Of the means of two samples.
    #[must_use]
    pub(crate) fn between(first: &[f64], second: &[f64]) -> Self {
        let (first, second) = (
            mean_and_standard_error(first),
            mean_and_standard_error(second),
        );
        Self {
            mean: first.0 - second.0,
            error: first.1.hypot(second.1),
        }
    }

    /// Whether the first mean is greater by more than two standard errors.
    #[must_use]
    pub(crate) fn is_ahead(self) -> bool {
        self.mean > 2.0 * self.error
    }

    /// Whether the first mean is less by more than two standard errors.
    #[must_use]
    pub(crate) fn is_behind(self) -> bool {
        -self.mean > 2.0 * self.error
    }
}

impl std::fmt::Display for Difference {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{:+.3} ± {:.3}", self.mean, self.error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_the_mean_at_each_test_with_its_error() {
        let curve = Curve::of(&[&[0.0, 1.0, 9.0], &[1.0, 1.0]]);
        assert_eq!(
            (curve.mean, curve.sem, curve.runs),
            (vec![0.5, 1.0], vec![0.5, 0.0], 2)
        );
    }

    #[test]
    fn ahead_means_by_two_standard_errors_of_the_difference() {
        let close = Difference::between(&[1.0, 3.0], &[0.0, 2.0]);
        assert!((close.mean - 1.0).abs() < 1e-12 && (close.error - 2.0_f64.sqrt()).abs() < 1e-12);
        assert!(!close.is_ahead());
        assert!(Difference::between(&[9.0, 11.0], &[0.0, 2.0]).is_ahead());
    }
}
