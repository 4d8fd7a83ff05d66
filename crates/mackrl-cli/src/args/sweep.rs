//! Making many runs.

use std::{num::NonZeroUsize, path::PathBuf, time::Duration};

use clap::Args;

use crate::args::runs::ThreadsArgs;

/// Make many runs: algorithms by maps by seeds, by any settings
///
/// The plan is a TOML file; examples/sweeps/figure6.toml explains every line of one. Each run has a process and a run folder of its
/// own, with checkpoints. What is finished is skipped, what is unfinished goes on where it was: stop with Ctrl-C (SIGINT), SIGTERM
/// or SIGUSR1, and give the same command again. If the command is killed, its runs write a checkpoint and stop.
///
/// --index makes one run in this process, as an array job of a cluster does: it can be given again as often as wanted, goes on
/// where it was, and ends with exit code 75 if it wants to be started again (after a signal or --time-limit), with 0 once the run is
/// finished. examples/sweeps/array-job.sh is such a job for SLURM.
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

    /// Runs at a time, each on one thread [default: all cores]
    #[arg(long, value_name = "K", conflicts_with_all = ["index", "list"])]
    jobs: Option<NonZeroUsize>,

    /// Make the run with this number alone, in this process; --list shows the numbers, which begin with 0
    #[arg(long, value_name = "I", conflicts_with = "list")]
    pub(crate) index: Option<usize>,

    /// Stop as after a signal after this time: 90s, 55m or 11h
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub(crate) time_limit: Option<Duration>,

    /// List the runs and how each stands, and make none
    #[arg(long)]
    pub(crate) list: bool,

    #[command(flatten)]
    pub(crate) threads: ThreadsArgs,

    /// Print JSON instead of a table or a sentence
    #[arg(long)]
    pub(crate) json: bool,
}

impl SweepArgs {
    /// Runs at a time.
    pub(crate) fn jobs(&self) -> NonZeroUsize {
        let processors = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        self.jobs.unwrap_or_else(processors)
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
