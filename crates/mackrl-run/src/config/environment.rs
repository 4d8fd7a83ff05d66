//! The world that is played in: a map by its name, and the settings that the map's world declares.

use std::sync::Arc;

use mackrl::Error;
use mackrl_env::{
    World,
    matrix_game::{MATRIX_GAME, MatrixGameKind, MatrixGameSettings, payoff_text},
    settings::Accepts,
};
use mackrl_skirmish::{PlaceSettings, Skirmish, SkirmishSettings};
use serde::{Deserialize, Serialize};

use crate::config::{ConfigError, Engine, Origin, Setting, settings::in_section};

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

/// Names of all worlds, in the order in which they are listed to users: the maps of battles, then the matrix game.
#[must_use]
pub fn world_names() -> Vec<&'static str> {
    let mut names = mackrl_skirmish::map_names();
    names.push(MATRIX_GAME);
    names
}

impl EnvironmentConfig {
    /// Its own settings, then those of the worlds.
    pub(super) fn settings() -> Vec<Setting> {
        let own = [
            Setting {
                key: "env.map".to_owned(),
                meaning: "Name of the world, or a scenario file ending in .toml.",
                accepts: Accepts::Text {
                    expects: "a name that `mackrl maps` lists, or a file ending in .toml",
                    pattern: None,
                },
            },
            Setting {
                key: "env.scenario".to_owned(),
                meaning: "Text of a scenario that is played instead of a shipped map; filled in from the file that env.map names.",
                accepts: Accepts::Text {
                    expects: "the text of a scenario file, as `mackrl maps --check` accepts it",
                    pattern: None,
                },
            },
            Setting {
                key: "env.engine".to_owned(),
                meaning: "What plays the battles: the built-in simulator, or StarCraft II on this machine.",
                accepts: Accepts::OneOf(&["simulator", "sc2"]),
            },
            Setting {
                key: "env.game_version".to_owned(),
                meaning: "Version of StarCraft II, such as 4.10.0; empty for the latest that is installed.",
                accepts: Accepts::Text {
                    expects: "a version of StarCraft II, or nothing",
                    pattern: None,
                },
            },
        ];
        own.into_iter()
            .chain(in_section("env", SkirmishSettings::SETTINGS))
            .chain(in_section("env.matrix_game", MatrixGameSettings::SETTINGS))
            .collect()
    }

    /// The scenario file whose text has still to be laid into `env.scenario`, if the map is one.
    #[must_use]
    pub fn missing_scenario(&self) -> Option<&str> {
        (self.scenario.is_empty() && self.map.ends_with(".toml")).then_some(self.map.as_str())
    }

    /// Whether the world is the matrix game, not a skirmish.
    #[must_use]
    pub fn is_matrix_game(&self) -> bool {
        self.scenario.is_empty() && self.map == MATRIX_GAME
    }

    /// The same world, played by the built-in simulator: its sizes are those of the game's.
    #[must_use]
    pub fn simulated(&self) -> Self {
        Self {
            engine: Engine::Simulator,
            ..self.clone()
        }
    }

    /// Builds the world in the built-in simulator.
    ///
    /// # Errors
    /// [`Error::Config`] if the map is unknown, a setting is out of its range, or another engine is to play.
    pub fn world(&self) -> Result<Arc<dyn World>, Error> {
        if self.engine != Engine::Simulator {
            let message = "env.engine is `sc2`, but only the built-in simulator can be used here";
            return Err(Error::Config(message.to_owned()));
        }
        let world = if self.is_matrix_game() {
            MatrixGameKind::world(self.matrix_game)
        } else {
            self.place().world(&self.settings)
        };
        Ok(world?)
    }

    /// Where a skirmish is played.
    fn place(&self) -> PlaceSettings {
        PlaceSettings {
            map: self.map.clone(),
            scenario: self.scenario.clone(),
        }
    }

    /// Builds the world as a skirmish, whose units can be looked at.
    ///
    /// # Errors
    /// As [`EnvironmentConfig::world`], and [`Error::Config`] if the map is the matrix game, which has no units.
    pub fn skirmish(&self) -> Result<Skirmish, Error> {
        if self.scenario.is_empty() {
            mackrl_skirmish::make(&self.map, &self.settings)
        } else {
            mackrl_skirmish::make_custom(&self.map, &self.scenario, &self.settings)
        }
        .map_err(|error| Error::Config(error.to_string()))
    }

    /// The data that the world is made of, as text: the map's file or the scenario, then the file of unit statistics; of the
    /// matrix game its payoffs. Other settings stand in the configuration, everything else in the code.
    #[must_use]
    pub fn data(&self) -> String {
        if self.is_matrix_game() {
            payoff_text(self.matrix_game.payoffs)
        } else {
            self.place().data(&self.settings)
        }
    }

    /// Checks a section that was read on its own.
    ///
    /// # Errors
    /// As [`crate::config::Config::validate`], for this section.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.validate_with(|_| Origin::Unknown)
    }

    /// Checks the map's name, or the scenario that takes its place.
    fn validate_map(&self, origin_of: &impl Fn(&str) -> Origin) -> Result<(), ConfigError> {
        if let Some(file) = self.missing_scenario() {
            return Err(ConfigError::Scenario {
                message: format!("the text of {file} is missing, expected it in env.scenario"),
            });
        }
        if self.scenario.is_empty() {
            let names = world_names();
            return if names.contains(&self.map.as_str()) {
                Ok(())
            } else {
                let origin = origin_of("env.map");
                Err(ConfigError::unknown_map(origin, &self.map, names))
            };
        }
        mackrl_skirmish::make_custom(&self.map, &self.scenario, &self.settings)
            .map(|_| ())
            .map_err(|error| ConfigError::Scenario {
                message: error.to_string(),
            })
    }

    /// Checks the map's name and the ranges of its settings.
    pub(super) fn validate_with(
        &self,
        origin_of: impl Fn(&str) -> Origin,
    ) -> Result<(), ConfigError> {
        for (section, violation) in [
            ("env", self.settings.violation()),
            ("env.matrix_game", self.matrix_game.violation()),
        ] {
            if let Some(violation) = violation {
                return Err(ConfigError::violation(section, violation, origin_of));
            }
        }
        self.validate_ranges(&origin_of)?;
        self.validate_map(&origin_of)
    }

    fn validate_ranges(&self, origin_of: &impl Fn(&str) -> Origin) -> Result<(), ConfigError> {
        if self.settings.aims_within_sight() {
            return Ok(());
        }
        let SkirmishSettings {
            shoot_range: shoot,
            sight_range: sight,
            ..
        } = self.settings;
        Err(ConfigError::at_odds(
            origin_of,
            (
                "env.shoot_range",
                format!("{shoot:?}"),
                format!(
                    "less than {sight:?}, which is env.sight_range: agents can only aim at what they see"
                ),
            ),
            (
                "env.sight_range",
                format!("{sight:?}"),
                format!(
                    "more than {shoot:?}, which is env.shoot_range: agents can only aim at what they see"
                ),
            ),
        ))
    }
}
