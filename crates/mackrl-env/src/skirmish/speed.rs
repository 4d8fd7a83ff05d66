//! How fast an environment steps.

use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::{Action, AgentId, Environment, EpisodeKey, Observations, Stream};

/// Steps and the time that they took.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Speed {
    /// Environment steps played, episode starts not counted.
    pub steps: u64,
    /// Episodes begun.
    pub episodes: u64,
    /// Seconds that all of it took.
    pub seconds: f64,
}

impl Speed {
    /// Environment steps in a second.
    #[must_use]
    pub fn steps_per_second(&self) -> f64 {
        self.steps as f64 / self.seconds
    }
}

/// Plays `environment` with random available actions for about `duration`, with observations, state and availability
/// written at every step, on the calling thread.
///
/// # Panics
/// If the environment refuses an action that it offered, against its contract.
pub fn measure_speed(environment: &mut dyn Environment, duration: Duration) -> Speed {
    let spec = environment.spec().clone();
    let mut observations = Observations::new(&spec, 1);
    let mut actions = vec![Action::default(); spec.agents];
    let mut dice = Dice(0x9E37_79B9_7F4A_7C15);
    let (mut steps, mut episodes) = (0, 0);
    let start = Instant::now();
    while start.elapsed() < duration {
        environment.reset(
            EpisodeKey::new(1, Stream::Other, episodes),
            &mut observations.row_mut(0),
        );
        episodes += 1;
        loop {
            for (agent, action) in actions.iter_mut().enumerate() {
                let view = observations.local_view(0, AgentId::new(agent));
                *action = Action::new(dice.pick(view.available()));
            }
            let time_step = environment
                .step(&actions, &mut observations.row_mut(0))
                .expect("only available actions are picked");
            steps += 1;
            if time_step.end.is_some() {
                break;
            }
        }
    }
    Speed {
        steps,
        episodes,
        seconds: start.elapsed().as_secs_f64(),
    }
}

/// A fast generator (xorshift64) for actions that only keep an environment busy.
struct Dice(u64);

impl Dice {
    fn pick(&mut self, available: &[bool]) -> usize {
        let count = available
            .iter()
            .filter(|is_available| **is_available)
            .count() as u64;
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        let mut left = ((self.0 >> 32) * count) >> 32;
        for (action, _) in available
            .iter()
            .enumerate()
            .filter(|(_, is_available)| **is_available)
        {
            if left == 0 {
                return action;
            }
            left -= 1;
        }
        0
    }
}
