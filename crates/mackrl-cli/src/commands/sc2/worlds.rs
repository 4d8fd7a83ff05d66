//! Worlds of a run by its configuration: those of the simulator, or those of StarCraft II.

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use mackrl::Error;
use mackrl_env::Environment;
use mackrl_run::{
    config::{Config, Engine, EnvironmentConfig},
    training::assembly::{Simulator, World, WorldSource},
};
use mackrl_sc2::adapter::{GamePool, GameSettings, Installation, StarCraft2, process::Launcher};
use mackrl_skirmish::{EnemyBehaviour, Scenario, unit_types::UnitTypes};

/// Games at once where nothing else limits them.
const PARALLEL_GAMES: usize = 8;

/// The worlds that a run is played in.
pub(crate) fn world(config: &Config) -> Result<World, Error> {
    let source: Arc<dyn WorldSource> = match config.env.engine {
        Engine::Simulator => Arc::new(Simulator),
        Engine::Sc2 => Arc::new(StarCraftWorlds {
            parallel_max: config.learner.environments,
            ..StarCraftWorlds::default()
        }),
    };
    World::from_source(config, source)
}

/// Where the worlds that `map` describes come from.
pub(crate) fn worlds(map: &EnvironmentConfig) -> Box<dyn WorldSource> {
    match map.engine {
        Engine::Simulator => Box::new(Simulator),
        Engine::Sc2 => Box::new(StarCraftWorlds::default()),
    }
}

/// Maps of StarCraft II, in games that are started when they are needed and shared by all worlds.
#[derive(Debug)]
pub(super) struct StarCraftWorlds {
    parallel_max: usize,
    pool: Mutex<Option<Arc<GamePool>>>,
}

impl Default for StarCraftWorlds {
    fn default() -> Self {
        Self {
            parallel_max: PARALLEL_GAMES,
            pool: Mutex::default(),
        }
    }
}

impl StarCraftWorlds {
    /// One world, with what only StarCraft II's have.
    pub(super) fn star_craft(&self, config: &EnvironmentConfig) -> Result<StarCraft2, Error> {
        if config.settings.enemy_order != EnemyBehaviour::Map {
            let message = "env.enemy_order is `hunt`, expected `map`: enemies in StarCraft II follow the order of their map";
            return Err(Error::Config(message.to_owned()));
        }
        let scenario = scenario(config)?;
        let wrong = |error: &dyn std::error::Error| Error::Config(error.to_string());
        StarCraft2::new(scenario, config.settings.clone(), self.pool(config)?)
            .map_err(|error| wrong(&error))
    }

    fn pool(&self, config: &EnvironmentConfig) -> Result<Arc<GamePool>, Error> {
        let mut pool = self.pool.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pool) = &*pool {
            return Ok(Arc::clone(pool));
        }
        let made = Arc::new(GamePool::new(settings(&config.game_version)?));
        *pool = Some(Arc::clone(&made));
        Ok(made)
    }
}

impl WorldSource for StarCraftWorlds {
    fn make(&self, config: &EnvironmentConfig) -> Result<Box<dyn Environment>, Error> {
        Ok(Box::new(self.star_craft(config)?))
    }

    fn parallel_max(&self) -> Option<usize> {
        Some(self.parallel_max)
    }

    fn counts(&self) -> Vec<(&'static str, u64)> {
        let pool = self.pool.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(counts) = pool.as_ref().map(|pool| pool.counts()) else {
            return Vec::new();
        };
        let names = [
            "sys/game_faults_launch",
            "sys/game_faults_version",
            "sys/game_faults_late",
            "sys/game_faults_closed",
            "sys/game_faults_garbage",
            "sys/game_faults_refused",
        ];
        let faults = names.into_iter().filter_map(|name| {
            let fault = counts.faults.iter().find(|(kind, _)| name.ends_with(kind));
            fault.map(|(_, count)| (name, *count))
        });
        [("sys/game_launches", counts.launches)]
            .into_iter()
            .chain(faults)
            .collect()
    }
}

/// The map, which has to be one of SMAC's: others have no file for the game.
pub(super) fn scenario(config: &EnvironmentConfig) -> Result<Arc<Scenario>, Error> {
    let wrong = |message: String| Error::Config(message);
    let units = UnitTypes::load(config.settings.units).map_err(|error| wrong(error.to_string()))?;
    let shipped = Scenario::shipped(&config.map, &units).filter(|_| config.scenario.is_empty());
    match shipped {
        Some(scenario) => Ok(Arc::new(
            scenario.map_err(|error| wrong(error.to_string()))?,
        )),
        None => Err(wrong(format!(
            "StarCraft II has no map for `{}`, expected one of {}",
            config.map,
            mackrl_skirmish::map_names().join(", ")
        ))),
    }
}

/// How games are started here.
pub(super) fn settings(version: &str) -> Result<GameSettings, Error> {
    let wanted = Some(version).filter(|version| !version.is_empty());
    let installation = Installation::find(&Installation::default_root(), wanted)
        .map_err(|problem| Error::Config(format!("{problem}; try: {}", problem.remedy())))?;
    let launcher = Launcher::this_program()
        .map_err(|error| Error::Config(format!("cannot find this program: {error}")))?;
    Ok(GameSettings {
        installation,
        launcher,
        launch_patience: Duration::from_secs_f64(number("MACKRL_SC2_START_PATIENCE_S", 120.0)?),
        patience: Duration::from_secs_f64(number("MACKRL_SC2_PATIENCE_S", 60.0)?),
        failures_max: failures_max(number("MACKRL_SC2_FAILURES", 10.0)?),
    })
}

/// A number in (0, 1e6] from an environment variable.
fn number(name: &str, usual: f64) -> Result<f64, Error> {
    let Ok(text) = std::env::var(name) else {
        return Ok(usual);
    };
    let number = text
        .parse()
        .ok()
        .filter(|number| *number > 0.0 && *number <= 1e6);
    number
        .ok_or_else(|| Error::Config(format!("{name} is {text:?}, expected a number in (0, 1e6]")))
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a positive number of at most a million"
)]
fn failures_max(number: f64) -> u32 {
    number.ceil() as u32
}
