//! Every place in which a number of an update can be infinite or NaN, once, and the promise that such an update leaves nothing.

use mackrl_env::Action;

use super::*;
use crate::{
    baselines::CentralV,
    central_critic::ReturnSettings,
    config::Config,
    policy::{Actor, Behaviour, ControllerInput, Recording, Situation, Tally},
    rollout::{Rollout, RolloutSettings},
};

/// An actor whose gradient holds `number` at `index`, and whose log-likelihood is `objective`.
struct Broken {
    index: usize,
    number: f32,
    objective: f64,
    stopwatch: Stopwatch,
}

impl Actor for Broken {
    fn begin(&mut self, _: Recording) {}
    fn act(&mut self, _: &Weights, _: Situation<'_>, _: &mut [Action]) -> Result<(), NotFinite> {
        Ok(())
    }
    fn backward(&mut self, _: &Weights, _: &[Vec<f32>], gradient: &mut [f32]) -> f64 {
        gradient[self.index] = self.number;
        self.objective
    }
    fn report(&self, _: &mut Tally) {}
    fn controller_inputs(&self, _: usize) -> Vec<ControllerInput> {
        Vec::new()
    }
    fn stopwatch(&mut self) -> &mut Stopwatch {
        &mut self.stopwatch
    }
}

fn settings() -> LearnerSettings {
    LearnerSettings {
        optimiser: OptimiserKind::ADAM,
        learning_rate: 1e-3,
        gradient_norm_max: 10.0,
        average: LossAverage::Steps,
        critic: CriticSettings {
            hidden: 5,
            optimiser: OptimiserKind::ADAM,
            learning_rate: 1e-3,
            gradient_norm_max: 10.0,
            returns: ReturnSettings {
                gamma: 0.99,
                lambda: 0.8,
            },
            target_interval_updates: 1,
            bootstrap_at_time_limit: false,
        },
    }
}

/// A learner on the built-in map, two episodes, and what has been learnt from them once.
struct Subject {
    policy: CentralV,
    learner: Learner,
    rollout: Rollout,
    before: LearnerState,
}

impl Subject {
    fn new(settings: LearnerSettings) -> Self {
        Self::playing(settings, [0, 1])
    }

    fn playing(settings: LearnerSettings, episodes: [u64; 2]) -> Self {
        let environment = || Config::default().env.make().unwrap();
        let spec = environment().spec().clone();
        let policy = CentralV::new(&spec, 5);
        let learner = Learner::new(&policy, [spec.agents, spec.state_size], settings, 1, 1);
        let mut rollout = Rollout::new(&policy, vec![environment(), environment()], 2, 1);
        let keys = episodes.map(|episode| EpisodeKey::new(1, Stream::Training, episode));
        let behaviour = RolloutSettings {
            behaviour: Behaviour::sampled(0.5),
            recording: Recording::ForLearning,
        };
        rollout.play(learner.weights(), &keys, behaviour).unwrap();
        Self {
            before: learner.state(),
            policy,
            learner,
            rollout,
        }
    }

    fn update(&mut self) -> Result<UpdateReport, NotFinite> {
        let batches = self.rollout.batches().collect();
        let stopwatch = &mut Stopwatch::default();
        self.learner.update(&self.policy, batches, stopwatch)
    }

    /// An update in which the actor's gradient holds `number` at its last place.
    fn update_with_gradient(&mut self, number: f32, objective: f64) -> NotFinite {
        let mut broken = ShardBatch {
            episodes: self.rollout.batches().next().unwrap().episodes.clone(),
            actor: Box::new(Broken {
                index: self.learner.parameters().len() - 1,
                number,
                objective,
                stopwatch: Stopwatch::default(),
            }),
        };
        let stopwatch = &mut Stopwatch::default();
        let update = self
            .learner
            .update(&self.policy, vec![&mut broken], stopwatch);
        update.unwrap_err()
    }

    /// The message of an update of episodes with something planted in them.
    fn refused(mut self, plant: impl FnOnce(&mut Episode)) -> String {
        let batch = self.rollout.batches().next().unwrap();
        let sound = batch.episodes.clone();
        plant(&mut batch.episodes[1]);
        let broken = self.update().unwrap_err();
        self.rollout.batches().next().unwrap().episodes = sound;
        self.expect_unharmed();
        broken.to_string()
    }

    /// Nothing has changed, and a sound update is the same to the bit as that of a learner that met no broken one.
    fn expect_unharmed(mut self) {
        assert!(self.learner.state() == self.before, "something has changed");
        let mut twin = Self::new(self.learner.settings);
        // A step that is too large is too large for the twin as well.
        assert_eq!(self.update(), twin.update());
        assert!(self.learner.state() == twin.learner.state());
    }
}

/// The place of the last number of the state before step 7.
fn late_state(episode: &mut Episode) -> &mut f32 {
    let size = episode.state(0).len();
    &mut episode.state_tg[7 * size + size - 1]
}

