//! What takes the place of `sc2` in a program that was built without StarCraft II: it says what is missing.

use std::sync::Arc;

use mackrl::Error;
use mackrl_env::{Environment, EpisodeKey};
use mackrl_run::{
    config::{Config, Engine, EnvironmentConfig},
    training::assembly::{Simulator, World, WorldSource},
};
use mackrl_skirmish::scripted::ScriptedPolicy;

use crate::{
    args::{PlayArgs, Sc2Args},
    failure::Failure,
};

/// What is missing, and where it is not.
const MISSING: &str = "this program was built without StarCraft II: build it on Linux with the feature `sc2`, which is on by default";

/// Worlds of StarCraft II, none of which can be made.
#[derive(Debug)]
struct NoWorlds;

impl WorldSource for NoWorlds {
    fn make(&self, _: &EnvironmentConfig) -> Result<Box<dyn Environment>, Error> {
        Err(missing())
    }

    fn parallel_max(&self) -> Option<usize> {
        None
    }

    fn counts(&self) -> Vec<(&'static str, u64)> {
        Vec::new()
    }
}

/// The worlds that a run is played in.
pub(crate) fn world(config: &Config) -> Result<World, Error> {
    match config.env.engine {
        Engine::Simulator => World::from_source(config, Arc::new(Simulator)),
        Engine::Sc2 => Err(missing()),
    }
}

/// Where the worlds that `map` describes come from.
pub(crate) fn worlds(map: &EnvironmentConfig) -> Box<dyn WorldSource> {
    match map.engine {
        Engine::Simulator => Box::new(Simulator),
        Engine::Sc2 => Box::new(NoWorlds),
    }
}

/// Plays nothing.
pub(crate) fn play_one(
    _: &PlayArgs,
    _: &EnvironmentConfig,
    _: ScriptedPolicy,
    _: EpisodeKey,
) -> anyhow::Result<()> {
    Err(missing().into())
}

/// Runs no command.
pub(crate) fn run(args: &Sc2Args) -> anyhow::Result<()> {
    let typed = ["sc2"]
        .into_iter()
        .chain(args.rest.iter().map(String::as_str));
    let typed: Vec<_> = typed.collect();
    Err(Failure::usage(format!(
        "cannot run `mackrl {}`: {MISSING}",
        typed.join(" ")
    ))
    .into())
}

fn missing() -> Error {
    Error::Config(format!(
        "env.engine is `sc2`, expected `simulator`: {MISSING}"
    ))
}
