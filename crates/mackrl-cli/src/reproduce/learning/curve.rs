//! Means over seeds.

use mackrl::statistics::{mean_and_standard_error, student_factor};
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
    /// Degrees of freedom of that error (Welch and Satterthwaite).
    degrees: f64,
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
        let [one, other] = [first, second].map(mean_and_standard_error);
        let error = one.1.hypot(other.1);
        let share = |(_, error): (f64, f64), sample: &[f64]| {
            error.powi(4) / (sample.len().max(2) - 1) as f64
        };
        let shares = share(one, first) + share(other, second);
        Self {
            mean: one.0 - other.0,
            error,
            // Without any spread there is no error to be uncertain about.
            degrees: if shares > 0.0 {
                error.powi(4) / shares
            } else {
                1.0
            },
        }
    }

    /// Its 95 % interval, by Student's t.
    #[must_use]
    pub(crate) fn interval(self) -> [f64; 2] {
        let half = student_factor(self.degrees) * self.error;
        [self.mean - half, self.mean + half]
    }

    /// Whether the first mean is greater: whether the interval lies above 0.
    #[must_use]
    pub(crate) fn is_ahead(self) -> bool {
        self.interval()[0] > 0.0
    }

    /// Whether the first mean is less: whether the interval lies below 0.
    #[must_use]
    pub(crate) fn is_behind(self) -> bool {
        self.interval()[1] < 0.0
    }
}

impl std::fmt::Display for Difference {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [low, high] = self.interval();
        write!(formatter, "{:+.3} [{low:+.3}, {high:+.3}]", self.mean)
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
    fn ahead_means_by_the_whole_interval_of_the_difference() {
        let close = Difference::between(&[1.0, 3.0], &[0.0, 2.0]);
        assert!((close.mean - 1.0).abs() < 1e-12 && (close.error - 2.0_f64.sqrt()).abs() < 1e-12);
        assert!(!close.is_ahead());
        // 5 is 3.5 standard errors, and of two runs each that is not enough: the factor for 2 degrees of freedom is 4.3.
        let two = Difference::between(&[5.0, 7.0], &[0.0, 2.0]);
        assert!((two.degrees - 2.0).abs() < 1e-9, "{two:?}");
        assert!(!two.is_ahead(), "{two}");
        let five = Difference::between(&[5.0, 7.0, 5.0, 7.0, 6.0], &[0.0, 2.0, 0.0, 2.0, 1.0]);
        assert!(five.is_ahead(), "{five}");
        assert!(Difference::between(&[9.0, 11.0], &[0.0, 2.0]).is_ahead());
        assert!(Difference::between(&[1.0, 1.0], &[0.5, 0.5]).is_ahead());
    }
}
