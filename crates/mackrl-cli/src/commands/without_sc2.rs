//! What takes the place of `sc2` in a program that was built without StarCraft II: it says what is missing.

use std::sync::Arc;

use mackrl::Error;
use mackrl_env::{EpisodeKey, World};
use mackrl_run::{
    config::{Config, EnvironmentConfig},
    training::assembly,
};
use mackrl_skirmish::scripted::ScriptedPolicy;

use crate::{
    args::{PlayArgs, Sc2Args},
    failure::Failure,
};

/// What is missing, and where it is not.
const MISSING: &str = "this program was built without StarCraft II: build it on Linux with the feature `sc2`, which is on by default";

/// The world that a run is played in.
pub(crate) fn world(config: &Config) -> Result<assembly::RunWorld, Error> {
    assembly::RunWorld::of(world_of(&config.env)?)
}

/// The world that `map` describes.
pub(crate) fn world_of(map: &EnvironmentConfig) -> Result<Arc<dyn World>, Error> {
    if map.is_star_craft() {
        return Err(missing());
    }
    map.world()
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
    Error::Config(format!("env.name is `sc2`, expected `skirmish`: {MISSING}"))
}
