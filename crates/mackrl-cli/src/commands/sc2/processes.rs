//! `mackrl sc2 ps` and `mackrl sc2 kill`: games that this program started.

use anyhow::Context;
use mackrl_sc2::{
    adapter::process::{GameNote, running_games},
    lifetime,
};

use crate::{
    args::{KillArgs, PsArgs},
    failure::Failure,
    output,
};

/// Prints every running game.
pub(super) fn list(args: &PsArgs) -> anyhow::Result<()> {
    let games = running()?;
    if args.json {
        return output::print_json(&games);
    }
    let heading = ["process", "owner", "port", "program"].map(str::to_owned);
    let row = |game: &GameNote| {
        vec![
            game.pid.to_string(),
            game.owner.to_string(),
            game.port.to_string(),
            game.program.display().to_string(),
        ]
    };
    let rows: Vec<Vec<String>> = std::iter::once(heading.into())
        .chain(games.iter().map(row))
        .collect();
    output::print(&output::table(&rows))
}

/// Kills the games that were named, or all.
pub(super) fn kill(args: &KillArgs) -> anyhow::Result<()> {
    let games = running()?;
    if let Some(stranger) = args
        .pid
        .iter()
        .find(|pid| games.iter().all(|game| game.pid != **pid))
    {
        let own: Vec<String> = games.iter().map(|game| game.pid.to_string()).collect();
        let message = format!(
            "process {stranger} is no game that this program started, expected one of: {}",
            own.join(", ")
        );
        return Err(Failure::Usage { message }.into());
    }
    let chosen = |game: &&GameNote| args.pid.is_empty() || args.pid.contains(&game.pid);
    let mut killed = 0;
    for game in games.iter().filter(chosen) {
        lifetime::kill(game.pid).with_context(|| format!("cannot kill process {}", game.pid))?;
        killed += 1;
    }
    output::print(&format!("killed: {killed}\n"))
}

fn running() -> anyhow::Result<Vec<GameNote>> {
    running_games().context("cannot look for games")
}