#[test]
fn rewards_and_states_that_are_not_finite_are_met_by_the_critic() {
    let subject = || Subject::new(settings());
    let longest = subject().rollout.batches().next().unwrap().episodes[1].steps() - 1;
    assert_eq!(
        subject().refused(|episode| episode.reward_t[longest] = f32::NAN),
        format!("critic.λ-return is NaN at episode 1, step {longest}")
    );
    let found = subject().refused(|episode| *late_state(episode) = f32::INFINITY);
    assert_eq!(found, "critic.value is NaN at episode 1, step 7");
}

#[test]
fn values_of_the_critic_that_are_not_finite_are_named() {
    // The target copy still is finite where the critic is not: states of 1e38 times weights that have grown.
    let mut subject = Subject::new(settings());
    subject.before.critic.parameters.fill(1e3);
    subject.before.critic.updates_at_refresh = subject.before.critic.updates;
    subject
        .learner
        .restore(&subject.policy, subject.before.clone());
    let batch = subject.rollout.batches().next().unwrap();
    *late_state(&mut batch.episodes[1]) = 1e36;
    let found = subject.update().unwrap_err().to_string();
    assert_eq!(found, "critic.value is inf at episode 1, step 7");
    assert!(subject.learner.state() == subject.before);
}

#[test]
fn gradients_moments_and_parameters_of_the_critic_are_named() {
    let found = Subject::new(settings()).refused(|episode| *late_state(episode) = 1e25);
    assert!(found.starts_with("gradient of critic."), "{found}");
    let mut long = settings();
    long.critic.gradient_norm_max = 1e30;
    let found = Subject::new(long).refused(|episode| *late_state(episode) = 1e13);
    assert!(found.starts_with("second moment of critic."), "{found}");
    let mut far = settings();
    far.critic.learning_rate = 1e38;
    let mut subject = Subject::new(far);
    let found = subject.update().unwrap_err().to_string();
    assert!(found.starts_with("after the step, critic."), "{found}");
    subject.expect_unharmed();
}

#[test]
fn gradients_moments_and_parameters_of_the_policy_are_named_and_the_critic_keeps_nothing() {
    for (number, expected) in [(f32::NAN, "NaN"), (f32::NEG_INFINITY, "-inf")] {
        let mut subject = Subject::new(settings());
        let found = subject.update_with_gradient(number, 0.0).to_string();
        let expected =
            format!("gradient of agent_controller.output.bias is {expected} at output 8");
        assert_eq!(found, expected);
        subject.expect_unharmed();
    }
    let mut long = settings();
    long.gradient_norm_max = 1e30;
    let mut subject = Subject::new(long);
    let found = subject.update_with_gradient(1e25, 0.0).to_string();
    assert_eq!(
        found,
        "second moment of agent_controller.output.bias is inf at output 8"
    );
    subject.expect_unharmed();
    let mut far = settings();
    far.learning_rate = 1e38;
    let mut subject = Subject::new(far);
    let found = subject.update().unwrap_err().to_string();
    assert!(
        found.starts_with("after the step, agent_controller."),
        "{found}"
    );
    subject.expect_unharmed();
}

#[test]
fn a_log_likelihood_and_advantages_that_are_not_finite_are_named() {
    let mut subject = Subject::new(settings());
    let found = subject.update_with_gradient(0.1, f64::NAN).to_string();
    assert_eq!(found, "sum of A log p(u) is NaN");
    subject.expect_unharmed();
    let found = check_advantages(&[vec![0.5; 3], vec![0.5, f32::NEG_INFINITY]]);
    assert_eq!(
        found.unwrap_err().to_string(),
        "advantage is -inf at episode 1, step 1"
    );
}

#[test]
fn a_logit_that_is_not_finite_is_named_before_anybody_acts() {
    let mut subject = Subject::new(settings());
    let mut state = subject.before.clone();
    state.parameters[0] = f32::NAN;
    subject.learner.restore(&subject.policy, state);
    let keys = [0, 1].map(|episode| EpisodeKey::new(1, Stream::Training, episode));
    let greedy = RolloutSettings {
        behaviour: Behaviour::GREEDY,
        recording: Recording::Off,
    };
    let played = subject
        .rollout
        .play(subject.learner.weights(), &keys, greedy);
    assert_eq!(
        played.unwrap_err().to_string(),
        "logits of agent_controller is NaN at episode 0, step 0, agent 0, column 0"
    );
}

#[test]
fn the_average_decides_what_steps_count_for_and_nothing_else() {
    let [steps, slots] = [LossAverage::Steps, LossAverage::Slots].map(|average| {
        let settings = LearnerSettings {
            average,
            ..settings()
        };
        let mut subject = Subject::playing(settings, [0, 2]);
        let batch = subject.rollout.batches().next().unwrap();
        let lengths: Vec<usize> = batch.episodes.iter().map(Episode::steps).collect();
        assert_ne!(lengths[0], lengths[1], "episodes of one length count alike");
        subject.update().unwrap()
    });
    assert_ne!(steps.policy_gradient_norm, slots.policy_gradient_norm);
    assert_eq!(steps.critic, slots.critic);
    assert_eq!(steps.advantage_mean, slots.advantage_mean);
}
