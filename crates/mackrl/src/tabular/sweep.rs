//! All runs of Figure 5: every learner at every probability of common knowledge.

use std::{
    num::NonZeroUsize,
    sync::atomic::{AtomicUsize, Ordering},
};

use mackrl_env::{
    EpisodeKey, Stream,
    matrix_game::{InvalidProbability, ObservationDistribution, Payoffs},
};
use serde::{Deserialize, Serialize};

use super::{
    game::TabularGame,
    policy::Learner,
    training::{Run, train},
};
use crate::{parallel::for_each_in_parallel, statistics::mean_and_standard_error};

/// What is run.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepSettings {
    /// Which pair of matrices is played.
    pub payoffs: Payoffs,
    /// How often agents see the matrix.
    pub distribution: ObservationDistribution,
    /// Probabilities of common knowledge, each in [0, 1].
    pub points: Vec<f64>,
    /// Independent runs of each learner at each point, at least 1.
    pub runs: usize,
    /// Names all initial logits, together with the run's and the point's number.
    pub seed: u64,
    /// Threads to use; results do not depend on it.
    pub threads: NonZeroUsize,
}

/// Means and standard errors over runs, one entry per point.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Mean over runs.
    pub mean: Vec<f64>,
    /// Standard error of the mean; 0 if there is a single run.
    pub sem: Vec<f64>,
}

/// Every run of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    points: usize,
    runs: usize,
    /// By learner, point and run, the last innermost.
    all: Vec<Run>,
}

/// Trains every learner at every point, `runs` times each. `done` hears how many runs are finished, from any thread.
///
/// At each point all learners start from the same initial logits, so their differences are those of paired runs; different
/// points have different ones, so the error bars of a curve are independent of each other.
///
/// # Errors
/// If a point is not in [0, 1].
pub fn sweep(
    settings: &SweepSettings,
    done: impl Fn(usize) + Sync,
) -> Result<Sweep, InvalidProbability> {
    let games: Vec<TabularGame> = (settings.points.iter())
        .map(|&p| TabularGame::new(settings.payoffs, settings.distribution, p))
        .collect::<Result<_, _>>()?;
    let (points, runs) = (games.len(), settings.runs);
    let job = |index: usize| {
        let (cell, run) = (index / runs, index % runs);
        let (learner, point) = (Learner::ALL[cell / points], cell % points);
        let key = EpisodeKey::new(settings.seed, Stream::Other, run as u64);
        train(&games[point], learner, key, point)
    };
    let finished = AtomicUsize::new(0);
    let mut all: Vec<(usize, Option<Run>)> = (0..Learner::ALL.len() * points * runs)
        .map(|index| (index, None))
        .collect();
    for_each_in_parallel(settings.threads.get(), &mut all, |(index, run)| {
        *run = Some(job(*index));
        done(finished.fetch_add(1, Ordering::Relaxed) + 1);
    });
    Ok(Sweep {
        points,
        runs,
        all: all.into_iter().filter_map(|(_, run)| run).collect(),
    })
}

impl Sweep {
    /// The runs of `learner` at the point with index `point`.
    ///
    /// # Panics
    /// If there is no such point.
    #[must_use]
    pub fn runs(&self, learner: Learner, point: usize) -> &[Run] {
        assert!(point < self.points, "point {point} of {}", self.points);
        let cell = learner as usize * self.points + point;
        &self.all[cell * self.runs..(cell + 1) * self.runs]
    }

    /// Mean and standard error of `quantity` over the runs of `learner` at each point.
    #[must_use]
    pub fn curve(&self, learner: Learner, quantity: impl Fn(&Run) -> f64) -> Curve {
        (0..self.points)
            .map(|point| {
                let runs = self.runs(learner, point).iter();
                mean_and_standard_error(&runs.map(&quantity).collect::<Vec<_>>())
            })
            .collect()
    }

    /// Mean and standard error of the difference `first` − `second` of `quantity` over paired runs at each point.
    #[must_use]
    pub fn difference(
        &self,
        first: Learner,
        second: Learner,
        quantity: impl Fn(&Run) -> f64,
    ) -> Curve {
        (0..self.points)
            .map(|point| {
                let pairs = (self.runs(first, point).iter()).zip(self.runs(second, point));
                let differences: Vec<f64> = pairs
                    .map(|(first, second)| quantity(first) - quantity(second))
                    .collect();
                mean_and_standard_error(&differences)
            })
            .collect()
    }
}

impl FromIterator<(f64, f64)> for Curve {
    fn from_iter<I: IntoIterator<Item = (f64, f64)>>(entries: I) -> Self {
        let (mean, sem) = entries.into_iter().unzip();
        Self { mean, sem }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(runs: usize, threads: usize, points: &[f64]) -> SweepSettings {
        SweepSettings {
            payoffs: Payoffs::Coded,
            distribution: ObservationDistribution::Y2018,
            points: points.to_vec(),
            runs,
            seed: 1,
            threads: NonZeroUsize::new(threads).unwrap(),
        }
    }

    #[test]
    fn runs_do_not_depend_on_the_number_of_threads() {
        let one = sweep(&settings(3, 1, &[0.0, 0.7]), |_| ()).unwrap();
        let many = sweep(&settings(3, 7, &[0.0, 0.7]), |_| ()).unwrap();
        assert_eq!(one, many);
        assert_eq!(one.runs(Learner::Mackrl, 1).len(), 3);
    }

    /// An independent computation (another program, 200 to 1 000 runs a point) gave these means; the published figure agrees.
    #[test]
    fn learned_curves_of_the_coded_game_lie_where_they_should() {
        let runs = 60;
        let found = sweep(&settings(runs, 2, &[0.0, 0.4, 1.0]), |_| ()).unwrap();
        for (learner, expected) in [
            (Learner::Iac, [0.654, 0.742, 0.878]),
            (Learner::Jal, [0.498, 0.697, 0.996]),
            (Learner::Mackrl, [0.638, 0.777, 0.996]),
        ] {
            let curve = found.curve(learner, |run| run.train);
            for (point, expected) in expected.into_iter().enumerate() {
                let (mean, sem) = (curve.mean[point], curve.sem[point]);
                // Four standard errors of ours, the other computation's error (below 0.004) and its rounding.
                let margin = 4.0 * sem + 0.004 + 0.001;
                assert!(
                    (mean - expected).abs() < margin,
                    "{learner:?} {point}: {mean} ± {sem}"
                );
            }
        }
    }
}
