//! StarCraft II as a kind of world: the settings of a skirmish, and which version of the game plays it.

use std::sync::Arc;

use mackrl_env::{
    World, WorldError, WorldKind, declare_settings,
    settings::{Accepts, Setting, Settings},
};
use mackrl_skirmish::SkirmishKind;

/// The name by which configurations call this kind.
pub const STAR_CRAFT: &str = "sc2";

declare_settings! {
    /// Which game plays.
    pub struct GameSettings {
        /// Version of StarCraft II, such as 4.10.0; empty for the latest that is installed.
        game_version: String = String::new(), Accepts::Text { expects: "a version of StarCraft II, or nothing", pattern: None };
    }
}

/// StarCraft II itself, or a server that stands in for it, on SMAC's maps.
///
/// Its settings are those of skirmishes and `game_version`. It is built by the program that starts the game, not here.
#[derive(Debug, Clone, Copy, Default)]
pub struct StarCraftKind;

impl WorldKind for StarCraftKind {
    fn name(&self) -> &str {
        STAR_CRAFT
    }

    fn summary(&self) -> &str {
        "StarCraft II on this machine, on SMAC's maps"
    }

    fn settings(&self) -> Vec<Setting> {
        let mut settings = SkirmishKind.settings();
        settings.extend(GameSettings::SETTINGS);
        settings
    }

    fn defaults(&self) -> toml::Table {
        let mut defaults = SkirmishKind.defaults();
        defaults.extend(GameSettings::defaults());
        defaults
    }

    fn build(&self, _table: &toml::Table) -> Result<Arc<dyn World>, WorldError> {
        let message = "env.name is `sc2`, but only the built-in simulator can be used here";
        Err(WorldError::Unavailable(message.to_owned()))
    }
}
