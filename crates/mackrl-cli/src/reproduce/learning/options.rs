//! What a reproduction of learning curves can be asked for.

use std::{num::NonZeroUsize, path::PathBuf, thread};

use clap::Args;

use crate::args::{number, side_by_side};

/// Options that the figures of learning share.
#[derive(Debug, Clone, Args)]
pub(crate) struct LearningOptions {
    /// Folder for the figure, its data and the finished runs; made if it is not there.
    ///
    /// A run that is finished there with the same settings is not repeated.
    #[arg(long, value_name = "DIR", default_value = "runs/learning")]
    pub(crate) out: PathBuf,

    /// Settings of both learners: paper-code, paper or default. The published figures fit the authors' code, not the paper's
    /// text.
    #[arg(long, value_name = "NAME", default_value = "paper-code")]
    pub(crate) preset: String,

    /// Seeds of each learner on each map: 1 to N, at least 2.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 10,
        value_parser = number(2, 1_000)
    )]
    pub(crate) seeds: u64,

    /// Environment steps of each run. The paper's curves go to 2.5 million.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 2_500_000,
        value_parser = number(1_000, 1_000_000_000)
    )]
    pub(crate) steps: u64,

    /// Environment steps between two greedy tests.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 25_000,
        value_parser = number(1_000, 1_000_000_000)
    )]
    pub(crate) interval: u64,

    /// Three seeds and 300 000 steps: to see that it works, not to conclude anything.
    #[arg(long)]
    pub(crate) quick: bool,

    /// Take runs together that were computed by different versions of simulator or learning; the report names them.
    #[arg(long, alias = "any-code")]
    pub(crate) mix: bool,

    /// Runs side by side, each on one thread; changes no result. [default: one for each processor]
    #[arg(long, value_name = "K", value_parser = side_by_side)]
    pub(crate) jobs: Option<NonZeroUsize>,

    /// Print the report as JSON instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}

impl LearningOptions {
    /// The options with what `--quick` stands for put in their places.
    #[must_use]
    pub(crate) fn resolved(&self) -> Self {
        let mut resolved = self.clone();
        if self.quick {
            (resolved.seeds, resolved.steps) = (3, 300_000);
        }
        resolved.interval = resolved.interval.min(resolved.steps);
        resolved
    }

    /// Runs side by side.
    pub(super) fn jobs(&self) -> NonZeroUsize {
        let processors = || thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        self.jobs.unwrap_or_else(processors)
    }

    /// Environment steps at which `tests` tests are due.
    #[must_use]
    pub(crate) fn steps_of(&self, tests: usize) -> Vec<u64> {
        let due = |test: u64| (test * self.interval).min(self.steps);
        (0..tests as u64).map(due).collect()
    }

    /// The command that repeats this result, whatever the folder and the number of jobs.
    #[must_use]
    pub(crate) fn command(&self, figure: &str) -> String {
        format!(
            "mackrl reproduce {figure} --preset {} --seeds {} --steps {} --interval {}",
            self.preset, self.seeds, self.steps, self.interval
        )
    }
}

#[cfg(test)]
impl Default for LearningOptions {
    fn default() -> Self {
        Self {
            out: PathBuf::new(),
            preset: "paper-code".to_owned(),
            seeds: 2,
            steps: 1_000,
            interval: 1_000,
            quick: false,
            mix: false,
            jobs: None,
            json: false,
        }
    }
}
