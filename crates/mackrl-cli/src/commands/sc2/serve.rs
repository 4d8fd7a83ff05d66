//! `mackrl sc2 serve`: the simulator behind StarCraft II's API.

use std::{
    io::{self, Write},
    net::SocketAddr,
};

use anyhow::Context;
use mackrl_env::skirmish::UnitData;
use mackrl_sc2::{
    lifetime::end_with_parent,
    stand_in::{GameArguments, StandIn, StandInOptions, faults::FaultPlan},
};

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
    let faults = faults.map_err(|error| usage(&error))?;
    let address = address(args)?;
    let options = StandInOptions {
        units: match args.units {
            UnitsChoice::Liberty => UnitData::Liberty,
            UnitsChoice::Lotv => UnitData::Lotv,
        },
        seed: args.seed.unwrap_or(process),
        replays: None,
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

/// Where to listen: what clients pass to the game, or what was typed.
fn address(args: &ServeArgs) -> anyhow::Result<SocketAddr> {
    if args.game.is_empty() {
        return Ok(SocketAddr::new(args.listen, args.port));
    }
    let game = GameArguments::parse(&args.game).map_err(|error| usage(&error))?;
    end_with_parent();
    Ok(SocketAddr::new(game.listen, game.port))
}

fn usage(error: &impl ToString) -> Failure {
    Failure::Usage {
        message: error.to_string(),
    }
}

/// Tells on stderr; nobody has to listen.
fn say(text: &str) {
    let _ = io::stderr().write_all(text.as_bytes());
}
