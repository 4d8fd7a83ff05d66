//! Making many runs.

use std::{num::NonZeroUsize, path::PathBuf, time::Duration};

use clap::{Args, ValueEnum};

use crate::args::{MOST, count_to, runs::ThreadsArgs, side_by_side, size};

/// Make many runs: algorithms by maps by seeds, by any settings
///
/// The plan is a TOML file; examples/sweeps/figure6.toml explains every line of one. Each run has a process and a run folder of its
/// own, with checkpoints. What is finished is skipped, what is unfinished goes on where it was: stop with Ctrl-C (SIGINT), SIGTERM
/// or SIGUSR1, and give the same command again. If the command is killed, its runs write a checkpoint and stop. Several commands
/// with one plan, on one machine or on many that share a disk, make each run once.
///
/// On a cluster, --slurm prints a batch script for this plan: `mackrl sweep plan.toml --slurm | sbatch`. docs/cluster.md leads from a laptop
/// to Slurm, Ray and Kubernetes. --index I makes one run, or with --block N the N runs from I·N on, and ends with exit code 75 if it wants
/// to be started again.
///
/// Exit codes: 0 all is finished, 65 a run failed, 75 interrupted: give the same command again.
///
/// Examples: mackrl sweep examples/sweeps/figure6.toml --jobs 2; mackrl sweep plan.toml --list --json
#[derive(Debug, Args)]
pub(crate) struct SweepArgs {
    /// The plan
    #[arg(value_name = "PLAN.toml")]
    pub(crate) plan: PathBuf,

    /// Folder of the run folders [default: the plan's `out`, or runs/PLAN]
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,

    /// Runs at a time, each on one thread; with --slurm, the cores of an array task [default: all cores]
    #[arg(long, value_name = "K", conflicts_with = "list", value_parser = side_by_side)]
    jobs: Option<NonZeroUsize>,

    /// Make the run with this number alone, in this process, or with --block the block of this number; --list shows the
    /// numbers, which begin with 0
    #[arg(long, value_name = "I", conflicts_with_all = ["list", "slurm"], value_parser = size(0, MOST))]
    pub(crate) index: Option<usize>,

    /// Runs that --index stands for, and that an array task of --slurm makes [default of --slurm: some ten minutes' work for
    /// all its cores]
    #[arg(long, value_name = "N", conflicts_with = "list", value_parser = count_to(1_000_000))]
    pub(crate) block: Option<NonZeroUsize>,

    /// Make the runs in DIR, on a disk of this machine; their run folders get every checkpoint
    #[arg(long, value_name = "DIR", conflicts_with = "list")]
    pub(crate) scratch: Option<PathBuf>,

    /// Only the runs that failed; they go on from their last checkpoint
    #[arg(long, value_name = "WHICH")]
    pub(crate) retry: Option<Retry>,

    /// Stop as after a signal after this time: 90s, 55m or 11h; with --slurm, the time limit of an array task
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub(crate) time_limit: Option<Duration>,

    /// List the runs, how each stands and where it is made, and make none
    #[arg(long)]
    pub(crate) list: bool,

    /// Print a batch script for Slurm that makes what is not finished, and make nothing; time and memory are measured by half a
    /// minute of training here
    #[arg(long, conflicts_with_all = ["list", "json", "threads"])]
    pub(crate) slurm: bool,

    #[command(flatten)]
    pub(crate) threads: ThreadsArgs,

    /// Print JSON instead of a table or a sentence
    #[arg(long)]
    pub(crate) json: bool,

    /// Stop as after a signal when stdin ends: the process that holds its other end has ended, however that came
    #[arg(long, hide = true)]
    pub(crate) leashed: bool,
}

/// Which runs are made again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Retry {
    /// Those that failed
    Failed,
}

impl SweepArgs {
    /// Runs at a time.
    pub(crate) fn jobs(&self) -> NonZeroUsize {
        let processors = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        self.jobs.unwrap_or_else(processors)
    }

    /// Whether the runs are made in processes of their own, not in this one.
    pub(crate) const fn has_processes(&self) -> bool {
        self.index.is_none()
            || self.jobs.is_some()
            || self.block.is_some()
            || self.scratch.is_some()
    }
}

/// A number of seconds, minutes or hours.
fn duration(text: &str) -> Result<Duration, String> {
    let units = [('s', 1), ('m', 60), ('h', 3600)];
    let seconds = units.into_iter().find_map(|(unit, seconds)| {
        let count: u64 = text.strip_suffix(unit)?.parse().ok()?;
        count.checked_mul(seconds).filter(|seconds| *seconds > 0)
    });
    seconds
        .map(Duration::from_secs)
        .ok_or_else(|| "expected a time such as 90s, 55m or 11h".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_a_unit() {
        assert_eq!(duration("55m"), Ok(Duration::from_secs(3300)));
        assert_eq!(duration("11h"), Ok(Duration::from_secs(39_600)));
        for text in [
            "",
            "5",
            "m",
            "-1s",
            "0s",
            "1.5h",
            "99999999999999999999h",
            "9999999999999999h",
        ] {
            assert!(duration(text).is_err(), "{text}");
        }
    }
}
