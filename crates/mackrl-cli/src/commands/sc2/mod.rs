//! `mackrl sc2`: the real game, and the server that stands in for it.

mod install;
mod serve;

use crate::args::{Sc2Args, Sc2Command};

/// Runs the command that was typed.
pub(crate) fn run(args: &Sc2Args) -> anyhow::Result<()> {
    match &args.command {
        Sc2Command::Install(args) => install::run(args),
        Sc2Command::Serve(args) => serve::run(args),
    }
}
