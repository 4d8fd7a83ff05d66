//! `mackrl sc2 serve`: the simulator behind StarCraft II's API.

use std::{
    io::{self, Write},
    net::SocketAddr,
    sync::Arc,
};

use anyhow::Context;
use mackrl_run::{
    config::EnvironmentConfig,
    replay::{Player, Replay, Step},
};
use mackrl_sc2::{
    lifetime::end_with_parent,
    stand_in::{EpisodeRecord, GameArguments, StandIn, StandInOptions, faults::FaultPlan},
};
use mackrl_skirmish::{SkirmishKind, UnitData};

use crate::{
    args::{ServeArgs, UnitsChoice},
    failure::Failure,
};

/// Serves until a client asks to quit.
pub(super) fn run(args: &ServeArgs) -> anyhow::Result<()> {
    let process = u64::from(std::process::id());
    let faults = args
        .fault
        .as_deref()
        .map(str::parse::<FaultPlan>)
        .transpose();
    let faults = faults.map_err(Failure::usage)?;
    let address = address(args)?;
    let units = match args.units {
        UnitsChoice::Liberty => UnitData::Liberty,
        UnitsChoice::Lotv => UnitData::Lotv,
    };
    let options = StandInOptions {
        units,
        seed: args.seed.unwrap_or(process),
        replays: Some(Box::new(move |record| Ok(replay(record, units).to_bytes()))),
        faults: faults.map(|plan| plan.of_process(process)),
    };
    let server =
        StandIn::bind(address, options).with_context(|| format!("cannot listen on {address}"))?;
    say(&format!(
        "answering StarCraft II's API on ws://{}/sc2api\n",
        server.address()?
    ));
    server
        .serve(|error| say(&format!("a client was cut off: {error}\n")))
        .context("cannot accept clients")
}

/// What a client did, as a replay that `mackrl replay` plays.
fn replay(record: &EpisodeRecord, units: UnitData) -> Replay {
    let mut env = EnvironmentConfig::new(Arc::new(SkirmishKind));
    for (name, value) in [("map", &*record.map), ("units", units.word())] {
        env.set(name, value).expect("a map's name and a word");
    }
    let steps = record.steps.iter().map(|(actions, hash)| Step {
        actions: actions.clone(),
        state_hash: format!("{hash:016x}"),
        value: None,
        thought: None,
    });
    Replay {
        program: env!("CARGO_PKG_VERSION").to_owned(),
        env,
        key: record.key,
        player: Player::Client,
        steps: steps.collect(),
    }
}

/// Where to listen: what clients pass to the game, or what was typed.
fn address(args: &ServeArgs) -> anyhow::Result<SocketAddr> {
    if args.game.is_empty() {
        return Ok(SocketAddr::new(args.listen, args.port));
    }
    let game = GameArguments::parse(&args.game).map_err(Failure::usage)?;
    end_with_parent();
    Ok(SocketAddr::new(game.listen, game.port))
}

/// Tells on stderr; nobody has to listen.
fn say(text: &str) {
    let _ = io::stderr().write_all(text.as_bytes());
}
