//! Worlds of a run by its configuration: those of the simulator, or those of StarCraft II.

use std::{sync::Arc, time::Duration};

use mackrl::Error;
use mackrl_env::{Counter, Environment, EnvironmentSpec, PriorKnowledge, World};
use mackrl_run::{
    config::{Config, EnvironmentConfig},
    training::assembly,
};
use mackrl_sc2::adapter::{GamePool, GameSettings, Installation, StarCraft2, process::Launcher};
use mackrl_skirmish::{EnemyBehaviour, Scenario, SkirmishSettings, unit_types::UnitTypes};

/// Games at once where nothing else limits them.
const PARALLEL_GAMES: usize = 8;

/// The world that a run is played in.
pub(crate) fn world(config: &Config) -> Result<assembly::RunWorld, Error> {
    if !config.env.is_star_craft() {
        return assembly::RunWorld::new(config);
    }
    let environments = config.algorithm.get("environments");
    let parallel_max = environments
        .and_then(toml::Value::as_integer)
        .and_then(|count| usize::try_from(count).ok());
    let parallel_max = parallel_max.unwrap_or(PARALLEL_GAMES);
    assembly::RunWorld::of(Arc::new(StarCraftWorld::new(&config.env, parallel_max)?))
}

/// The world that `map` describes.
pub(crate) fn world_of(map: &EnvironmentConfig) -> Result<Arc<dyn World>, Error> {
    if map.is_star_craft() {
        Ok(Arc::new(StarCraftWorld::new(map, PARALLEL_GAMES)?))
    } else {
        map.world()
    }
}

/// A map of StarCraft II, in games that are started when they are needed and shared by all environments.
///
/// An environment is made anew, not copied: it holds a process.
#[derive(Debug)]
pub(super) struct StarCraftWorld {
    parallel_max: usize,
    scenario: Arc<Scenario>,
    settings: SkirmishSettings,
    data: String,
    /// Of the game.
    version: String,
    spec: EnvironmentSpec,
    prior: Arc<dyn PriorKnowledge>,
    pool: Arc<GamePool>,
}

impl StarCraftWorld {
    /// The world that `config` describes, played in by `parallel_max` environments at once. No game is started yet.
    pub(super) fn new(config: &EnvironmentConfig, parallel_max: usize) -> Result<Self, Error> {
        let (_, skirmish) = config.skirmish_settings()?;
        if skirmish.enemy_order != EnemyBehaviour::Map {
            let message = "env.enemy_order is `hunt`, expected `map`: enemies in StarCraft II follow the order of their map";
            return Err(Error::Config(message.to_owned()));
        }
        let scenario = scenario(config)?;
        let pool = Arc::new(GamePool::new(settings(config.text("game_version"))?));
        let first = StarCraft2::new(Arc::clone(&scenario), skirmish.clone(), Arc::clone(&pool))
            .map_err(|error| Error::Config(error.to_string()))?;
        Ok(Self {
            parallel_max,
            settings: skirmish,
            data: config.data(),
            version: pool.settings().installation.version(),
            spec: first.spec().clone(),
            prior: first.prior_knowledge(),
            scenario,
            pool,
        })
    }

    /// An environment, with what only StarCraft II's have.
    pub(super) fn star_craft(&self) -> StarCraft2 {
        let scenario = Arc::clone(&self.scenario);
        StarCraft2::new(scenario, self.settings.clone(), Arc::clone(&self.pool))
            .expect("the same was made when the world was built")
    }
}

impl World for StarCraftWorld {
    fn kind(&self) -> &str {
        "sc2"
    }

    fn spec(&self) -> &EnvironmentSpec {
        &self.spec
    }

    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        Arc::clone(&self.prior)
    }

    fn make(&self) -> Box<dyn Environment> {
        Box::new(self.star_craft())
    }

    fn version(&self) -> &str {
        &self.version
    }

    fn data(&self) -> &str {
        &self.data
    }

    fn parallel_max(&self) -> Option<usize> {
        Some(self.parallel_max)
    }

    fn counters(&self) -> Vec<Counter> {
        const FAULTS: [(&str, &str); 6] = [
            (
                "launch",
                "games so far that did not start or did not listen",
            ),
            (
                "version",
                "games so far that were not the version that was asked for",
            ),
            ("late", "games so far that did not answer in time"),
            ("closed", "games so far that went away"),
            ("garbage", "games so far whose answer made no sense"),
            ("refused", "games so far that refused what was asked"),
        ];
        let counts = self.pool.counts();
        let launches = Counter {
            name: "game_launches".into(),
            meaning: "processes of the game started so far".into(),
            value: counts.launches,
        };
        let faults = FAULTS.into_iter().filter_map(|(kind, meaning)| {
            let (_, count) = counts.faults.iter().find(|(name, _)| *name == kind)?;
            Some(Counter {
                name: format!("game_faults_{kind}").into(),
                meaning: meaning.into(),
                value: *count,
            })
        });
        [launches].into_iter().chain(faults).collect()
    }
}

/// The map, which has to be one of SMAC's: others have no file for the game.
pub(super) fn scenario(config: &EnvironmentConfig) -> Result<Arc<Scenario>, Error> {
    let wrong = |message: String| Error::Config(message);
    let (place, settings) = config.skirmish_settings()?;
    let units = UnitTypes::load(settings.units).map_err(|error| wrong(error.to_string()))?;
    let shipped = Scenario::shipped(&place.map, &units).filter(|_| place.scenario.is_empty());
    match shipped {
        Some(scenario) => Ok(Arc::new(
            scenario.map_err(|error| wrong(error.to_string()))?,
        )),
        None => Err(wrong(format!(
            "StarCraft II has no map for `{}`, expected one of {}",
            place.map,
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
