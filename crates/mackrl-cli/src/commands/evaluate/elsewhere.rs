//! `--map`: a team on another map than the one that it was trained on.

use std::path::Path;

use mackrl_run::{
    config::{Config, ConfigBuilder},
    scenario_file::with_scenario,
    training::assembly::RunWorld,
};

use crate::{
    args::without_scenario,
    commands::{sc2, sizes},
};

/// The configuration of a run with another map, and its world. All other settings stay.
///
/// # Errors
/// If there is no such map, or its sizes are not those of the run's own.
pub(super) fn elsewhere(
    folder: &Path,
    config: &Config,
    map: &str,
) -> anyhow::Result<(Config, RunWorld)> {
    let typed = format!("--map {map}");
    let builder = ConfigBuilder::new(crate::registry());
    let builder = builder.recorded("the run's config.toml", &config.to_toml())?;
    let builder = without_scenario(builder, &config.env)?.map(&typed, map);
    let mut other = config.clone();
    other.env = with_scenario(builder)?.build_environment()?;
    let world = sc2::world(&other)?;
    sizes::expect_same(config, &world, (&typed, &folder.display().to_string()))?;
    Ok((other, world))
}
