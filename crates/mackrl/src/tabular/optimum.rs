//! The best that each class of policies can earn, by enumeration.
//!
//! Deterministic policies suffice: the return is linear in each table of probabilities, and shared randomness cannot help a
//! team that plays once.

use std::collections::BTreeMap;

use mackrl_env::matrix_game::{ACTIONS, CommonKnowledge, Deal, DealtCards, Observation};
use serde::{Deserialize, Serialize};

use super::game::TabularGame;

/// Best expected returns.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Optima {
    /// Each agent acts on its own observation, which tells whether it is common knowledge (IAC).
    pub decentralised: f64,
    /// Each agent acts on what it sees of the matrix, not knowing whether the other sees it.
    pub decentralised_without_bit: f64,
    /// One controller acts on common knowledge alone (JAL).
    pub jal: f64,
    /// In each state of common knowledge the better of a joint action and delegation (MACKRL).
    pub mackrl: f64,
    /// One controller acts on both agents' observations.
    pub joint_observation: f64,
    /// One controller acts on the true matrix.
    pub oracle: f64,
}

/// Enumerates every class of policies.
#[must_use]
pub fn optima(game: &TabularGame) -> Optima {
    let all = game.deals();
    let own = |cards: &DealtCards, agent: usize| cards.observation(agent).index();
    let mackrl = CommonKnowledge::ALL.map(|state| {
        let deals: Vec<Deal> = (all.iter().copied())
            .filter(|deal| deal.cards.common_knowledge() == state)
            .collect();
        // Observations tell the state of common knowledge, so delegated policies can be chosen for each state apart.
        decentralised(game, &deals, own).max(central(game, &deals, |_| ()))
    });
    Optima {
        decentralised: decentralised(game, all, own),
        decentralised_without_bit: decentralised(game, all, matrix_seen),
        jal: central(game, all, DealtCards::common_knowledge),
        mackrl: mackrl.into_iter().sum(),
        joint_observation: central(game, all, |cards| [0, 1].map(|a| cards.observation(a))),
        oracle: central(game, all, |cards| cards.matrix),
    }
}

/// What `agent` sees of the matrix: A, B or nothing.
fn matrix_seen(cards: &DealtCards, agent: usize) -> usize {
    match cards.observation(agent) {
        Observation::CommonA | Observation::PrivateA => 0,
        Observation::CommonB | Observation::PrivateB => 1,
        Observation::Nothing => 2,
    }
}

/// The best return of one controller that is told `key` of every deal.
fn central<K: Ord>(game: &TabularGame, deals: &[Deal], key: impl Fn(&DealtCards) -> K) -> f64 {
    let mut values = BTreeMap::<K, [[f64; ACTIONS]; ACTIONS]>::new();
    for deal in deals {
        let sums = values.entry(key(&deal.cards)).or_default();
        for (sums_a, payoffs_a) in sums.iter_mut().zip(game.payoffs(deal.cards.matrix)) {
            add_scaled(sums_a, deal.probability, payoffs_a);
        }
    }
    values
        .values()
        .map(|sums| largest(sums.iter().flatten()))
        .sum()
}

/// The best return of two agents of which each is told `observe(cards, agent)` of every deal.
///
/// Enumerates every policy of the first agent; the second answers each with its best action for each observation.
fn decentralised(
    game: &TabularGame,
    deals: &[Deal],
    observe: impl Fn(&DealtCards, usize) -> usize,
) -> f64 {
    let mut observations: Vec<usize> = deals.iter().map(|deal| observe(&deal.cards, 0)).collect();
    observations.sort_unstable();
    observations.dedup();
    let policies = (0..observations.len()).fold(1, |count, _| count * ACTIONS);
    let values: Vec<f64> = (0..policies)
        .map(|policy| {
            let mut first_o = [0; Observation::COUNT];
            let mut rest = policy;
            for &observation in &observations {
                first_o[observation] = rest % ACTIONS;
                rest /= ACTIONS;
            }
            let mut answers_oa = [[0.0; ACTIONS]; Observation::COUNT];
            for deal in deals {
                let first = first_o[observe(&deal.cards, 0)];
                let payoffs_a = &game.payoffs(deal.cards.matrix)[first];
                let answers_a = &mut answers_oa[observe(&deal.cards, 1)];
                add_scaled(answers_a, deal.probability, payoffs_a);
            }
            answers_oa.iter().map(largest).sum()
        })
        .collect();
    largest(&values)
}

