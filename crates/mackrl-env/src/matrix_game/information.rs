//! Who sees what: the chance moves of the game and what each agent makes of them.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{AGENTS, Matrix};
use crate::declare_words;

/// A probability outside [0, 1].
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("the probability of common knowledge is {0}, expected a number in [0, 1]")]
pub struct InvalidProbability(pub f64);

declare_words! {
    /// How the chance of seeing the matrix depends on p, the number on the horizontal axis of Figure 5.
    pub enum ObservationDistribution {
        /// The 2018 paper: the bit is on with probability p; without it each agent sees the matrix with probability 1/2. Private
        /// knowledge grows with p too: an agent sees the matrix with probability (1 + p)/2.
        #[default]
        Y2018 = "2018",
        /// The NeurIPS 2019 version: every agent sees the matrix with probability 3/4 whatever p is; p is the share of that which
        /// the bit causes. The bit is on with probability 3p/4; without it an agent sees the matrix with probability
        /// (3/4)(1 − p)/(1 − 3p/4).
        NeurIps2019 = "neurips",
    }
}

/// What chance has dealt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct DealtCards {
    /// The common-knowledge bit.
    pub bit: bool,
    /// The game that is played.
    pub matrix: Matrix,
    /// Whether each agent sees the matrix; true for both if the bit is on.
    pub sees_matrix: [bool; AGENTS],
}

/// One deal and its probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deal {
    /// What is dealt.
    pub cards: DealtCards,
    /// How often, in (0, 1].
    pub probability: f64,
}

/// What both agents know, and know to know: the input of a pair controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CommonKnowledge {
    /// The bit is off: nothing but the rules is common knowledge.
    Nothing,
    /// The bit is on and the matrix is A.
    MatrixA,
    /// The bit is on and the matrix is B.
    MatrixB,
}

/// What one agent knows. An agent can always tell whether its knowledge is common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Observation {
    /// The bit is on and the matrix is A.
    CommonA,
    /// The bit is on and the matrix is B.
    CommonB,
    /// The bit is off and the matrix is hidden.
    Nothing,
    /// The bit is off and the agent happens to see matrix A.
    PrivateA,
    /// The bit is off and the agent happens to see matrix B.
    PrivateB,
}

impl CommonKnowledge {
    /// All three, in the order of their [`index`](Self::index).
    pub const ALL: [Self; 3] = [Self::Nothing, Self::MatrixA, Self::MatrixB];

    /// Position in arrays over states of common knowledge.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }
}

impl Observation {
    /// Number of observations.
    pub const COUNT: usize = 5;

    /// Position in arrays over observations.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }
}

impl DealtCards {
    /// What is common knowledge between the agents.
    #[must_use]
    pub const fn common_knowledge(&self) -> CommonKnowledge {
        match (self.bit, self.matrix) {
            (false, _) => CommonKnowledge::Nothing,
            (true, Matrix::A) => CommonKnowledge::MatrixA,
            (true, Matrix::B) => CommonKnowledge::MatrixB,
        }
    }

    /// What the agent with index `agent` observes.
    ///
    /// # Panics
    /// If there is no such agent.
    #[must_use]
    pub const fn observation(&self, agent: usize) -> Observation {
        match (self.bit, self.sees_matrix[agent], self.matrix) {
            (true, _, Matrix::A) => Observation::CommonA,
            (true, _, Matrix::B) => Observation::CommonB,
            (false, false, _) => Observation::Nothing,
            (false, true, Matrix::A) => Observation::PrivateA,
            (false, true, Matrix::B) => Observation::PrivateB,
        }
    }
}

impl ObservationDistribution {
    /// Probability that the bit is on, for `p` in [0, 1].
    #[must_use]
    pub const fn probability_of_bit(self, p: f64) -> f64 {
        match self {
            Self::Y2018 => p,
            Self::NeurIps2019 => 0.75 * p,
        }
    }

    /// Probability that an agent sees the matrix when the bit is off, for `p` in [0, 1].
    #[must_use]
    pub const fn probability_of_private_sight(self, p: f64) -> f64 {
        match self {
            Self::Y2018 => 0.5,
            Self::NeurIps2019 => 0.75 * (1.0 - p) / (1.0 - 0.75 * p),
        }
    }

