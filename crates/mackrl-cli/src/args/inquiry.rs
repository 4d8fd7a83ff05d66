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
