//! One run: initial logits, gradient ascent, and what is measured at its end.

use mackrl_env::{Draw, EpisodeKey, matrix_game::CommonKnowledge};

use super::{
    game::TabularGame,
    policy::{Learner, Logits, PARAMETERS, Policy, expected_return, expected_return_and_gradient},
};
use crate::nn::{Optimiser, OptimiserKind};

/// Step size of Adam.
pub const LEARNING_RATE: f64 = 0.05;
/// Updates of a run. The published code makes 202 and logs every second one: its last entry holds the return before the 201st
/// update and the greedy return after it, so the 202nd is never seen and not made here.
pub const UPDATES: usize = 201;
/// The published code multiplies logits by 100 to act greedily.
const GREEDY_TEMPERATURE: f64 = 0.01;

/// What one run reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Exact expected return of the policy itself before the last update.
    pub train: f64,
    /// Exact expected return of the nearly greedy policy (all logits times 100) after the last update.
    pub test: f64,
    /// Probability of delegation after the last update in each state of common knowledge, in the order of
    /// [`CommonKnowledge::ALL`].
    pub delegation: [f64; 3],
}

/// Trains `learner` on `game` for [`UPDATES`] exact gradient steps, from logits drawn from N(0, 1).
///
/// `key` and `step` name the draws: two learners with the same key and step start from the same logits.
#[must_use]
pub fn train(game: &TabularGame, learner: Learner, key: EpisodeKey, step: usize) -> Run {
    let mut logits = Logits(std::array::from_fn(|i| key.normal(step, Draw::Setup(i))));
    let mut adam = Optimiser::new(OptimiserKind::ADAM, PARAMETERS);
    let mut train = 0.0;
    for _ in 0..UPDATES {
        let policy = Policy::new(learner, &logits, 1.0);
        let (value, gradient) = expected_return_and_gradient(game, &policy);
        train = value;
        // The optimiser descends: on the negative return.
        let gradient = gradient.map(|g| -g);
        adam.step(LEARNING_RATE, &gradient, &mut logits.0);
    }
    let policy = Policy::new(learner, &logits, 1.0);
    let greedy = Policy::new(learner, &logits, GREEDY_TEMPERATURE);
    Run {
        train,
        test: expected_return(game, &greedy),
        delegation: CommonKnowledge::ALL.map(|state| policy.delegation(state)),
    }
}

#[cfg(test)]
mod tests {
    use mackrl_env::{
        Stream,
        matrix_game::{ObservationDistribution, Payoffs},
    };

    use super::*;

    fn run(learner: Learner, p: f64, episode: u64) -> Run {
        let game = TabularGame::new(Payoffs::Coded, ObservationDistribution::Y2018, p).unwrap();
        train(
            &game,
            learner,
            EpisodeKey::new(1, Stream::Other, episode),
            0,
        )
    }

    #[test]
    fn a_run_is_a_function_of_its_key() {
        assert_eq!(run(Learner::Mackrl, 0.5, 3), run(Learner::Mackrl, 0.5, 3));
        assert_ne!(run(Learner::Mackrl, 0.5, 3), run(Learner::Mackrl, 0.5, 4));
    }

    #[test]
    fn joint_action_learning_reaches_its_optimum_from_any_start() {
        for episode in 0..5 {
            for p in [0.0, 0.5, 1.0] {
                let run = run(Learner::Jal, p, episode);
                assert!((run.test - (0.5 + 0.5 * p)).abs() < 1e-9, "{p}: {run:?}");
                assert!(
                    run.train < run.test,
                    "the stochastic policy is above the optimum"
                );
            }
        }
    }

    #[test]
    fn delegation_falls_where_the_matrix_is_commonly_known() {
        let run = run(Learner::Mackrl, 0.5, 0);
        let [nothing, matrix_a, matrix_b] = run.delegation;
        assert!(nothing > 0.9, "{run:?}");
        assert!(matrix_a < 0.05 && matrix_b < 0.05, "{run:?}");
    }
}
