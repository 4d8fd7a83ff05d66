//! `mackrl sc2`: the real game, and the server that stands in for it.

mod doctor;
mod install;
mod play;
mod processes;
mod record;
mod serve;
mod worlds;

use mackrl_sc2::lifetime::become_game;

use crate::args::{ExecGameArgs, Sc2Args, Sc2Command};
pub(crate) use play::play_one;
pub(crate) use worlds::{world, world_of};

/// Runs the command that was typed.
pub(crate) fn run(args: &Sc2Args) -> anyhow::Result<()> {
    match &args.command {
        Sc2Command::Doctor(args) => doctor::run(args),
        Sc2Command::Ps(args) => processes::list(args),
        Sc2Command::Kill(args) => processes::kill(args),
        Sc2Command::Record(args) => record::run(args),
        Sc2Command::Install(args) => install::run(args),
        Sc2Command::Serve(args) => serve::run(args),
        Sc2Command::ExecGame(args) => exec_game(args),
    }
}

/// Becomes the game; returns only if that fails.
fn exec_game(args: &ExecGameArgs) -> anyhow::Result<()> {
    let [program, arguments @ ..] = &args.game[..] else {
        anyhow::bail!("no program to become");
    };
    let mut command = std::process::Command::new(program);
    command.args(arguments);
    Err(anyhow::Error::from(become_game(args.parent, command))
        .context(format!("cannot become {program}")))
}
