//! The world that is played in: a map by its name, and the settings that the map's world declares.

use mackrl_env::{
    Environment,
    matrix_game::MatrixGameSettings,
    registry::{self, MATRIX_GAME},
    skirmish::{SkirmishError, SkirmishSettings},
};
use serde::{Deserialize, Serialize};

use crate::{
    Error,
    config::{ConfigError, Origin, Setting},
};

/// The world that is played in.
///
/// Every kind of world keeps its settings, so that a preset can be used with any map: those of skirmishes have no effect in the
/// matrix game, and those of the matrix game none in skirmishes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EnvironmentConfig {
    /// Name of the world in the registry, such as `3m`; `mackrl maps` lists them.
    pub map: String,
    /// Settings of skirmishes, written beside the map: `env.move_amount`, `env.sight_range` and so on.
    #[serde(flatten)]
    pub settings: SkirmishSettings,
    /// Settings of the map `matrix-game`, in a table of their own: `env.matrix_game.common_knowledge` and so on.
    pub matrix_game: MatrixGameSettings,
}

impl Default for EnvironmentConfig {
    fn default() -> Self {
        Self {
            map: "3m".to_owned(),
            settings: SkirmishSettings::default(),
            matrix_game: MatrixGameSettings::default(),
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
        let made = if self.map == MATRIX_GAME {
            registry::make_matrix_game(self.matrix_game).map(|game| Box::new(game) as _)
        } else {
            registry::make(&self.map, &self.settings)
        };
        made.map_err(|error| Error::Config(error.to_string()))
    }

    /// The dotted keys of the maps' settings.
    pub(super) fn map_keys() -> Vec<String> {
        let skirmish = keys_of(&SkirmishSettings::default());
        let matrix_game = keys_of(&MatrixGameSettings::default());
        let skirmish = skirmish.into_iter().map(|name| format!("env.{name}"));
        let matrix_game = matrix_game.into_iter();
        skirmish
            .chain(matrix_game.map(|name| format!("env.matrix_game.{name}")))
            .collect()
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
        let p = self.matrix_game.common_knowledge;
        if !(0.0..=1.0).contains(&p) {
            let key = "env.matrix_game.common_knowledge";
            return Err(ConfigError::WrongValue {
                origin: origin_of(key),
                key: key.to_owned(),
                found: p.to_string(),
                expected: "a number in [0, 1]".to_owned(),
            });
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

/// The names of built-in settings.
fn keys_of(settings: &impl Serialize) -> Vec<String> {
    let table = toml::Table::try_from(settings).expect("built-in settings are a table");
    table.keys().cloned().collect()
}
