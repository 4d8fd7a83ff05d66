//! A configuration: the world, the algorithm, and the settings of the run itself.

use mackrl::algorithms::AlgorithmKind;
use mackrl_env::{
    declare_settings,
    settings::{self, Accepts, EXACT},
};
use serde::Serialize;

use crate::config::{
    ConfigBuilder, ConfigError, EnvironmentConfig, Kind, Origin, Registry, Selected, builder,
};

/// An algorithm, and the value of each of its settings.
pub type AlgorithmConfig = Selected<dyn AlgorithmKind>;

/// Everything that determines the result of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Config {
    /// The world.
    pub env: EnvironmentConfig,
    /// What learns, and how.
    pub algorithm: AlgorithmConfig,
    /// Greedy tests during training.
    pub test: TestConfig,
    /// Length, seed, and what is written when.
    pub run: RunConfig,
}

impl Default for Config {
    /// The built-in values of the built-in kinds.
    fn default() -> Self {
        let registry = Registry::built_in();
        Self {
            env: registry.default_environment(),
            algorithm: registry.default_algorithm(),
            test: TestConfig::default(),
            run: RunConfig::default(),
        }
    }
}

declare_settings! {
    /// Greedy tests during training.
    pub struct TestConfig {
        /// Environment steps between two tests.
        interval_steps_env: u64 = 10_000, Accepts::integer(1, EXACT);
        /// Episodes of a test.
        episodes: usize = 32, Accepts::integer(1, 1_000_000);
    }
}

declare_settings! {
    /// Length and seed of a run, and what is written when.
    pub struct RunConfig {
        /// Environment steps after which training ends; the batch that reaches it is finished.
        steps_env: u64 = 1_000_000, Accepts::integer(1, EXACT);
        /// Environment steps between two rows of training metrics; tests give rows of their own.
        metrics_interval_steps_env: u64 = 2_000, Accepts::integer(1, EXACT);
        /// Environment steps between two checkpoints; one more is written at the end. Changes no result.
        checkpoint_interval_steps_env: u64 = 200_000, Accepts::integer(1, EXACT);
        /// Checkpoints that stay in the run folder; older ones are removed. Changes no result.
        checkpoints_kept: usize = 2, Accepts::integer(1, 1000);
        /// Environment steps between two weights that stay in the run folder, beside the last and the best; 0: none. Changes no result.
        weights_interval_steps_env: u64 = 0, Accepts::integer(0, EXACT);
        /// Whether a TensorBoard event file is written beside metrics.jsonl, with the same names. Changes no result.
        tensorboard: bool = false, Accepts::Flag;
        /// Seed from which every random draw of the run is derived; known to all agents.
        seed: u64 = 1, Accepts::integer(0, EXACT);
        /// SHA-256 of the weights that the team begins with, which `mackrl train --from` takes from another run. Without it, the team has learnt nothing.
        #[serde(skip_serializing_if = "String::is_empty")]
        initial_weights: String = String::new(), Accepts::Text {
            expects: "the SHA-256 of a file of weights",
            pattern: Some("^([0-9a-f]{64})?$"),
        };
    }
}

/// A setting as it is explained to users.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Dotted key, such as `algorithm.gamma`.
    pub key: String,
    /// What it means, with its unit.
    pub meaning: &'static str,
    /// Which values it takes, in words that follow "expected".
    pub accepts: Accepts,
}

impl Setting {
    /// The setting that names a kind.
    pub(super) fn name_of<K: Kind + ?Sized>() -> Self {
        let (meaning, expects) = match K::SECTION {
            "env" => (
                "Kind of the world; which other settings `env` has depends on it.",
                "the name of a kind of world",
            ),
            _ => (
                "What learns; which other settings `algorithm` has depends on it.",
                "the name of an algorithm",
            ),
        };
        Self {
            key: format!("{}.name", K::SECTION),
            meaning,
            accepts: Accepts::Text {
                expects,
                pattern: None,
            },
        }
    }
}

/// Settings under the keys that they have in a section.
pub(super) fn in_section(
    section: &str,
    declared: impl IntoIterator<Item = settings::Setting>,
) -> impl Iterator<Item = Setting> {
    let section = section.to_owned();
    declared.into_iter().map(move |declared| Setting {
        key: format!("{section}.{}", declared.name),
        meaning: declared.meaning,
        accepts: declared.accepts,
    })
}

/// The settings that every run has.
pub(super) fn run_settings() -> impl Iterator<Item = Setting> {
    let of = |section, settings: &'static [settings::Setting]| {
        in_section(section, settings.iter().copied())
    };
    of("test", TestConfig::SETTINGS).chain(of("run", RunConfig::SETTINGS))
}

impl Config {
    /// The built-in configuration with each `key=value` laid over it.
    ///
    /// # Errors
    /// As [`ConfigBuilder::set`] and [`ConfigBuilder::build`].
    pub fn with(assignments: &[&str]) -> Result<Self, ConfigError> {
        let builder = ConfigBuilder::new(&Registry::built_in());
        let mut assignments = assignments.iter();
        let builder = assignments.try_fold(builder, |builder, one| builder.set(one))?;
        builder.build()
    }

    /// Every setting that this configuration has, with its meaning and the values that it takes, in the order of the file.
    #[must_use]
    pub fn settings(&self) -> Vec<Setting> {
        fn of<K: Kind + ?Sized>(selected: &Selected<K>) -> Vec<Setting> {
            let mut settings = vec![Setting::name_of::<K>()];
            settings.extend(in_section(K::SECTION, selected.kind.declared()));
            settings
        }
        let named = of(&self.env).into_iter().chain(of(&self.algorithm));
        named.chain(run_settings()).collect()
    }

    /// The keys of all its settings, in the order of the file.
    pub fn keys(&self) -> impl Iterator<Item = String> {
        self.settings().into_iter().map(|setting| setting.key)
    }

    /// Checks ranges and combinations.
    ///
    /// # Errors
    /// [`ConfigError`] with the first setting that is out of its range, or does not go with another or with the world.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let mut checked = self.clone();
        builder::check(&mut checked, &|_| Origin::Unknown).map(|_| ())
    }

    /// The value at a dotted key, if it is set.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<toml::Value> {
        let (section, name) = key.split_once('.')?;
        match (section, name) {
            ("env", "name") => Some(self.env.name().into()),
            ("algorithm", "name") => Some(self.algorithm.name().into()),
            ("env", name) => self.env.get(name).cloned(),
            ("algorithm", name) => self.algorithm.get(name).cloned(),
            // A file has it only where it says something.
            ("run", "initial_weights") => Some(self.run.initial_weights.as_str().into()),
            ("test", name) => toml::Table::try_from(&self.test).ok()?.get(name).cloned(),
            ("run", name) => toml::Table::try_from(&self.run).ok()?.get(name).cloned(),
            _ => None,
        }
    }

    /// The same settings as a table, in the order of declaration.
    ///
    /// # Panics
    /// If an integer is beyond 2⁶³, which [`Config::validate`] refuses.
    #[must_use]
    pub fn to_table(&self) -> toml::Table {
        let text = self.to_toml();
        toml::from_str(&text).expect("what was written can be read")
    }

    /// The same settings as TOML, in the order of declaration.
    ///
    /// # Panics
    /// If an integer is beyond 2⁶³, which [`Config::validate`] refuses.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a valid configuration can be written")
    }
}
