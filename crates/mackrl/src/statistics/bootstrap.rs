//! How sure a number is: intervals from resampled runs.

use mackrl_env::{Draw, EpisodeKey, Stream};
use serde::{Deserialize, Serialize};

use super::{interquartile_mean, mean, median, quantile};

/// A number, and between which bounds it probably lies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The statistic of the sample itself.
    pub estimate: f64,
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
}

/// How intervals are made: by the percentile bootstrap, stratified.
///
/// Each resample draws, from every stratum on its own, as many runs as the stratum has, with replacement. With a stratum per task
/// (and per algorithm, where two are compared) every resample has the tasks of the original, which is `rliable`'s rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bootstrap {
    /// Names the draws.
    pub seed: u64,
    /// Number of resamples, at least 1.
    pub resamples: usize,
    /// Share of resampled statistics inside the interval, in (0, 1).
    pub confidence: f64,
}

/// One number for all runs of all tasks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Aggregate {
    /// The mean over tasks of the mean over runs.
    Mean,
    /// Of one task, the median of its runs; of several, the median of their means.
    Median,
    /// The interquartile mean over all runs of all tasks.
    InterquartileMean,
}

impl Default for Bootstrap {
    /// 95 % intervals from 50 000 resamples, as in the literature.
    fn default() -> Self {
        Self {
            seed: 1,
            resamples: 50_000,
            confidence: 0.95,
        }
    }
}

impl Bootstrap {
    /// The interval of `statistic` over `strata`, each a list of runs.
    ///
    /// Draw i from stratum s in resample r is `Draw::Setup(i)` at step s of episode r.
    ///
    /// # Panics
    /// If there are no resamples or the confidence is not in (0, 1).
    #[must_use]
    pub fn interval(
        &self,
        strata: &[Vec<f64>],
        statistic: impl Fn(&[Vec<f64>]) -> f64,
    ) -> Interval {
        assert!(self.resamples > 0, "an interval needs a resample");
        let mut resampled = strata.to_vec();
        let statistics: Vec<f64> = (0..self.resamples as u64)
            .map(|resample| {
                let key = EpisodeKey::new(self.seed, Stream::Other, resample);
                draw(key, strata, &mut resampled);
                statistic(&resampled)
            })
            .collect();
        let outside = (1.0 - self.confidence) / 2.0;
        Interval {
            estimate: statistic(strata),
            low: quantile(&statistics, outside),
            high: quantile(&statistics, 1.0 - outside),
        }
    }
}

/// Fills `resampled` with runs drawn from `strata`, which has the same sizes.
fn draw(key: EpisodeKey, strata: &[Vec<f64>], resampled: &mut [Vec<f64>]) {
    for (number, (stratum, drawn)) in strata.iter().zip(resampled).enumerate() {
        for (place, run) in drawn.iter_mut().enumerate() {
            *run = stratum[index(key.uniform(number, Draw::Setup(place)), stratum.len())];
        }
    }
}

/// The index among `count` that a uniform number in [0, 1) chooses.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the product lies in 0..count"
)]
fn index(uniform: f64, count: usize) -> usize {
    ((uniform * count as f64) as usize).min(count - 1)
}

impl Aggregate {
    /// The statistic of `tasks`, each a list of runs.
    #[must_use]
    pub fn of(self, tasks: &[Vec<f64>]) -> f64 {
        let means = || -> Vec<f64> { tasks.iter().map(|runs| mean(runs)).collect() };
        match (self, tasks) {
            (Self::Mean, _) => mean(&means()),
            (Self::Median, [only]) => median(only),
            (Self::Median, _) => median(&means()),
            (Self::InterquartileMean, _) => interquartile_mean(&tasks.concat()),
        }
    }
}
