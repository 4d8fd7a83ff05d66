//! From a configuration to the objects that it describes.

use std::sync::Arc;

use mackrl::{
    Error,
    baselines::CentralV,
    central_critic::{CriticSettings, ReturnSettings},
    decentralised::Decentralised,
    hierarchy::{HierarchySettings, PairwiseMackrl},
    learner::LearnerSettings,
    nn::OptimiserKind,
};
use mackrl_env::{Environment, EnvironmentSpec, PriorKnowledge, WorldError};

use crate::config::{self, Algorithm, Config};

/// The world of a run, from which its environments are made.
#[derive(Debug, Clone)]
pub struct World {
    world: Arc<dyn mackrl_env::World>,
}

impl World {
    /// Reads the configuration's `env` section, for worlds in the built-in simulator.
    ///
    /// # Errors
    /// [`Error::Config`] if there is no such map or the world refuses a setting.
    pub fn new(config: &Config) -> Result<Self, Error> {
        Self::of(config.env.world()?)
    }

    /// A run in `world`, whatever its kind.
    ///
    /// # Errors
    /// [`Error::Config`] if its sizes are none that a world can have.
    pub fn of(world: Arc<dyn mackrl_env::World>) -> Result<Self, Error> {
        world.spec().validate().map_err(WorldError::from)?;
        Ok(Self { world })
    }

    /// What the environments are copies of.
    #[must_use]
    pub fn source(&self) -> &dyn mackrl_env::World {
        &*self.world
    }

    /// Sizes and limits.
    #[must_use]
    pub fn spec(&self) -> &EnvironmentSpec {
        self.world.spec()
    }

    /// What every agent knows before the game.
    #[must_use]
    pub fn prior(&self) -> Arc<dyn PriorKnowledge> {
        self.world.prior_knowledge()
    }

    /// `count` environments.
    #[must_use]
    pub fn environments(&self, count: usize) -> Vec<Box<dyn Environment>> {
        (0..count).map(|_| self.world.make()).collect()
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