fn add_scaled(sums: &mut [f64; ACTIONS], weight: f64, values: &[f64; ACTIONS]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += weight * value;
    }
}

fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values.into_iter().copied().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use mackrl_env::matrix_game::{ObservationDistribution, Payoffs};

    use super::*;

    const PAYOFFS: [Payoffs; 2] = [Payoffs::Coded, Payoffs::Printed];

    fn at(payoffs: Payoffs, distribution: ObservationDistribution, p: f64) -> Optima {
        optima(&TabularGame::new(payoffs, distribution, p).unwrap())
    }

    #[test]
    fn optima_of_the_2018_game_follow_their_formulae() {
        for payoffs in PAYOFFS {
            for tenth in 0..=10 {
                let p = f64::from(tenth) / 10.0;
                let found = at(payoffs, ObservationDistribution::Y2018, p);
                for (name, value, expected) in [
                    ("decentralised", found.decentralised, 0.75 + 0.25 * p),
                    (
                        "without the bit",
                        found.decentralised_without_bit,
                        0.75 + 0.25 * p,
                    ),
                    ("jal", found.jal, 0.5 + 0.5 * p),
                    ("mackrl", found.mackrl, 0.75 + 0.25 * p),
                    (
                        "joint observation",
                        found.joint_observation,
                        0.875 + 0.125 * p,
                    ),
                    ("oracle", found.oracle, 1.0),
                ] {
                    assert!(
                        (value - expected).abs() < 1e-12,
                        "{payoffs:?} {name} at {p}: {value}"
                    );
                }
            }
        }
    }

    /// Computed apart from this code, by brute force over all pairs of deterministic policies.
    #[test]
    fn optima_of_the_neurips_game_equal_their_table() {
        let mackrl = [
            0.8750, 0.8750, 0.8750, 0.8750, 0.8750, 0.8750, 0.8750, 0.8809, 0.8938, 0.8952, 0.8750,
        ];
        let joint_observation = [
            0.9688, 0.9662, 0.9632, 0.9597, 0.9554, 0.9500, 0.9432, 0.9342, 0.9219, 0.9038, 0.8750,
        ];
        for tenth in 0..=10_u32 {
            let p = f64::from(tenth) / 10.0;
            let found = at(Payoffs::Printed, ObservationDistribution::NeurIps2019, p);
            let row = tenth as usize;
            for (name, value, expected) in [
                ("decentralised", found.decentralised, mackrl[row]),
                ("without the bit", found.decentralised_without_bit, 0.875),
                ("jal", found.jal, 0.5 + 0.375 * p),
                ("mackrl", found.mackrl, mackrl[row]),
                (
                    "joint observation",
                    found.joint_observation,
                    joint_observation[row],
                ),
            ] {
                // The table is rounded to four places.
                assert!((value - expected).abs() < 6e-5, "{name} at {p}: {value}");
            }
        }
    }

    #[test]
    fn joint_control_adds_nothing_to_the_best_decentralised_policy() {
        for distribution in [
            ObservationDistribution::Y2018,
            ObservationDistribution::NeurIps2019,
        ] {
            for p in [0.0, 0.25, 0.75, 1.0] {
                let found = at(Payoffs::Coded, distribution, p);
                assert!(
                    (found.mackrl - found.decentralised).abs() < 1e-12,
                    "{found:?}"
                );
            }
        }
    }
}
