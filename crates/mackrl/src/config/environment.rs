//! The world that is played in: a map by its name, and the settings that the map's world declares.

use mackrl_env::{
    Environment, registry,
    skirmish::{SkirmishError, SkirmishSettings},
};
use serde::{Deserialize, Serialize};

use crate::{
    Error,
    config::{ConfigError, Origin, Setting},
};

/// The world that is played in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EnvironmentConfig {
    /// Name of the world in the registry, such as `3m`; `mackrl maps` lists them.
    pub map: String,
    /// Settings of skirmishes, written beside the map: `env.move_amount`, `env.sight_range` and so on.
    #[serde(flatten)]
    pub settings: SkirmishSettings,
}

impl Default for EnvironmentConfig {
    fn default() -> Self {
        Self {
            map: "3m".to_owned(),
            settings: SkirmishSettings::default(),
        }
    }
}

impl EnvironmentConfig {
    pub(super) const SETTINGS: &[Setting] = &[Setting {
        key: "env.map",
        documentation: "Name of the world in the registry, such as `3m`; `mackrl maps` lists them.",
        expects: "a name that `mackrl maps` lists",
    }];

    /// Builds the world.
    ///
    /// # Errors
    /// [`Error::Config`] if the map is unknown or a setting is out of its range.
    pub fn make(&self) -> Result<Box<dyn Environment>, Error> {
        registry::make(&self.map, &self.settings).map_err(|error| Error::Config(error.to_string()))
    }

    /// The dotted keys of the map's settings.
    pub(super) fn map_keys() -> Vec<String> {
        let settings = toml::Table::try_from(SkirmishSettings::default())
            .expect("built-in settings are a table");
        settings.keys().map(|name| format!("env.{name}")).collect()
    }

    /// Checks the map's name and the ranges of its settings.
    pub(super) fn validate_with(
        &self,
        origin_of: impl Fn(&str) -> Origin,
    ) -> Result<(), ConfigError> {
        let names = registry::names();
        if !names.contains(&self.map.as_str()) {
            return Err(ConfigError::unknown_map(
                origin_of("env.map"),
                &self.map,
                names,
            ));
        }
        self.settings.validate().map_err(|error| match error {
            SkirmishError::Setting {
                key,
                found,
                expected,
            } => ConfigError::WrongValue {
                origin: origin_of(&format!("env.{key}")),
                key: format!("env.{key}"),
                found,
                expected: format!("a value {expected}"),
            },
            other => ConfigError::Syntax {
                origin: origin_of("env.map"),
                message: other.to_string(),
            },
        })
    }
}
