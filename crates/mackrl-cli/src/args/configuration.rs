//! The flags from which a configuration is put together.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use mackrl_run::{
    bounded,
    config::{ConfigBuilder, EnvironmentConfig},
    scenario_file::with_scenario,
};

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
    let quoted = serde_json::to_string(map).context("a name is a string")?;
    let mut builder = builder.flag(typed, &format!("env.map={quoted}"))?;
    for assignment in set {
        builder = builder.set(assignment)?;
    }
    Ok(with_scenario(builder)?.build_environment()?)
}

#[derive(Debug, Clone, Args)]
pub(crate) struct ConfigurationArgs {
    /// Map to play, as `mackrl maps` lists it, or a scenario file ending in .toml (short for `--set env.map=MAP`)
    #[arg(long, value_name = "MAP", help_heading = "Configuration")]
    pub(crate) map: Option<String>,

    /// What plays the battles: simulator, or sc2 for StarCraft II on this machine (short for `--set env.engine=NAME`)
    #[arg(long, value_name = "NAME", help_heading = "Configuration")]
    pub(crate) env: Option<String>,

    /// What learns: mackrl or central-v (short for `--set policy.algorithm=NAME`)
    #[arg(long, value_name = "NAME", help_heading = "Configuration")]
    pub(crate) algorithm: Option<String>,

    /// Environment steps of training, summed over parallel environments (short for `--set run.steps_env=N`)
    #[arg(long, value_name = "N", help_heading = "Configuration")]
    pub(crate) steps: Option<u64>,

    /// Seed from which all randomness follows (short for `--set run.seed=S`)
    #[arg(long, value_name = "S", help_heading = "Configuration")]
    pub(crate) seed: Option<u64>,

    /// Shipped configuration to start from: default, paper or paper-code
    #[arg(
        long,
        value_name = "NAME",
        default_value = "default",
        help_heading = "Configuration"
    )]
    pub(crate) preset: String,

    /// TOML file laid over the preset; it needs only the lines that it changes
    #[arg(long, value_name = "FILE", help_heading = "Configuration")]
    pub(crate) config: Option<PathBuf>,

    /// One setting laid over everything else, such as learner.gamma=0.95; repeatable
    #[arg(long, value_name = "KEY=VALUE", help_heading = "Configuration")]
    pub(crate) set: Vec<String>,
}

impl ConfigurationArgs {
    /// Lays the layers over each other; `build` on the result checks ranges and gives the configuration.
    pub(crate) fn layers(&self) -> anyhow::Result<ConfigBuilder> {
        let mut builder = ConfigBuilder::new().preset(&self.preset)?;
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
        for assignment in &self.set {
            builder = builder.set(assignment)?;
        }
        Ok(with_scenario(builder)?)
    }

    fn short_flags(&self) -> [(&'static str, &'static str, Option<String>); 5] {
        [
            ("--map", "env.map", self.map.clone()),
            ("--env", "env.engine", self.env.clone()),
            ("--algorithm", "policy.algorithm", self.algorithm.clone()),
            (
                "--steps",
                "run.steps_env",
                self.steps.map(|n| n.to_string()),
            ),
            ("--seed", "run.seed", self.seed.map(|n| n.to_string())),
        ]
    }
}
