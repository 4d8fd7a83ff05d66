//! Episodes of parallel environments, stored once for the learner.
//!
//! Work is cut into shards whose number depends on the number of environments alone, never on the number of threads.
//! Shards share nothing that is written, and whatever is summed over them is summed in their order, so a run gives the
//! same bytes on one thread and on eight.

mod episode;
mod shard;

use std::sync::{Arc, atomic::AtomicBool};

use mackrl_env::{Environment, EpisodeKey};

pub use episode::Episode;
pub use shard::{Shard, ShardBatch};

use crate::{
    Error, Stopwatch,
    parallel::for_each_in_parallel,
    policy::{Behaviour, Policy, Recording, Tally, Weights},
};

/// How a batch of episodes is played.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RolloutSettings {
    /// How choices are made.
    pub behaviour: Behaviour,
    /// Whether the episodes will be learnt from.
    pub recording: Recording,
}

/// B environments, cut into shards.
#[derive(Debug)]
pub struct Rollout {
    shards: Vec<Shard>,
    threads: usize,
}

impl Rollout {
    /// Cuts `environments` into shards of at most `shard_size` and gives each an actor of `policy`. The shards are worked
    /// on by up to `threads` threads, which does not change any result.
    ///
    /// # Panics
    /// If `shard_size` is 0.
    #[must_use]
    pub fn new(
        policy: &dyn Policy,
        environments: Vec<Box<dyn Environment>>,
        shard_size: usize,
        threads: usize,
    ) -> Self {
        assert!(shard_size > 0, "a shard has at least one environment");
        let mut shards = Vec::new();
        let mut rest = environments.into_iter().peekable();
        while rest.peek().is_some() {
            let environments: Vec<_> = rest.by_ref().take(shard_size).collect();
            let actor = policy.actor(environments.len());
            shards.push(Shard::new(environments, actor));
        }
        Self { shards, threads }
    }

    /// Gives up playing, between two steps, as soon as `stop` is set.
    pub fn stop_when(&mut self, stop: &Arc<AtomicBool>) {
        self.shards
            .iter_mut()
            .for_each(|shard| shard.stop_when(stop));
    }

    /// B: the number of episodes that are played at once.
    #[must_use]
    pub fn environments(&self) -> usize {
        self.shards.iter().map(Shard::environments).sum()
    }

    /// Plays the episodes named `keys`, at most B, to their ends.
    ///
    /// # Errors
    /// If an environment refuses an action, or a number is not finite, or [`Error::Stopped`]; the first shard's error is given.
    ///
    /// # Panics
    /// If there are more keys than environments.
    pub fn play(
        &mut self,
        weights: &Weights,
        keys: &[EpisodeKey],
        settings: RolloutSettings,
    ) -> Result<(), Error> {
        assert!(
            keys.len() <= self.environments(),
            "one environment per episode"
        );
        let mut rest = keys;
        let mut work: Vec<_> = self
            .shards
            .iter_mut()
            .map(|shard| {
                let (own, others) = rest.split_at(shard.environments().min(rest.len()));
                rest = others;
                (shard, own, Ok(()))
            })
            .collect();
        for_each_in_parallel(self.threads, &mut work, |(shard, keys, result)| {
            *result = shard.play(weights, keys, settings);
        });
        let mut before = 0;
        for (_, keys, result) in work {
            result.map_err(|error| match error {
                Error::NotFinite(broken) => broken.shifted("episode", before).into(),
                other => other,
            })?;
            before += keys.len();
        }
        Ok(())
    }

    /// Episodes so far that were played in vain because a world failed.
    #[must_use]
    pub fn discarded(&self) -> u64 {
        self.shards.iter().map(Shard::discarded).sum()
    }

    /// The latest episodes, shard by shard, with the actors that played them.
    pub fn batches(&mut self) -> impl Iterator<Item = &mut ShardBatch> {
        self.shards.iter_mut().map(Shard::batch)
    }

    /// What measures the shards' time, each shard's alone.
    pub fn stopwatches(&mut self) -> impl Iterator<Item = &mut Stopwatch> {
        self.batches().map(|batch| batch.actor.stopwatch())
    }

    /// What the actors saw in the latest episodes.
    pub fn tally(&mut self) -> Tally {
        let mut tally = Tally::default();
        self.batches()
            .for_each(|batch| batch.actor.report(&mut tally));
        tally
    }
}
