//! Greedy episodes with fixed weights.

use std::sync::{Arc, atomic::AtomicBool};

use mackrl::{
    Error,
    policy::{Behaviour, Policy, Recording, Tally, Weights},
    rollout::{Rollout, RolloutSettings},
    statistics::mean_and_standard_error,
};
use mackrl_env::{EpisodeKey, Stream};
use serde::{Deserialize, Serialize};

use super::{assembly, read_weights};
use crate::config::Config;

/// Episodes that are played at once.
const PARALLEL_EPISODES: usize = 32;
/// Environments of a shard.
const SHARD_SIZE: usize = 8;

/// How a team plays: means over episodes, each with its standard error.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Episodes played.
    pub episodes: usize,
    /// Share of episodes that were won.
    pub test_battle_won_mean: f64,
    /// Its standard error.
    pub test_battle_won_sem: f64,
    /// Undiscounted return.
    pub test_return_mean: f64,
    /// Its standard error.
    pub test_return_sem: f64,
    /// Length in environment steps.
    pub test_ep_length_mean: f64,
    /// Its standard error.
    pub test_ep_length_sem: f64,
    /// Agents lost.
    pub test_dead_allies_mean: f64,
    /// Its standard error.
    pub test_dead_allies_sem: f64,
    /// Enemies defeated.
    pub test_dead_enemies_mean: f64,
    /// Its standard error.
    pub test_dead_enemies_sem: f64,
    /// What the controllers did, under the names that `METRICS` explains.
    #[serde(flatten)]
    pub controllers: std::collections::BTreeMap<String, f64>,
}

/// Plays `episodes` greedy episodes with the weights of a safetensors file. `threads` changes no result.
///
/// # Errors
/// [`Error::Config`] or [`Error::Data`] if configuration and weights cannot be used together.
pub fn evaluate(
    config: &Config,
    weights: &[u8],
    episodes: usize,
    seed: u64,
    threads: usize,
) -> Result<Evaluation, Error> {
    evaluate_in(
        &assembly::World::new(config)?,
        config,
        weights,
        Episodes {
            count: episodes,
            seed,
        },
        threads,
    )
}

/// Which episodes are played.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Episodes {
    /// How many.
    pub count: usize,
    /// The seed that names them.
    pub seed: u64,
}

/// As [`evaluate`], in a world that need not be the built-in simulator's.
///
/// # Errors
/// As [`evaluate`], and [`Error::Step`] if the world cannot be played in any more.
pub fn evaluate_in(
    world: &assembly::World,
    config: &Config,
    weights: &[u8],
    episodes: Episodes,
    threads: usize,
) -> Result<Evaluation, Error> {
    let policy = assembly::policy(config, world)?;
    let parameters = read_weights(policy.layout(), weights)?;
    let mut evaluator = Evaluator::new(&*policy, world, episodes.count, threads)?;
    let weights = policy.weights(&parameters);
    evaluator.play(&weights, episodes.count, |episode| {
        EpisodeKey::new(episodes.seed, Stream::Evaluation, episode)
    })
}

/// Environments in which greedy episodes are played.
#[derive(Debug)]
pub(super) struct Evaluator {
    rollout: Rollout,
}

impl Evaluator {
    /// Room for playing some of `episodes` episodes at once.
    pub(super) fn new(
        policy: &dyn Policy,
        world: &assembly::World,
        episodes: usize,
        threads: usize,
    ) -> Result<Self, Error> {
        let parallel_max = world.source().parallel_max().unwrap_or(PARALLEL_EPISODES);
        let environments = world.environments(episodes.clamp(1, parallel_max.max(1)))?;
        Ok(Self {
            rollout: Rollout::new(policy, environments, SHARD_SIZE, threads),
        })
    }

    /// Gives up playing as soon as `stop` is set.
    pub(super) fn stop_when(&mut self, stop: &Arc<AtomicBool>) {
        self.rollout.stop_when(stop);
    }

    /// Episodes that were played in vain because a world failed.
    pub(super) fn discarded(&self) -> u64 {
        self.rollout.discarded()
    }

    /// Plays `episodes` greedy episodes, of which number `i` is named `key(i)`.
    pub(super) fn play(
        &mut self,
        weights: &Weights,
        episodes: usize,
        key: impl Fn(u64) -> EpisodeKey,
    ) -> Result<Evaluation, Error> {
        let settings = RolloutSettings {
            behaviour: Behaviour::GREEDY,
            recording: Recording::Off,
        };
        let mut samples: [Vec<f64>; 5] = Default::default();
        let mut tally = Tally::default();
        let keys: Vec<EpisodeKey> = (0..episodes as u64).map(key).collect();
        for keys in keys.chunks(self.rollout.environments()) {
            self.rollout.play(weights, keys, settings)?;
            tally.merge(&self.rollout.tally());
            for episode in self.rollout.batches().flat_map(|batch| &batch.episodes) {
                let statistics = episode.statistics;
                let numbers = [
                    f64::from(u8::from(statistics.battle_won)),
                    episode.total_reward(),
                    episode.steps() as f64,
                    statistics.dead_allies as f64,
                    statistics.dead_enemies as f64,
                ];
                samples
                    .iter_mut()
                    .zip(numbers)
                    .for_each(|(sample, number)| sample.push(number));
            }
        }
        let [won, return_, length, dead_allies, dead_enemies] =
            samples.map(|sample| mean_and_standard_error(&sample));
        Ok(Evaluation {
            episodes,
            test_battle_won_mean: won.0,
            test_battle_won_sem: won.1,
            test_return_mean: return_.0,
            test_return_sem: return_.1,
            test_ep_length_mean: length.0,
            test_ep_length_sem: length.1,
            test_dead_allies_mean: dead_allies.0,
            test_dead_allies_sem: dead_allies.1,
            test_dead_enemies_mean: dead_enemies.0,
            test_dead_enemies_sem: dead_enemies.1,
            controllers: tally
                .means()
                .map(|(name, mean)| (name.to_owned(), mean))
                .collect(),
        })
    }
}
