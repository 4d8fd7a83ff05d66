//! The world that is played in: a map by its name, and the settings that the map's world declares.

use mackrl_env::{
    Environment,
    matrix_game::{MatrixGameSettings, payoff_text},
    registry::{self, MATRIX_GAME},
    skirmish::{Skirmish, SkirmishError, SkirmishSettings, scenario},
};
use serde::{Deserialize, Serialize};

use crate::{
    Error,
    config::{ConfigError, Engine, Origin, Setting},
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
    /// Text of a scenario that is played instead of a shipped map; empty for shipped maps. It is stored, not its file's name
    /// alone, so that a run folder holds all that its result depends on.
    pub scenario: String,
    /// What plays the battles: the built-in simulator, or StarCraft II on this machine.
    pub engine: Engine,
    /// Version of StarCraft II, such as `4.10.0`; empty for the latest that is installed.
    pub game_version: String,
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
            scenario: String::new(),
            engine: Engine::Simulator,
            game_version: String::new(),
            settings: SkirmishSettings::default(),
            matrix_game: MatrixGameSettings::default(),
        }
    }
}

impl EnvironmentConfig {
    pub(super) const SETTINGS: &[Setting] = &[
        Setting {
            key: "env.map",
            documentation: "Name of the world in the registry, such as `3m`, or a scenario file ending in .toml; `mackrl maps` lists them.",
            expects: "a name that `mackrl maps` lists, or a file ending in .toml",
        },
        Setting {
            key: "env.scenario",
            documentation: "Text of a scenario that is played instead of a shipped map; filled in from the file that env.map names.",
            expects: "the text of a scenario file, as `mackrl maps --check` accepts it",
        },
        Setting {
            key: "env.engine",
            documentation: "What plays the battles: the built-in simulator, or StarCraft II on this machine.",
            expects: "`simulator` or `sc2`",
        },
        Setting {
            key: "env.game_version",
            documentation: "Version of StarCraft II, such as 4.10.0; empty for the latest that is installed.",
            expects: "a version of StarCraft II, or nothing",
        },
    ];

    /// The scenario file whose text has still to be laid into `env.scenario`, if the map is one.
    #[must_use]
    pub fn missing_scenario(&self) -> Option<&str> {
        (self.scenario.is_empty() && self.map.ends_with(".toml")).then_some(self.map.as_str())
    }

    /// Builds the world in the built-in simulator.
    ///
    /// # Errors
    /// [`Error::Config`] if the map is unknown, a setting is out of its range, or another engine is to play.
    pub fn make(&self) -> Result<Box<dyn Environment>, Error> {
        if self.engine != Engine::Simulator {
            let message = "env.engine is `sc2`, but only the built-in simulator can be used here";
            return Err(Error::Config(message.to_owned()));
        }
        if self.scenario.is_empty() && self.map == MATRIX_GAME {
            return registry::make_matrix_game(self.matrix_game)
                .map(|game| Box::new(game) as _)
                .map_err(|error| Error::Config(error.to_string()));
        }
        Ok(Box::new(self.skirmish()?))
    }

    /// Builds the world as a skirmish, whose units can be looked at.
    ///
    /// # Errors
    /// As [`EnvironmentConfig::make`], and [`Error::Config`] if the map is the matrix game, which has no units.
    pub fn skirmish(&self) -> Result<Skirmish, Error> {
        if self.scenario.is_empty() {
            registry::make_skirmish(&self.map, &self.settings)
        } else {
            registry::make_custom(&self.map, &self.scenario, &self.settings)
        }
        .map_err(|error| Error::Config(error.to_string()))
    }

    /// The data that the world is made of, as text: the map's file or the scenario, then the file of unit statistics; of the
    /// matrix game its payoffs. Other settings stand in the configuration, everything else in the code.
    #[must_use]
    pub fn data(&self) -> String {
        if !self.scenario.is_empty() {
            return self.scenario.clone() + self.settings.units.text();
        }
        match scenario::map_text(&self.map) {
            Some(map) => map.to_owned() + self.settings.units.text(),
            None => payoff_text(self.matrix_game.payoffs),
        }
    }

    /// Checks a section that was read on its own.
    ///
    /// # Errors
    /// As [`crate::config::Config::validate`], for this section.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.validate_with(|_| Origin::Unknown)
    }

    /// Checks the matrix game's settings, whose ranges hold whichever map is played.
    fn validate_matrix_game(&self, origin_of: &impl Fn(&str) -> Origin) -> Result<(), ConfigError> {
        let p = self.matrix_game.common_knowledge;
        if (0.0..=1.0).contains(&p) {
            return Ok(());
        }
        let key = "env.matrix_game.common_knowledge";
        Err(ConfigError::WrongValue {
            origin: origin_of(key),
            key: key.to_owned(),
            found: p.to_string(),
            expected: "a number in [0, 1]".to_owned(),
        })
    }

    /// Checks the map's name, or the scenario that takes its place.
    fn validate_map(&self, origin_of: &impl Fn(&str) -> Origin) -> Result<(), ConfigError> {
        if let Some(file) = self.missing_scenario() {
            return Err(ConfigError::Scenario {
                message: format!("the text of {file} is missing, expected it in env.scenario"),
            });
        }
        if self.scenario.is_empty() {
            let names = registry::names();
            return if names.contains(&self.map.as_str()) {
                Ok(())
            } else {
                let origin = origin_of("env.map");
                Err(ConfigError::unknown_map(origin, &self.map, names))
            };
        }
        registry::make_custom(&self.map, &self.scenario, &self.settings)
            .map(|_| ())
            .map_err(|error| ConfigError::Scenario {
                message: error.to_string(),
            })
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
        })?;
        self.validate_matrix_game(&origin_of)?;
        self.validate_map(&origin_of)
    }
}

/// The names of built-in settings.
fn keys_of(settings: &impl Serialize) -> Vec<String> {
    let table = toml::Table::try_from(settings).expect("built-in settings are a table");
    table.keys().cloned().collect()
}
