//! Which weights of a run did best in its tests, and how the best and the last ones play in the end.
//!
//! A test that decides which weights are the best says too much of them: the highest of many noisy numbers is partly luck. So the
//! best weights are judged once more, in episodes that neither training nor tests have seen (the *absolute metric* of Colas,
//! Sigaud and Oudeyer, "GEP-PG", 2018, and of Gorsane and others, "Towards a Standardised Performance Evaluation Protocol for
//! Cooperative MARL", 2022), and the last weights in the same ones. They are the first episodes of `mackrl evaluate`, so
//! anybody can play them again.

use serde::{Deserialize, Serialize};

use super::Evaluation;

/// How many times the episodes of a test the final judgement has, as Gorsane and others ask for.
const TIMES_A_TEST: usize = 10;
/// Episodes that are enough for a judgement, unless a test has more.
const ENOUGH: usize = 320;
/// Standard errors by which teams have to differ to be told apart: a 95 % interval.
const APART: f64 = 1.96;

/// How some weights did in greedy episodes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Score {
    /// Environment steps of training that the weights had seen.
    pub steps_env: u64,
    /// Mean over the episodes of the world's success, or of the return where a world declares none.
    pub mean: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Episodes that were played.
    pub episodes: usize,
}

/// What the weights of a run reach at its end, in episodes that neither training nor tests have seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Teams {
    /// What was measured: the name of the world's success, or `return`.
    pub measure: String,
    /// The weights at the end.
    pub last: Score,
    /// Those that did best in a test: the absolute metric. Runs that began with a version that did not keep them may have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub best: Option<Score>,
}

/// The weights that did best in a test so far.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Best {
    /// How they did.
    pub(super) test: Score,
    /// The file, with its description.
    pub(super) weights: Vec<u8>,
}

impl Score {
    /// Of an evaluation of weights that had seen so many steps.
    #[must_use]
    pub fn of(evaluation: &Evaluation, steps_env: u64) -> Self {
        let [mean, standard_error] = evaluation
            .quantities
            .first()
            .map_or([0.0; 2], |first| [first.mean, first.standard_error]);
        Self {
            steps_env,
            mean,
            standard_error,
            episodes: evaluation.episodes,
        }
    }

    /// Whether weights with this score take the place of those with the score `best`. Among equals the later ones are taken: where
    /// every battle of a test is won, they have learnt the longest.
    pub(super) fn replaces(&self, best: Option<&Self>) -> bool {
        best.is_none_or(|best| self.mean >= best.mean)
    }

    /// Whether this is higher than `other` by more than chance: by 1.96 standard errors of the difference.
    #[must_use]
    pub fn is_ahead_of(&self, other: &Self) -> bool {
        self.mean - other.mean > APART * self.standard_error.hypot(other.standard_error)
    }
}

impl Teams {
    /// The best weights' score, if they are others than the last and better by more than chance.
    #[must_use]
    pub fn better(&self) -> Option<&Score> {
        self.best
            .as_ref()
            .filter(|best| best.is_ahead_of(&self.last))
    }
}

/// Episodes of the final judgement of a run whose tests have `test` episodes: ten times as many, but no more than are enough unless
/// a test has more.
pub(super) fn episodes_of_judgement(test: usize) -> usize {
    test.saturating_mul(TIMES_A_TEST).min(ENOUGH).max(test)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn score(mean: f64, standard_error: f64) -> Score {
        Score {
            steps_env: 7,
            mean,
            standard_error,
            episodes: 320,
        }
    }

    #[test]
    fn the_later_of_equals_is_the_best() {
        let best = score(0.5, 0.1);
        assert!(score(0.0, 0.0).replaces(None));
        assert!(score(0.5, 0.0).replaces(Some(&best)));
        assert!(!score(0.499, 0.0).replaces(Some(&best)));
    }

    #[test]
    fn better_means_by_more_than_chance() {
        let teams = |best: Score, last: Score| Teams {
            measure: "battle_won".to_owned(),
            last,
            best: Some(best),
        };
        assert_eq!(teams(score(0.96, 0.01), score(0.95, 0.01)).better(), None);
        assert_eq!(teams(score(1.0, 0.0), score(1.0, 0.0)).better(), None);
        let ahead = teams(score(0.98, 0.01), score(0.90, 0.02));
        assert_eq!(ahead.better(), Some(&score(0.98, 0.01)));
        let alone = Teams {
            best: None,
            ..ahead
        };
        assert_eq!(alone.better(), None);
    }

    #[test]
    fn a_judgement_has_ten_times_the_episodes_of_a_test_up_to_enough() {
        assert_eq!(
            [1, 24, 32, 100, 320, 1000].map(episodes_of_judgement),
            [10, 240, 320, 320, 320, 1000]
        );
    }
}
