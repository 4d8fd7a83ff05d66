//! The flags from which a configuration is put together.

use std::path::PathBuf;

use clap::Args;
use mackrl_run::{
    bounded,
    config::{Config, ConfigBuilder, EnvironmentConfig, Preset},
    scenario_file::with_scenario,
};

use crate::args::{MOST, number};

/// The preset that is taken if none is asked for.
const DEFAULT: &str = "default";
/// Greatest length of a configuration in bytes; it may hold the text of a scenario, every character escaped.
const FILE_MAX: usize = 2 << 20;

/// The world called `map`, with the settings of `set` laid over those of `builder`; errors about its name begin with what was
/// `typed`.
pub(crate) fn world(
    builder: ConfigBuilder,
    typed: &str,
    map: &str,
    set: &[String],
) -> anyhow::Result<EnvironmentConfig> {
    let mut builder = builder.map(typed, map);
    for assignment in set {
        builder = builder.set(assignment)?;
    }
    Ok(with_scenario(builder)?.build_environment()?)
}

/// Takes the text of a scenario away that `env` has, so that another map can be named.
pub(crate) fn without_scenario(
    builder: ConfigBuilder,
    env: &EnvironmentConfig,
) -> anyhow::Result<ConfigBuilder> {
    Ok(match env.get("scenario") {
        Some(_) => builder.set("env.scenario=\"\"")?,
        None => builder,
    })
}

fn env_help() -> String {
    let names = crate::registry()
        .worlds()
        .map(|kind| kind.name().to_owned());
    format!(
        "Kind of world: {} (short for `--set env.name=NAME`)",
        or(names.collect())
    )
}

fn algorithm_help() -> String {
    let names = crate::registry().algorithms();
    let names = names.map(|kind| kind.name().to_owned());
    format!(
        "What learns: {} (short for `--set algorithm.name=NAME`)",
        or(names.collect())
    )
}

fn preset_help() -> String {
    let names = crate::registry().presets();
    let names = names.map(|Preset { name, .. }| name.to_owned());
    format!(
        "Shipped configuration to start from: {} [default: {DEFAULT}]",
        or(names.collect())
    )
}

/// "a, b or c"
fn or(names: Vec<String>) -> String {
    match names.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => names.concat(),
    }
}

#[derive(Debug, Clone, Args)]
pub(crate) struct ConfigurationArgs {
    /// Map to play, as `mackrl maps` lists it, a scenario file ending in .toml, or a kind of world that has no maps
    #[arg(long, value_name = "MAP", help_heading = "Configuration")]
    pub(crate) map: Option<String>,

    #[arg(long, value_name = "NAME", help_heading = "Configuration", help = env_help())]
    pub(crate) env: Option<String>,

    #[arg(long, value_name = "NAME", help_heading = "Configuration", help = algorithm_help())]
    pub(crate) algorithm: Option<String>,

    /// Environment steps of training, summed over parallel environments (short for `--set run.steps_env=N`)
    #[arg(long, value_name = "N", help_heading = "Configuration", value_parser = number(1, MOST))]
    pub(crate) steps: Option<u64>,

    /// Seed from which all randomness follows (short for `--set run.seed=S`)
    #[arg(long, value_name = "S", help_heading = "Configuration", value_parser = number(0, MOST))]
    pub(crate) seed: Option<u64>,

    #[arg(long, value_name = "NAME", help_heading = "Configuration", help = preset_help())]
    pub(crate) preset: Option<String>,

    /// TOML file laid over the preset; it needs only the lines that it changes
    #[arg(long, value_name = "FILE", help_heading = "Configuration")]
    pub(crate) config: Option<PathBuf>,

    /// One setting laid over everything else, such as algorithm.gamma=0.95; repeatable
    #[arg(long, value_name = "KEY=VALUE", help_heading = "Configuration")]
    pub(crate) set: Vec<String>,
}

impl ConfigurationArgs {
    /// The shipped configuration to start from.
    pub(crate) fn preset(&self) -> &str {
        self.preset.as_deref().unwrap_or(DEFAULT)
    }

    /// Lays the layers over each other; `build` on the result checks ranges and gives the configuration.
    pub(crate) fn layers(&self) -> anyhow::Result<ConfigBuilder> {
        self.over(ConfigBuilder::new(crate::registry()).preset(self.preset())?)
    }

    /// As [`Self::layers`], over the configuration of a run. A scenario of its own gives way to a map that is asked for.
    pub(crate) fn over_run(&self, run: &Config) -> anyhow::Result<ConfigBuilder> {
        let builder = ConfigBuilder::new(crate::registry());
        let mut builder = builder.recorded("the run's config.toml", &run.to_toml())?;
        if let Some(preset) = &self.preset {
            builder = builder.preset(preset)?;
        }
        if self.map.is_some() {
            builder = without_scenario(builder, &run.env)?;
        }
        self.over(builder)
    }

    fn over(&self, mut builder: ConfigBuilder) -> anyhow::Result<ConfigBuilder> {
        if let Some(path) = &self.config {
            let name = path.display().to_string();
            let text = bounded::read_text(path, FILE_MAX)?;
            builder = builder.file(&name, &text)?;
        }
        for (flag, key, value) in self.short_flags() {
            if let Some(value) = value {
                builder = builder.flag(&format!("{flag} {value}"), &format!("{key}={value}"))?;
            }
        }
        if let Some(map) = &self.map {
            builder = builder.map(&format!("--map {map}"), map);
        }
        for assignment in &self.set {
            builder = builder.set(assignment)?;
        }
        Ok(with_scenario(builder)?)
    }

    fn short_flags(&self) -> [(&'static str, &'static str, Option<String>); 4] {
        [
            ("--env", "env.name", self.env.clone()),
            ("--algorithm", "algorithm.name", self.algorithm.clone()),
            (
                "--steps",
                "run.steps_env",
                self.steps.map(|n| n.to_string()),
            ),
            ("--seed", "run.seed", self.seed.map(|n| n.to_string())),
        ]
    }
}