    /// Deals the cards that numbers uniform in [0, 1) stand for: for the bit, for the matrix and for each agent's luck.
    pub(super) fn deal(self, p: f64, bit: f64, matrix: f64, sight: [f64; AGENTS]) -> DealtCards {
        let bit = bit < self.probability_of_bit(p);
        let private = self.probability_of_private_sight(p);
        DealtCards {
            bit,
            matrix: Matrix::ALL[usize::from(matrix >= 0.5)],
            sees_matrix: sight.map(|luck| bit || luck < private),
        }
    }

    /// Every deal that can happen, at most ten; their probabilities sum to 1.
    ///
    /// # Errors
    /// If `p` is not in [0, 1].
    pub fn deals(self, p: f64) -> Result<Vec<Deal>, InvalidProbability> {
        if !(0.0..=1.0).contains(&p) {
            return Err(InvalidProbability(p));
        }
        let bit = self.probability_of_bit(p);
        let sight = self.probability_of_private_sight(p);
        let chance = |seen: bool| if seen { sight } else { 1.0 - sight };
        let mut deals = Vec::with_capacity(10);
        for matrix in Matrix::ALL {
            deals.push(Deal {
                cards: DealtCards {
                    bit: true,
                    matrix,
                    sees_matrix: [true; AGENTS],
                },
                probability: 0.5 * bit,
            });
            for [first, second] in [[false, false], [false, true], [true, false], [true, true]] {
                deals.push(Deal {
                    cards: DealtCards {
                        bit: false,
                        matrix,
                        sees_matrix: [first, second],
                    },
                    probability: 0.5 * (1.0 - bit) * chance(first) * chance(second),
                });
            }
        }
        deals.retain(|deal| deal.probability > 0.0);
        Ok(deals)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DISTRIBUTIONS: [ObservationDistribution; 2] = [
        ObservationDistribution::Y2018,
        ObservationDistribution::NeurIps2019,
    ];

    fn probability(deals: &[Deal], event: impl Fn(&DealtCards) -> bool) -> f64 {
        deals
            .iter()
            .filter(|deal| event(&deal.cards))
            .map(|deal| deal.probability)
            .sum()
    }

    #[test]
    fn probabilities_of_all_deals_sum_to_one() {
        for distribution in DISTRIBUTIONS {
            for p in [0.0, 0.3, 0.7, 1.0] {
                let total = probability(&distribution.deals(p).unwrap(), |_| true);
                assert!((total - 1.0).abs() < 1e-15, "{distribution:?} {p}: {total}");
            }
        }
    }

    #[test]
    fn private_sight_grows_with_p_in_2018_and_not_at_neurips() {
        for (distribution, expected) in DISTRIBUTIONS.into_iter().zip([|p| 0.5 + 0.5 * p, |_| 0.75])
        {
            for p in [0.0, 0.3, 0.7, 1.0] {
                let sight = probability(&distribution.deals(p).unwrap(), |c| c.sees_matrix[1]);
                assert!(
                    (sight - expected(p)).abs() < 1e-15,
                    "{distribution:?} {p}: {sight}"
                );
            }
        }
    }

    #[test]
    fn common_knowledge_is_what_both_observations_have_in_common_when_the_bit_is_on() {
        for deal in ObservationDistribution::Y2018.deals(0.4).unwrap() {
            let both = [0, 1].map(|agent| deal.cards.observation(agent));
            match deal.cards.common_knowledge() {
                CommonKnowledge::Nothing => assert!(
                    both.iter()
                        .all(|o| !matches!(o, Observation::CommonA | Observation::CommonB)),
                    "an agent believes in common knowledge that is none: {both:?}"
                ),
                CommonKnowledge::MatrixA => assert_eq!(both, [Observation::CommonA; 2]),
                CommonKnowledge::MatrixB => assert_eq!(both, [Observation::CommonB; 2]),
            }
        }
    }

    #[test]
    fn p_outside_the_unit_interval_is_refused() {
        for p in [-0.1, 1.1, f64::NAN] {
            assert!(ObservationDistribution::Y2018.deals(p).is_err(), "{p}");
        }
    }
}
