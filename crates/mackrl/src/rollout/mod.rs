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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use mackrl_env::{
        Action, EnvironmentSpec, EpisodeStatistics, ObservationMut, PriorKnowledge, StepError,
        Stream, TimeStep,
    };

    use super::*;
    use crate::{
        config::Config,
        training::assembly::{self, World},
    };

    /// Plays some episodes of the matrix game in 5 environments, 2 to a shard; gives the number of episodes of each shard.
    fn play(episodes: u64) -> Vec<usize> {
        let mut config = Config::default();
        config.env.map = "matrix-game".to_owned();
        config.policy.hidden = 3;
        let world = World::new(&config).unwrap();
        let policy = assembly::policy(&config, &world).unwrap();
        let weights = policy.weights(&policy.initialise(1));
        let mut rollout = Rollout::new(&*policy, world.environments(5).unwrap(), 2, 1);
        assert_eq!(rollout.environments(), 5);
        let settings = RolloutSettings {
            behaviour: Behaviour::GREEDY,
            recording: Recording::Off,
        };
        for count in [5, episodes] {
            let keys: Vec<EpisodeKey> = (0..count)
                .map(|episode| EpisodeKey::new(1, Stream::Other, episode))
                .collect();
            rollout.play(&weights, &keys, settings).unwrap();
        }
        let batches = rollout.batches();
        batches.map(|batch| batch.episodes.len()).collect()
    }

    #[test]
    fn environments_without_a_key_leave_no_episode_of_an_earlier_rollout() {
        assert_eq!(play(5), [2, 2, 1]);
        assert_eq!(play(3), [2, 1, 0]);
        assert_eq!(play(0), [0, 0, 0]);
    }

    #[test]
    #[should_panic(expected = "one environment per episode")]
    fn more_episodes_than_environments_are_refused() {
        play(6);
    }

    /// Where a world breaks.
    #[derive(Debug, Clone, Copy)]
    enum Flaw {
        Reward,
        Observation,
        Entity,
        State,
    }

    /// A battle in which one number after the third step is not finite.
    struct BrokenWorld {
        world: Box<dyn Environment>,
        flaw: Option<Flaw>,
        steps: usize,
    }

    impl Environment for BrokenWorld {
        fn spec(&self) -> &EnvironmentSpec {
            self.world.spec()
        }
        fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
            self.world.prior_knowledge()
        }
        fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) {
            self.steps = 0;
            self.world.reset(key, out);
        }
        fn step(
            &mut self,
            actions: &[Action],
            out: &mut ObservationMut<'_>,
        ) -> Result<TimeStep, StepError> {
            let mut step = self.world.step(actions, out)?;
            self.steps += 1;
            if self.steps == 3 {
                match self.flaw {
                    None => {}
                    Some(Flaw::Reward) => step.reward = f32::NEG_INFINITY,
                    Some(Flaw::Observation) => out.observation_no[30 + 7] = f32::NAN,
                    Some(Flaw::Entity) => out.entity_mf[0] = f32::INFINITY,
                    Some(Flaw::State) => out.state_g[5] = f32::NAN,
                }
            }
            Ok(step)
        }
        fn statistics(&self) -> EpisodeStatistics {
            self.world.statistics()
        }
    }

    #[test]
    fn whatever_a_world_gives_that_is_not_finite_is_named_at_once() {
        let mut config = Config::default();
        config.policy.hidden = 3;
        let world = World::new(&config).unwrap();
        assert_eq!(world.spec().observation_size, 30);
        let policy = assembly::policy(&config, &world).unwrap();
        let weights = policy.weights(&policy.initialise(1));
        let settings = RolloutSettings {
            behaviour: Behaviour::GREEDY,
            recording: Recording::Off,
        };
        let keys = [0, 1, 2, 3].map(|episode| EpisodeKey::new(1, Stream::Other, episode));
        for (flaw, expected) in [
            (Flaw::Reward, "reward is -inf at episode 3, step 2"),
            (
                Flaw::Observation,
                "observation of an agent is NaN at episode 3, step 3, agent 1, feature 7",
            ),
            (
                Flaw::Entity,
                "observation of an entity is inf at episode 3, step 3, entity 0, feature 0",
            ),
            (Flaw::State, "state is NaN at episode 3, step 3, feature 5"),
        ] {
            let worlds = world.environments(4).unwrap().into_iter().enumerate();
            let worlds = worlds.map(|(b, world)| {
                let flaw = (b == 3).then_some(flaw);
                Box::new(BrokenWorld {
                    world,
                    flaw,
                    steps: 0,
                }) as Box<dyn Environment>
            });
            let mut rollout = Rollout::new(&*policy, worlds.collect(), 2, 2);
            let found = rollout.play(&weights, &keys, settings).unwrap_err();
            assert_eq!(found.to_string(), expected);
        }
    }
}
