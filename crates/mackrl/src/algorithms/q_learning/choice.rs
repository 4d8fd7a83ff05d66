//! One agent's choice from its action values: greedy, or any available action with probability ε.

use mackrl_env::{AgentId, Draw, EpisodeKey};

use crate::{
    Real,
    policy::{Behaviour, Mode},
};

/// What one row of values says, once ε is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Choice {
    /// The best of the available actions, the lowest among equals.
    best: usize,
    /// How many are available.
    available: usize,
    /// ε; 0 in greedy play.
    exploration: f32,
}

impl Choice {
    pub(super) fn of(value_a: &[f32], available_a: &[bool], behaviour: Behaviour) -> Self {
        let exploration = match behaviour.mode {
            Mode::Greedy => 0.0,
            Mode::Sampled => behaviour.exploration,
        };
        Self {
            best: best(value_a, available_a),
            available: available_a.iter().filter(|&&available| available).count(),
            exploration,
        }
    }

    /// The action, by a number that the agent alone derives from the episode's name. The same number says whether to explore and
    /// where: below ε it is uniform still.
    pub(super) fn draw(
        self,
        available_a: &[bool],
        key: &EpisodeKey,
        step: usize,
        agent: AgentId,
    ) -> usize {
        let exploration = f64::from(self.exploration);
        if exploration <= 0.0 || self.available == 0 {
            return self.best;
        }
        let uniform = key.uniform(step, Draw::Agent(agent.index()));
        if uniform >= exploration {
            return self.best;
        }
        let count = self.available as f64;
        let available = (0..available_a.len()).filter(|&action| available_a[action]);
        let mut reached = available.zip(1..).skip_while(|&(_, place)| {
            let end = exploration * f64::from(place);
            uniform * count >= end
        });
        reached.next().map_or(self.best, |(action, _)| action)
    }

    /// The logarithms of all actions' probabilities \[A\].
    pub(super) fn log_p(self, available_a: &[bool]) -> Vec<f32> {
        let log_p = available_a.iter().enumerate().map(|(action, &available)| {
            if available {
                self.log_p_of(action)
            } else {
                f32::NEG_INFINITY
            }
        });
        log_p.collect()
    }

    /// The logarithm of the probability of an available action.
    pub(super) fn log_p_of(self, action: usize) -> f32 {
        let any = self.exploration / self.available.max(1) as f32;
        let best = if action == self.best {
            1.0 - self.exploration
        } else {
            0.0
        };
        if any + best > 0.0 {
            Real::ln(any + best)
        } else {
            f32::NEG_INFINITY
        }
    }
}

/// The best of the available actions, the lowest among equals; 0 if none is available.
pub(super) fn best<R: Real>(value_a: &[R], available_a: &[bool]) -> usize {
    let mut best: Option<usize> = None;
    for action in (0..value_a.len()).filter(|&action| available_a[action]) {
        if best.is_none_or(|best| value_a[action] > value_a[best]) {
            best = Some(action);
        }
    }
    best.unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use mackrl_env::Stream;

    use super::*;

    const AVAILABLE: [bool; 5] = [false, true, true, false, true];

    #[test]
    fn greedy_takes_the_best_available_and_ties_go_to_the_lowest() {
        let best = |value_a: [f32; 5]| best(&value_a, &AVAILABLE);
        assert_eq!(best([9.0, 1.0, 3.0, 9.0, 3.0]), 2);
        assert_eq!(best([9.0, -5.0, -6.0, 9.0, -7.0]), 1);
    }

    #[test]
    fn choices_are_as_frequent_as_they_are_said_to_be() {
        let behaviour = Behaviour::sampled(0.4);
        let choice = Choice::of(&[9.0, 0.5, 2.0, 9.0, 1.0], &AVAILABLE, behaviour);
        let key = EpisodeKey::new(5, Stream::Training, 2);
        let mut counts = [0.0; 5];
        for step in 0..10_000 {
            counts[choice.draw(&AVAILABLE, &key, step, AgentId::new(1))] += 1.0;
        }
        let log_p = choice.log_p(&AVAILABLE);
        for (count, log_p) in counts.into_iter().zip(log_p) {
            let expected = 10_000.0 * f64::from(log_p).exp();
            // Five standard deviations.
            assert!(
                (count - expected).abs() <= 5.0 * expected.sqrt(),
                "{counts:?}"
            );
        }
    }
}
