//! The command that asks what happened in a run.

use std::path::PathBuf;

use clap::Args;

use super::runs::ThreadsArgs;

/// Name the first difference of two runs, of two checkpoints, or of two files of results
///
/// Of runs: code, map data and configuration, then the first row of metrics that differs (what depends on the clock aside). If one
/// does, both runs are played again side by side, from their configurations, up to the first update after which their parameters
/// differ and to the first game step that differs; and each run's records are compared with what its configuration gives, so
/// records that were changed are found out. That takes as long as training up to that row took; --no-replay leaves it out.
///
/// Of checkpoints: counters, then tensors. Of JSON files, such as those that evaluate, certify and reproduce write: where
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
