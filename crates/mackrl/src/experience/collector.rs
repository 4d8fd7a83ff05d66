//! Episodes of parallel environments, played shard by shard.

use std::sync::{Arc, atomic::AtomicBool};

use mackrl_env::{Environment, EpisodeKey};

use super::{Piece, PlaySettings, Shard};
use crate::{
    Error, Stopwatch,
    parallel::for_each_in_parallel,
    policy::{Parameters, Policy, Tally},
};

/// B environments, cut into shards.
#[derive(Debug)]
pub struct Collector {
    shards: Vec<Shard>,
    threads: usize,
}

impl Collector {
    /// Cuts `environments` into `shards` shards, the first of which may have one environment more than the others, and gives
    /// each an actor of `policy`. The shards are worked on by up to `threads` threads, which does not change any result; their
    /// number does, because gradients are summed shard by shard. There are never more shards than environments.
    #[must_use]
    pub fn new(
        policy: &dyn Policy,
        environments: Vec<Box<dyn Environment>>,
        shards: usize,
        threads: usize,
    ) -> Self {
        let count = shards.clamp(1, environments.len().max(1));
        let (size, larger) = (environments.len() / count, environments.len() % count);
        let mut rest = environments.into_iter();
        let shards = (0..count).map(|shard| {
            let size = size + usize::from(shard < larger);
            let environments: Vec<_> = rest.by_ref().take(size).collect();
            let actor = policy.actor(environments.len());
            Shard::new(environments, actor)
        });
        Self {
            shards: shards.collect(),
            threads,
        }
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
        parameters: &Parameters,
        keys: &[EpisodeKey],
        settings: PlaySettings,
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
            *result = shard.play(parameters, keys, settings);
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

    /// The latest experience, shard by shard, with the actors that left it.
    pub fn pieces(&mut self) -> impl Iterator<Item = &mut Piece> {
        self.shards.iter_mut().map(Shard::piece)
    }

    /// What measures the shards' time, each shard's alone.
    pub fn stopwatches(&mut self) -> impl Iterator<Item = &mut Stopwatch> {
        self.pieces().map(|piece| piece.actor.stopwatch())
    }

    /// What the actors saw in the latest episodes.
    pub fn tally(&mut self) -> Tally {
        let mut tally = Tally::default();
        self.pieces()
            .for_each(|piece| piece.actor.report(&mut tally));
        tally
    }
}
