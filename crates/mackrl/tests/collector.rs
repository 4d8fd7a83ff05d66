//! What a collector leaves, and what it refuses.

mod support;

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use mackrl::{
    Error,
    experience::{Collector, PlaySettings},
    policy::{Behaviour, Parameters, Recording},
};
use mackrl_env::{
    Action, Environment, EnvironmentSpec, EpisodeKey, Interruption, ObservationMut, PriorKnowledge,
    StepError, Stream, TimeStep,
};
use support::team::{FOR_LEARNING, Team, keys};

const GREEDY: PlaySettings = PlaySettings {
    behaviour: Behaviour::GREEDY,
    recording: Recording::Off,
};

/// Plays some episodes of the matrix game in 5 environments, in 3 shards; gives the number of episodes of each shard.
fn play(episodes: u64) -> Vec<usize> {
    let team = Team::mackrl(&["env.name=matrix-game"], "hidden = 3");
    let parameters = Parameters::new(team.initialise());
    let mut collector = team.collector(5, 3);
    assert_eq!(collector.environments(), 5, "environments");
    for count in [5, episodes] {
        collector
            .play(&parameters, &keys(count), GREEDY)
            .expect("actors choose available actions");
    }
    let pieces = collector.pieces();
    pieces
        .map(|piece| piece.experience.episodes.len())
        .collect()
}

#[test]
fn environments_without_a_key_leave_no_episode_of_an_earlier_batch() {
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
    let team = Team::mackrl(&["env.map=3m"], "hidden = 3");
    assert_eq!(team.world.spec().observation_size, 30);
    let parameters = Parameters::new(team.initialise());
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
        let worlds = team.world.environments(4).into_iter().enumerate();
        let worlds = worlds.map(|(b, world)| {
            let flaw = (b == 3).then_some(flaw);
            Box::new(BrokenWorld {
                world,
                flaw,
                steps: 0,
            }) as Box<dyn Environment>
        });
        let mut collector = Collector::new(&team.hierarchy, worlds.collect(), 2, 2);
        let found = collector.play(&parameters, &keys, GREEDY).unwrap_err();
        assert_eq!(found.to_string(), expected);
    }
}

/// A battle whose game fails at the third step of its first `failures` episodes.
struct FailingWorld {
    world: Box<dyn Environment>,
    failures: usize,
    can_be_repeated: bool,
    begun: Arc<AtomicUsize>,
    steps: usize,
}

impl Environment for FailingWorld {
    fn spec(&self) -> &EnvironmentSpec {
        self.world.spec()
    }
    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        self.world.prior_knowledge()
    }
    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) {
        self.steps = 0;
        self.begun.fetch_add(1, Ordering::Relaxed);
        self.world.reset(key, out);
    }
    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError> {
        self.steps += 1;
        if self.steps == 3 && self.begun.load(Ordering::Relaxed) <= self.failures {
            return Err(Interruption {
                reason: "the game has gone".to_owned(),
                can_be_repeated: self.can_be_repeated,
            }
            .into());
        }
        self.world.step(actions, out)
    }
    fn statistics(&self, statistics_s: &mut [f64]) {
        self.world.statistics(statistics_s);
    }
}

/// A collector of three battles, one of which fails so many times, and how often that one was begun.
fn failing(team: &Team, failures: usize, can_be_repeated: bool) -> (Collector, Arc<AtomicUsize>) {
    let begun = Arc::new(AtomicUsize::new(0));
    let mut worlds = team.world.environments(3);
    let failing = FailingWorld {
        world: worlds.remove(1),
        failures,
        can_be_repeated,
        begun: Arc::clone(&begun),
        steps: 0,
    };
    worlds.insert(1, Box::new(failing));
    (Collector::new(&team.hierarchy, worlds, 1, 1), begun)
}

#[test]
fn episodes_under_which_a_world_fails_are_played_again_as_if_nothing_had_happened() {
    let team = Team::mackrl(&["env.map=3m"], "hidden = 3");
    let parameters = Parameters::new(team.initialise());
    let play = |failures| {
        let (mut collector, _) = failing(&team, failures, true);
        let played = collector.play(&parameters, &keys(3), FOR_LEARNING);
        played.expect("the world comes back");
        let discarded = collector.discarded();
        let piece = collector.pieces().next().expect("one shard");
        (piece.experience.clone(), discarded)
    };
    let (sound, discarded) = play(0);
    assert_eq!(discarded, 0);
    let (repeated, discarded) = play(4);
    assert_eq!(discarded, 4 * 3);
    assert!(repeated == sound, "something of a failed attempt is kept");
}

#[test]
fn a_world_that_fails_for_ever_or_cannot_come_back_ends_the_run() {
    let team = Team::mackrl(&["env.map=3m"], "hidden = 3");
    let parameters = Parameters::new(team.initialise());
    for (can_be_repeated, attempts) in [(true, 100), (false, 1)] {
        let (mut collector, begun) = failing(&team, usize::MAX, can_be_repeated);
        let error = collector.play(&parameters, &keys(3), FOR_LEARNING);
        let Err(Error::Step(StepError::Interrupted(interruption))) = error else {
            panic!("expected an interruption, found {error:?}");
        };
        assert_eq!(interruption.reason, "the game has gone");
        assert_eq!(begun.load(Ordering::Relaxed), attempts);
    }
}
