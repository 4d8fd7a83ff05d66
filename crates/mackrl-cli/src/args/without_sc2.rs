//! The commands around StarCraft II, in a program that was built without them.

use clap::Args;

/// Play on StarCraft II itself, or let StarCraft's clients play on the built-in simulator
///
/// This program was built without these commands. They are in programs for Linux that are built with the feature `sc2`, which is
/// on by default.
#[derive(Debug, Args)]
pub(crate) struct Sc2Args {
    /// What other programs take
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    pub(crate) rest: Vec<String>,
}
