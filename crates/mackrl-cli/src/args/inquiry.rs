//! The commands that ask what happened in a run.

use std::path::PathBuf;

use clap::Args;

use super::runs::ThreadsArgs;

/// Repeat an update that was refused because of a number that is not finite, and show where the number comes from
///
/// `mackrl train` and `mackrl resume` keep such an update as a dump: the configuration, and the run before it. Nothing else is
/// needed to play the same episodes and compute the same numbers, to the bit. Every tensor of the update is listed in the order of
/// computation with its range, so the first that is not finite is where the number comes from, and a range that grows shows why.
/// With --json, the parameters and moments before the update are listed too.
///
/// Exit codes: 0 if the update is refused as it was, 1 if it is not (by another version of this program, it may not be), 65 for a
/// damaged dump.
///
/// Example: mackrl debug runs/3m-mackrl-seed1
#[derive(Debug, Args)]
pub(crate) struct DebugArgs {
    /// Dump that `mackrl train` named when it stopped, or its run folder for the latest one
    #[arg(value_name = "DUMP")]
    pub(crate) dump: PathBuf,

    #[command(flatten)]
    pub(crate) threads: ThreadsArgs,

    /// Print a JSON object instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}

/// Name the first difference of two runs, of two checkpoints, or of two files of results
///
/// Of runs: code, map data and configuration, then the first row of metrics that differs (what depends on the clock aside). If one
/// does, both runs are played again side by side, from their configurations, up to the first update after which their parameters
/// differ and to the first game step that differs; and each run's records are compared with what its configuration gives, so
/// records that were changed are found out. That takes as long as training up to that row took; --no-replay leaves it out.
///
/// Of checkpoints or dumps: counters, then tensors. Of JSON files, such as those that evaluate, certify and reproduce write: where
/// they come from, then the first value that differs.
///
/// Exit codes: 0 if there is no difference, 1 if there is one.
///
/// Examples: mackrl diff runs/one runs/other; mackrl diff one.json other.json --json
#[derive(Debug, Args)]
pub(crate) struct DiffArgs {
    /// Run folder, folder of a checkpoint, or JSON file
    #[arg(value_name = "A")]
    pub(crate) a: PathBuf,

    /// What to compare it with, of the same kind
    #[arg(value_name = "B")]
    pub(crate) b: PathBuf,

    /// Compare what is recorded, and play nothing again
    #[arg(long)]
    pub(crate) no_replay: bool,

    #[command(flatten)]
    pub(crate) threads: ThreadsArgs,

    /// Print a JSON object instead of lines
    #[arg(long)]
    pub(crate) json: bool,
}
