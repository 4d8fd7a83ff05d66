//! From a configuration to the objects that it describes.

use std::{fmt::Debug, sync::Arc};

use mackrl::{
    Error,
    baselines::CentralV,
    central_critic::{CriticSettings, ReturnSettings},
    decentralised::Decentralised,
    hierarchy::{HierarchySettings, PairwiseMackrl},
    learner::LearnerSettings,
    nn::OptimiserKind,
};
use mackrl_env::{Environment, EnvironmentSpec, PriorKnowledge};

use crate::config::{self, Algorithm, Config, EnvironmentConfig};

/// Where the worlds of a run come from: the built-in simulator, or something outside this library that can fail.
pub trait WorldSource: Send + Sync + Debug {
    /// Builds the world that `config` describes.
    ///
    /// # Errors
    /// [`Error::Config`] if it cannot be built.
    fn make(&self, config: &EnvironmentConfig) -> Result<Box<dyn Environment>, Error>;

    /// Worlds that may be played in at once, if that is limited.
    fn parallel_max(&self) -> Option<usize>;

    /// What the worlds have gone through so far, by names below `sys/` that [`super::METRICS`] explains.
    fn counts(&self) -> Vec<(&'static str, u64)>;
}

/// The built-in simulator, which never fails and has no limits.
#[derive(Debug, Clone, Copy, Default)]
pub struct Simulator;

impl WorldSource for Simulator {
    fn make(&self, config: &EnvironmentConfig) -> Result<Box<dyn Environment>, Error> {
        config.make()
    }

    fn parallel_max(&self) -> Option<usize> {
        None
    }

    fn counts(&self) -> Vec<(&'static str, u64)> {
        Vec::new()
    }
}

/// Builds worlds of the kind that a configuration names.
#[derive(Debug, Clone)]
pub struct World {
    source: Arc<dyn WorldSource>,
    config: EnvironmentConfig,
    spec: EnvironmentSpec,
    prior: Arc<dyn PriorKnowledge>,
}

impl World {
    /// Reads the configuration's `env` section, for worlds in the built-in simulator.
    ///
    /// # Errors
    /// [`Error::Config`] if there is no such map or the world refuses a setting.
    pub fn new(config: &Config) -> Result<Self, Error> {
        Self::from_source(config, Arc::new(Simulator))
    }

    /// Reads the configuration's `env` section, for worlds that `source` makes.
    ///
    /// # Errors
    /// [`Error::Config`] as [`WorldSource::make`].
    pub fn from_source(config: &Config, source: Arc<dyn WorldSource>) -> Result<Self, Error> {
        let environment = source.make(&config.env)?;
        let (spec, prior) = (environment.spec().clone(), environment.prior_knowledge());
        Ok(Self {
            source,
            config: config.env.clone(),
            spec,
            prior,
        })
    }

    /// Where the worlds come from.
    #[must_use]
    pub fn source(&self) -> &dyn WorldSource {
        &*self.source
    }

    /// Sizes and limits.
    #[must_use]
    pub const fn spec(&self) -> &EnvironmentSpec {
        &self.spec
    }

    /// What every agent knows before the game.
    #[must_use]
    pub fn prior(&self) -> Arc<dyn PriorKnowledge> {
        Arc::clone(&self.prior)
    }

    /// `count` worlds.
    ///
    /// # Errors
    /// [`Error::Config`] as [`World::new`].
    pub fn environments(&self, count: usize) -> Result<Vec<Box<dyn Environment>>, Error> {
        (0..count).map(|_| self.source.make(&self.config)).collect()
    }
}

/// The policy that a configuration describes, for a world.
///
/// # Errors
/// [`Error::Config`] if the team is too large for the chosen partitions.
pub fn policy(config: &Config, world: &World) -> Result<Box<dyn Decentralised>, Error> {
    let hidden = config.policy.hidden;
    match config.policy.algorithm {
        Algorithm::CentralV => Ok(Box::new(CentralV::new(world.spec(), hidden))),
        Algorithm::Mackrl => {
            let settings = HierarchySettings {
                common_knowledge: config.policy.common_knowledge,
                partitions: config.policy.partitions.into(),
                selector: config.policy.selector,
                delegation: config.policy.delegation,
                hidden,
            };
            let seed = config.run.seed;
            Ok(Box::new(PairwiseMackrl::new(
                world.spec(),
                world.prior(),
                &settings,
                seed,
            )?))
        }
    }
}

/// Bytes that no file of weights or of a checkpoint's tensors exceeds in a run that `config` describes: whoever reads one that
/// somebody else wrote needs to read no further.
///
/// # Errors
/// As [`World::new`] and [`policy`].
pub fn tensors_bytes_max(config: &Config) -> Result<usize, Error> {
    const HEADER: usize = 1 << 20;
    /// Parameters, a target copy and two moments.
    const COPIES: usize = 4;
    let mut config = config.clone();
    config.env = config.env.simulated();
    let world = World::new(&config)?;
    let critic = config.policy.hidden * (world.spec().state_size + 8);
    let parameters = policy(&config, &world)?.layout().len() + critic;
    Ok(HEADER + COPIES * parameters * size_of::<f32>())
}

/// How the learner learns.
#[must_use]
pub fn learner(config: &Config) -> LearnerSettings {
    let settings = &config.learner;
    let optimiser = match settings.optimiser {
        config::OptimiserKind::Adam => OptimiserKind::ADAM,
        config::OptimiserKind::Rmsprop => OptimiserKind::RMSPROP,
    };
    LearnerSettings {
        optimiser,
        learning_rate: settings.learning_rate,
        gradient_norm_max: settings.gradient_norm_max,
        average: config.learner.loss_average,
        critic: CriticSettings {
            hidden: config.policy.hidden,
            optimiser,
            learning_rate: settings.critic_learning_rate,
            gradient_norm_max: settings.gradient_norm_max,
            returns: ReturnSettings {
                gamma: settings.gamma,
                lambda: settings.lambda,
            },
            target_interval_updates: settings.target_interval_updates,
            bootstrap_at_time_limit: settings.bootstrap_at_time_limit,
        },
    }
}
