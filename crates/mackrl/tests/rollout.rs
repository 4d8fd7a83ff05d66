//! What a rollout leaves, and what it refuses.

use std::sync::Arc;

use mackrl::{
    policy::{Behaviour, Recording},
    rollout::{Rollout, RolloutSettings},
};
use mackrl_env::{
    Action, Environment, EnvironmentSpec, EpisodeKey, ObservationMut, PriorKnowledge, StepError,
    Stream, TimeStep,
};
use mackrl_run::{
    config::Config,
    training::assembly::{self, World},
};

/// Plays some episodes of the matrix game in 5 environments, 2 to a shard; gives the number of episodes of each shard.
fn play(episodes: u64) -> Vec<usize> {
    let config = Config::with(&["env.name=matrix-game", "algorithm.hidden=3"]).unwrap();
    let world = World::new(&config).unwrap();
    let policy = assembly::policy(&config, &world).unwrap();
    let weights = policy.weights(&policy.initialise(1));
    let mut rollout = Rollout::new(&*policy, world.environments(5), 2, 1);
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
    fn statistics(&self, statistics_s: &mut [f64]) {
        self.world.statistics(statistics_s);
    }
}

#[test]
fn whatever_a_world_gives_that_is_not_finite_is_named_at_once() {
    let config = Config::with(&["algorithm.hidden=3"]).unwrap();
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
        let worlds = world.environments(4).into_iter().enumerate();
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
