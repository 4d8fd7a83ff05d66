//! The world that is played in, as a configuration names it.

use std::{ffi::OsStr, path::Path, sync::Arc};

use mackrl::Error;
use mackrl_env::{World, WorldKind};
use mackrl_skirmish::{PlaceSettings, SKIRMISH, Skirmish, SkirmishKind, SkirmishSettings};

use crate::config::{
    ConfigError, Origin, STAR_CRAFT, Selected,
    builder::{check_environment, world_error},
};

/// A kind of world, and the value of each of its settings.
pub type EnvironmentConfig = Selected<dyn WorldKind>;

impl EnvironmentConfig {
    /// How the world is called among others: its map, or its kind if that has no maps.
    #[must_use]
    pub fn map(&self) -> &str {
        match self.text("map") {
            "" => self.name(),
            map => map,
        }
    }

    /// The scenario file whose text has still to be laid into `env.scenario`, if the map is one.
    #[must_use]
    pub fn missing_scenario(&self) -> Option<&str> {
        let map = self.text("map");
        let takes_text = self.get("scenario").is_some() && self.text("scenario").is_empty();
        (takes_text && map.ends_with(".toml")).then_some(map)
    }

    /// Whether StarCraft II plays it, and not the built-in simulator.
    #[must_use]
    pub fn is_star_craft(&self) -> bool {
        self.name() == STAR_CRAFT
    }

    /// The same world, played by the built-in simulator if StarCraft II plays it: its sizes are those of the game's.
    #[must_use]
    pub fn simulated(&self) -> Self {
        if !self.is_star_craft() {
            return self.clone();
        }
        let mut simulated = Self::new(Arc::new(SkirmishKind));
        for (name, value) in &mut simulated.table {
            if let Some(chosen) = self.table.get(name) {
                value.clone_from(chosen);
            }
        }
        simulated
    }

    /// The same world, with a scenario's file by its name alone, without the folders around it.
    #[must_use]
    pub fn without_folder(&self) -> Self {
        let mut env = self.clone();
        if !env.text("scenario").is_empty()
            && let Some(name) = Path::new(self.map()).file_name().and_then(OsStr::to_str)
        {
            env.table.insert("map".to_owned(), name.into());
        }
        env
    }

    /// Builds the world.
    ///
    /// # Errors
    /// [`Error::Config`] if its kind refuses a setting, or another program than this one is to play.
    pub fn world(&self) -> Result<Arc<dyn World>, Error> {
        let built = self.kind.build(&self.table);
        built.map_err(|error| world_error(error, &|_| Origin::Unknown).into())
    }

    /// Where a skirmish is played, and how.
    ///
    /// # Errors
    /// [`Error::Config`] if the world is no skirmish.
    pub fn skirmish_settings(&self) -> Result<(PlaceSettings, SkirmishSettings), Error> {
        let simulated = self.simulated();
        if simulated.name() != SKIRMISH {
            return Err(Error::Config(format!(
                "`{}` has no units to look at, expected a map of battles",
                self.map()
            )));
        }
        SkirmishKind::read(&simulated.table).map_err(|error| Error::Config(error.to_string()))
    }

    /// Builds the world as a skirmish in the built-in simulator, whose units can be looked at.
    ///
    /// # Errors
    /// As [`EnvironmentConfig::world`], and [`Error::Config`] if the world is no skirmish.
    pub fn skirmish(&self) -> Result<Skirmish, Error> {
        let (place, settings) = self.skirmish_settings()?;
        let built = place.skirmish(&settings);
        built.map_err(|error| world_error(error, &|_| Origin::Unknown).into())
    }

    /// The data that the world is made of, as text: a map's file or the scenario, then the file of unit statistics; of the
    /// matrix game its payoffs. Other settings stand in the configuration, everything else in the code. Empty for a world that
    /// cannot be built.
    #[must_use]
    pub fn data(&self) -> String {
        let world = self.simulated().world();
        world.map_or_else(|_| String::new(), |world| world.data().to_owned())
    }

    /// Checks a section that was read on its own.
    ///
    /// # Errors
    /// As [`crate::config::Config::validate`], for this section.
    pub fn validate(&self) -> Result<(), ConfigError> {
        check_environment(self, |_| Origin::Unknown).map(|_| ())
    }
}
