//! `mackrl sc2 ps` and `mackrl sc2 kill`: games that this program started.

use std::{
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, bail};
use mackrl_sc2::{
    adapter::process::{GameNote, running_games},
    lifetime,
};

use crate::{
    args::{KillArgs, PsArgs},
    failure::Failure,
    output,
};

/// How long a killed process may take to end.
const KILL_TIMEOUT: Duration = Duration::from_secs(5);

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
    let chosen: Vec<&GameNote> = games.iter().filter(chosen).collect();
    for game in &chosen {
        lifetime::kill(game.pid).with_context(|| format!("cannot kill process {}", game.pid))?;
    }
    for game in &chosen {
        wait_for_end(game)?;
    }
    output::print(&format!("killed: {}\n", chosen.len()))
}

/// Waits until the kernel has taken a killed game away, so that nobody who looks afterwards finds it.
fn wait_for_end(game: &GameNote) -> anyhow::Result<()> {
    let deadline = Instant::now() + KILL_TIMEOUT;
    while lifetime::is_running(game.pid, game.start) {
        if Instant::now() > deadline {
            bail!("process {} was killed but has not ended", game.pid);
        }
        thread::sleep(Duration::from_millis(5));
    }
    Ok(())
}

fn running() -> anyhow::Result<Vec<GameNote>> {
    running_games().context("cannot look for games")
}
