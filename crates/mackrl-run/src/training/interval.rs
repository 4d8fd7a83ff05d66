//! What training episodes gave since the last row of metrics.

use std::time::Instant;

use mackrl::{experience::Episode, policy::Tally};
use mackrl_env::Statistic;

/// What happened since the last row of metrics.
pub(super) struct Interval {
    pub(super) tally: Tally,
    pub(super) began: Instant,
    /// Environment steps when the interval began; a row after a resumption still tells of the whole interval.
    pub(super) steps_env: u64,
    /// Environment steps when the clock began: later than `steps_env` after a resumption.
    pub(super) steps_env_timed: u64,
}

impl Interval {
    pub(super) fn new(steps_env: u64) -> Self {
        Self {
            tally: Tally::default(),
            began: Instant::now(),
            steps_env,
            steps_env_timed: steps_env,
        }
    }

    pub(super) fn note_episode(&mut self, episode: &Episode, statistics: &[Statistic]) {
        let tally = &mut self.tally;
        tally.add("return_mean", episode.total_reward(), 1.0);
        tally.add("ep_length_mean", episode.steps() as f64, 1.0);
        for (statistic, value) in statistics.iter().zip(&episode.statistics_s) {
            tally.add(format!("{}_mean", statistic.name), *value, 1.0);
        }
    }
}
