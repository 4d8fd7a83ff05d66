//! The commands that measure speed.

use std::num::NonZeroU64;

use clap::{Args, Subcommand};

/// Measure how fast this machine is
#[derive(Debug, Args)]
pub(crate) struct BenchArgs {
    #[command(subcommand)]
    pub(crate) command: BenchCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum BenchCommand {
    Env(BenchEnvironmentArgs),
}

/// Environment steps a second, on one core, with random available actions
///
/// Every step fills observations, state and action masks. The best of five equal parts is reported too, because other
/// work on the machine can only slow a part down.
///
/// Example: mackrl bench env --map 3m --steps 500000 --json
#[derive(Debug, Args)]
pub(crate) struct BenchEnvironmentArgs {
    /// Map to play, as `mackrl maps` lists it
    #[arg(long, value_name = "NAME", default_value = "3m")]
    pub(crate) map: String,

    /// Environment steps to play
    #[arg(long, value_name = "N", default_value = "100000")]
    pub(crate) steps: NonZeroU64,

    /// Print a JSON object instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}
