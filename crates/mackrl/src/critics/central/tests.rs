use mackrl_env::{EpisodeEnd, Stream};

use super::*;
use crate::experience::Episode;

const STATE_SIZE: usize = 2;

fn critic(learning_rate: f64, target_interval_updates: u64, bootstrap: bool) -> CentralCritic {
    let settings = CriticSettings {
        hidden: 5,
        optimiser: OptimiserKind::ADAM,
        learning_rate,
        gradient_norm_max: 10.0,
        returns: ReturnSettings {
            gamma: 0.9,
            lambda: 0.5,
        },
        minibatch: CriticMinibatch::Time,
        sweeps: 1,
        advantage_lambda: 0.0,
        target_interval_updates,
        bootstrap_at_time_limit: bootstrap,
    };
    CentralCritic::new(STATE_SIZE, settings, &EpisodeKey::new(1, Stream::Other, 1))
}

fn two_steps(end: EpisodeEnd) -> Episode {
    Episode {
        state_tg: vec![0.5, -1.0, 2.0, 0.3, -0.7, 1.1],
        reward_t: vec![3.0, 7.0],
        end: Some(end),
        ..Episode::default()
    }
}

/// V of the three states of an episode.
fn values(critic: &mut CentralCritic, episode: &Episode) -> [f32; 3] {
    critic.value_states(episode);
    let values = critic.trace.outputs();
    [values[0], values[1], values[2]]
}

/// With a step size that changes nothing, V is the same throughout a sweep.
#[test]
fn advantages_of_two_steps_are_those_worked_by_hand() {
    let cases = [
        (EpisodeEnd::Terminated, true, 0.0),
        (EpisodeEnd::Truncated, false, 0.0),
        (EpisodeEnd::Truncated, true, 0.9),
    ];
    for (end, bootstrap, discount_at_end) in cases {
        let mut critic = critic(1e-30, 200, bootstrap);
        let episode = two_steps(end);
        let [first, second, last] = values(&mut critic, &episode);
        let mut advantage_bt = Vec::new();
        let report = critic.learn(&[&episode], &mut advantage_bt).unwrap();
        let expected = [
            3.0 + 0.9 * second - first,
            7.0 + discount_at_end * last - second,
        ];
        for (found, expected) in advantage_bt[0].iter().zip(expected) {
            assert!((found - expected).abs() < 1e-5, "{end:?}: {advantage_bt:?}");
        }
        let return_1 = 7.0 + discount_at_end * last;
        let return_0 = 3.0 + 0.9 * (0.5 * second + 0.5 * return_1);
        let target_mean = f64::from((return_0 + return_1) / 2.0);
        assert!(
            (report.target_mean - target_mean).abs() < 1e-5,
            "{report:?}"
        );
    }
}

/// An episode of two steps makes two updates, so an interval of three has passed before the third sweep, not the second.
#[test]
fn targets_change_when_the_interval_has_passed() {
    let mut critic = critic(0.01, 3, false);
    let episode = two_steps(EpisodeEnd::Terminated);
    let mut targets = || {
        let report = critic.learn(&[&episode], &mut Vec::new()).unwrap();
        report.target_mean
    };
    let [first, second, third] = [targets(), targets(), targets()];
    assert_eq!(first, second);
    assert_ne!(second, third);
}

#[test]
fn with_a_trace_advantages_are_generalised() {
    let mut critic = critic(1e-30, 200, false);
    critic.settings.advantage_lambda = 0.5;
    let episode = two_steps(EpisodeEnd::Terminated);
    let [first, second, _] = values(&mut critic, &episode);
    let mut advantage_bt = Vec::new();
    critic.learn(&[&episode], &mut advantage_bt).unwrap();
    let last = 7.0 - second;
    let expected = [3.0 + 0.9 * second - first + 0.45 * last, last];
    for (found, expected) in advantage_bt[0].iter().zip(expected) {
        assert!((found - expected).abs() < 1e-5, "{advantage_bt:?}");
    }
}

#[test]
fn three_sweeps_are_three_times_one_sweep() {
    let episode = two_steps(EpisodeEnd::Terminated);
    let [mut at_once, mut one_by_one] = [(); 2].map(|()| critic(0.01, 3, false));
    at_once.settings.sweeps = 3;
    let mut advantages = [Vec::new(), Vec::new()];
    at_once.learn(&[&episode], &mut advantages[0]).unwrap();
    for _ in 0..3 {
        one_by_one.learn(&[&episode], &mut advantages[1]).unwrap();
    }
    assert_eq!(at_once.state(), one_by_one.state());
    assert_eq!(advantages[0], advantages[1]);
    assert_eq!(at_once.updates, 6);
}

#[test]
fn steps_on_the_whole_batch_come_before_all_advantages() {
    let episode = two_steps(EpisodeEnd::Terminated);
    let mut critic = critic(0.01, 200, false);
    critic.settings.minibatch = CriticMinibatch::Batch;
    critic.settings.sweeps = 4;
    let mut advantage_bt = Vec::new();
    let report = critic.learn(&[&episode], &mut advantage_bt).unwrap();
    assert_eq!(critic.updates, 4, "one step for all states");
    let [first, second, _] = values(&mut critic, &episode);
    assert_eq!(
        advantage_bt,
        [[3.0 + 0.9 * second - first, 7.0 - second]],
        "of the values after the last step"
    );
    let after = critic.learn(&[&episode], &mut advantage_bt).unwrap();
    assert!(after.loss < report.loss, "{after:?} {report:?}");
}
