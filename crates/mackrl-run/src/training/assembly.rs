//! From a configuration to the objects that it describes.

use std::sync::Arc;

use mackrl::{
    Error,
    algorithms::{Algorithm, Team},
};
use mackrl_env::{Environment, EnvironmentSpec, PriorKnowledge, WorldError};

use super::StoredWeights;
use crate::config::Config;

/// The world of a run, from which its environments are made.
#[derive(Debug, Clone)]
pub struct RunWorld {
    world: Arc<dyn mackrl_env::World>,
}

impl RunWorld {
    /// Reads the configuration's `env` section, for worlds that its kind builds.
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

/// The algorithm that a configuration describes, for a world; its team has learnt nothing. `threads` changes no result.
///
/// # Errors
/// [`Error::Config`] if the team is too large for the chosen partitions.
pub fn algorithm(
    config: &Config,
    world: &RunWorld,
    threads: usize,
) -> Result<Box<dyn Algorithm>, Error> {
    let (kind, table) = (config.algorithm.kind(), config.algorithm.table());
    with_team(config, world, threads, |team| kind.build(table, team))
}

/// As [`algorithm`], with the weights of a finished run, which are a safetensors file.
///
/// # Errors
/// As [`algorithm`], and [`Error::Data`] if the weights are not those of such a team.
pub fn trained(
    config: &Config,
    world: &RunWorld,
    weights: &[u8],
) -> Result<Box<dyn Algorithm>, Error> {
    expect_room(config, world, weights)?;
    let mut algorithm = algorithm(config, world, 1)?;
    algorithm.load(&StoredWeights(weights))?;
    Ok(algorithm)
}

/// Refuses tensors that are too few for what the configuration describes, before room is made for that.
///
/// # Errors
/// [`Error::Data`] if they are too few.
pub(super) fn expect_room(config: &Config, world: &RunWorld, tensors: &[u8]) -> Result<(), Error> {
    let expected = size(config, world)?.saturating_mul(size_of::<f32>());
    if tensors.len() >= expected {
        return Ok(());
    }
    Err(Error::Data(format!(
        "weights have {} bytes, expected more than {expected} for the team that the configuration describes",
        tensors.len()
    )))
}

/// How many parameters the models of a configuration have.
fn size(config: &Config, world: &RunWorld) -> Result<usize, Error> {
    let (kind, table) = (config.algorithm.kind(), config.algorithm.table());
    with_team(config, world, 1, |team| kind.size(table, team))
}

fn with_team<T>(
    config: &Config,
    world: &RunWorld,
    threads: usize,
    make: impl FnOnce(Team<'_>) -> T,
) -> T {
    make(Team {
        spec: world.spec(),
        prior: &world.prior(),
        seed: config.run.seed,
        threads,
    })
}

/// Bytes that no file of weights or of a checkpoint's tensors exceeds in a run that `config` describes: a file that a stranger
/// wrote needs to be read no further.
///
/// # Errors
/// As [`RunWorld::new`] and [`algorithm`].
pub fn tensors_bytes_max(config: &Config) -> Result<usize, Error> {
    const HEADER: usize = 1 << 20;
    /// Parameters, a target copy and two moments.
    const COPIES: usize = 4;
    let mut config = config.clone();
    config.env = config.env.simulated();
    let parameters = size(&config, &RunWorld::new(&config)?)?;
    Ok(parameters
        .saturating_mul(COPIES * size_of::<f32>())
        .saturating_add(HEADER))
}
