//! Tabular policies of two agents, their exact return and its gradient.

use mackrl_env::matrix_game::{ACTIONS, AGENTS, CommonKnowledge, Deal, Observation};
use serde::{Deserialize, Serialize};

use super::game::{PayoffTable, TabularGame};
use crate::Real;

/// Number of logits: two agents × 5 observations × 5 actions, and 3 states of common knowledge × 26 choices of the pair.
pub const PARAMETERS: usize = AGENT_PARAMETERS + CommonKnowledge::ALL.len() * CHOICES;
const AGENT_PARAMETERS: usize = AGENTS * Observation::COUNT * ACTIONS;
/// C: choices of the pair controller: delegate, then the joint actions.
const CHOICES: usize = 1 + ACTIONS * ACTIONS;
const DELEGATE: usize = 0;

/// Which controllers may act.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Learner {
    /// Independent actor-critic: the pair controller always delegates.
    Iac,
    /// Joint-action learning on common knowledge: the pair controller never delegates.
    Jal,
    /// The pair controller chooses between a joint action and delegation.
    Mackrl,
}

impl Learner {
    /// All three, as they are listed in Figure 5.
    pub const ALL: [Self; 3] = [Self::Iac, Self::Jal, Self::Mackrl];

    /// Whether the pair controller may make `choice`.
    const fn allows(self, choice: usize) -> bool {
        match self {
            Self::Iac => choice == DELEGATE,
            Self::Jal => choice != DELEGATE,
            Self::Mackrl => true,
        }
    }
}

/// The parameters: logits of the agents' tables and of the pair's table, laid out as one vector.
///
/// # Shapes
/// First \[N, O, A\] for the agents, then \[3, C\] for the pair, with joint action (u¹, u²) at 1 + u¹·A + u².
#[derive(Debug, Clone, PartialEq)]
pub struct Logits(pub [f64; PARAMETERS]);

/// ∂J/∂logit, laid out like [`Logits`]. Logits that a learner masks have gradient 0.
pub type Gradient = [f64; PARAMETERS];

/// The probabilities that logits stand for.
#[derive(Debug, Clone, PartialEq)]
pub struct Policy {
    agents_noa: [[[f64; ACTIONS]; Observation::COUNT]; AGENTS],
    pair_c: [[f64; CHOICES]; CommonKnowledge::ALL.len()],
}

impl Policy {
    /// Softmax of `logits / temperature` over what `learner` may choose.
    ///
    /// Masked choices have probability 0 exactly. `temperature` is above 0; 1 is the policy itself, 0.01 is nearly greedy.
    #[must_use]
    pub fn new(learner: Learner, logits: &Logits, temperature: f64) -> Self {
        let scale = 1.0 / temperature;
        let agent = |agent: usize| {
            std::array::from_fn(|observation| {
                let at = agent_offset(agent, observation);
                softmax(|action| Some(logits.0[at + action] * scale))
            })
        };
        let pair = |state: usize| {
            let at = pair_offset(state);
            softmax(|choice| {
                learner
                    .allows(choice)
                    .then(|| logits.0[at + choice] * scale)
            })
        };
        Self {
            agents_noa: std::array::from_fn(agent),
            pair_c: std::array::from_fn(pair),
        }
    }

    /// The probability `π_pc(d | common_knowledge)` of delegation.
    #[must_use]
    pub const fn delegation(&self, common_knowledge: CommonKnowledge) -> f64 {
        self.pair_c[common_knowledge.index()][DELEGATE]
    }

    /// The tables that act in `deal`: those of the agents and that of the pair.
    const fn acting(&self, deal: &Deal) -> ([&[f64; ACTIONS]; AGENTS], &[f64; CHOICES]) {
        let [first, second] = &self.agents_noa;
        (
            [
                &first[deal.cards.observation(0).index()],
                &second[deal.cards.observation(1).index()],
            ],
            &self.pair_c[deal.cards.common_knowledge().index()],
        )
    }
}

/// p(u¹, u²) of two agents: the sum over both paths through the hierarchy.
///
/// # Equation
/// Eq. (5) for one pair, whose only paths are a joint action and delegation:
/// `p(u¹, u²) = π_pc(u¹, u²) + π_pc(d) · π¹(u¹) · π²(u²)`.
#[must_use]
pub fn joint_probability(joint: f64, delegate: f64, agents: [f64; AGENTS]) -> f64 {
    joint + delegate * agents[0] * agents[1]
}

/// J, the exact expected return of `policy`.
///
/// # Equation
/// `J = Σ_deal P(deal) Σ_{u¹,u²} p(u¹, u² | deal) R(u¹, u²)`.
#[must_use]
pub fn expected_return(game: &TabularGame, policy: &Policy) -> f64 {
    let mut total = 0.0;
    for deal in game.deals() {
        let ([first_a, second_a], pair_c) = policy.acting(deal);
        let payoffs = game.payoffs(deal.cards.matrix);
        for (u1, u2) in joint_actions() {
            let joint = pair_c[choice_of(u1, u2)];
            let agents = [first_a[u1], second_a[u2]];
            let probability = joint_probability(joint, pair_c[DELEGATE], agents);
            total += deal.probability * probability * payoffs[u1][u2];
        }
    }
    total
}

/// J and its gradient with respect to every logit, both exact.
///
/// # Equation
/// Every table is a softmax, so `∂J/∂z_i = π_i (Q_i − Σ_j π_j Q_j)`, where `Q_i` is the expected return if that table chooses
/// i: `R(u¹, u²)` for a joint action, `Σ_{u¹,u²} π¹(u¹) π²(u²) R(u¹, u²)` for delegation, and
/// `π_pc(d) Σ_{u²} π²(u²) R(u¹, u²)` for an action of agent 1 (agent 2 alike).
#[must_use]
pub fn expected_return_and_gradient(game: &TabularGame, policy: &Policy) -> (f64, Gradient) {
    let mut gradient = [0.0; PARAMETERS];
    let mut total = 0.0;
    for deal in game.deals() {
        let ([first_a, second_a], pair_c) = policy.acting(deal);
        let payoffs = game.payoffs(deal.cards.matrix);
        let action_values = delegated_action_values(payoffs, first_a, second_a);
        let delegated = dot(first_a, &action_values[0]);

        let mut choice_values = [delegated; CHOICES];
        for (u1, u2) in joint_actions() {
            choice_values[choice_of(u1, u2)] = payoffs[u1][u2];
        }
        let at = pair_offset(deal.cards.common_knowledge().index());
        let pair_gradient = &mut gradient[at..at + CHOICES];
        total += add_softmax_gradient(pair_gradient, deal.probability, pair_c, &choice_values);

        let weight = deal.probability * pair_c[DELEGATE];
        for (agent, policy_a) in [first_a, second_a].into_iter().enumerate() {
            let at = agent_offset(agent, deal.cards.observation(agent).index());
            let agent_gradient = &mut gradient[at..at + ACTIONS];
            add_softmax_gradient(agent_gradient, weight, policy_a, &action_values[agent]);
        }
    }
    (total, gradient)
}

/// Expected payoff of each action of each agent \[N, A\] when the pair delegates and the other agent follows its policy.
fn delegated_action_values(
    payoffs: &PayoffTable,
    first_a: &[f64; ACTIONS],
    second_a: &[f64; ACTIONS],
) -> [[f64; ACTIONS]; AGENTS] {
    let mut values = [[0.0; ACTIONS]; AGENTS];
    for (u1, u2) in joint_actions() {
        values[0][u1] += second_a[u2] * payoffs[u1][u2];
        values[1][u2] += first_a[u1] * payoffs[u1][u2];
    }
    values
}

/// Adds `weight · π_i (Q_i − Σ_j π_j Q_j)` and returns `weight · Σ_j π_j Q_j`.
fn add_softmax_gradient(gradient: &mut [f64], weight: f64, policy: &[f64], values: &[f64]) -> f64 {
    let expected = dot(policy, values);
    for (slot, (probability, value)) in gradient.iter_mut().zip(policy.iter().zip(values)) {
        *slot += weight * probability * (value - expected);
    }
    weight * expected
}

/// Softmax over the logits that `logit` gives; `None` is masked and gets 0.
fn softmax<const COUNT: usize>(logit: impl Fn(usize) -> Option<f64>) -> [f64; COUNT] {
    let logits: [f64; COUNT] = std::array::from_fn(|i| logit(i).unwrap_or(f64::NEG_INFINITY));
    let largest = logits.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights = logits.map(|logit| Real::exp(logit - largest));
    let total: f64 = weights.iter().sum();
    weights.map(|weight| weight / total)
}

fn joint_actions() -> impl Iterator<Item = (usize, usize)> {
    (0..ACTIONS).flat_map(|first| (0..ACTIONS).map(move |second| (first, second)))
}

fn dot(left: &[f64], right: &[f64]) -> f64 {
    left.iter().zip(right).map(|(l, r)| l * r).sum()
}

const fn choice_of(first: usize, second: usize) -> usize {
    1 + first * ACTIONS + second
}

const fn agent_offset(agent: usize, observation: usize) -> usize {
    (agent * Observation::COUNT + observation) * ACTIONS
}

const fn pair_offset(state: usize) -> usize {
    AGENT_PARAMETERS + state * CHOICES
}

#[cfg(test)]
mod tests {
    use mackrl_env::{
        Draw, EpisodeKey, Stream,
        matrix_game::{ObservationDistribution, Payoffs},
    };

    use super::*;

    fn logits(episode: u64) -> Logits {
        let key = EpisodeKey::new(3, Stream::Other, episode);
        Logits(std::array::from_fn(|i| key.normal(0, Draw::Setup(i))))
    }

    fn game(p: f64) -> TabularGame {
        TabularGame::new(Payoffs::Printed, ObservationDistribution::Y2018, p).unwrap()
    }

    #[test]
    fn probabilities_of_all_joint_actions_sum_to_one_in_every_deal() {
        for learner in Learner::ALL {
            let policy = Policy::new(learner, &logits(0), 1.0);
            for deal in game(0.4).deals() {
                let ([first, second], pair) = policy.acting(deal);
                let total: f64 = joint_actions()
                    .map(|(u1, u2)| {
                        let agents = [first[u1], second[u2]];
                        joint_probability(pair[choice_of(u1, u2)], pair[DELEGATE], agents)
                    })
                    .sum();
                assert!((total - 1.0).abs() < 1e-12, "{learner:?}: {total}");
            }
        }
    }

    #[test]
    fn the_return_with_its_gradient_is_the_return() {
        for learner in Learner::ALL {
            let policy = Policy::new(learner, &logits(1), 1.0);
            let (value, _) = expected_return_and_gradient(&game(0.3), &policy);
            let difference = value - expected_return(&game(0.3), &policy);
            assert!(difference.abs() < 1e-14, "{learner:?}: {difference}");
        }
    }

    #[test]
    fn the_gradient_equals_central_differences() {
        let step = 1e-5;
        for learner in Learner::ALL {
            for p in [0.0, 0.3, 1.0] {
                let (game, logits) = (game(p), logits(2));
                let value =
                    |logits: &Logits| expected_return(&game, &Policy::new(learner, logits, 1.0));
                let policy = Policy::new(learner, &logits, 1.0);
                let (_, gradient) = expected_return_and_gradient(&game, &policy);
                for (parameter, exact) in gradient.into_iter().enumerate() {
                    let [above, below] = [step, -step].map(|change| {
                        let mut moved = logits.clone();
                        moved.0[parameter] += change;
                        value(&moved)
                    });
                    let difference = (above - below) / (2.0 * step) - exact;
                    assert!(
                        difference.abs() < 1e-8,
                        "{learner:?} {p} {parameter}: {difference}"
                    );
                }
            }
        }
    }

    #[test]
    fn masked_parts_have_neither_probability_nor_gradient() {
        let logits = logits(4);
        let iac = Policy::new(Learner::Iac, &logits, 1.0);
        let (_, gradient) = expected_return_and_gradient(&game(0.5), &iac);
        assert!(
            gradient[AGENT_PARAMETERS..].iter().all(|g| *g == 0.0),
            "IAC moves the pair"
        );
        assert!(
            gradient[..AGENT_PARAMETERS].iter().any(|g| *g != 0.0),
            "IAC does not learn"
        );
        let jal = Policy::new(Learner::Jal, &logits, 1.0);
        let (_, gradient) = expected_return_and_gradient(&game(0.5), &jal);
        assert!(
            gradient[..AGENT_PARAMETERS].iter().all(|g| *g == 0.0),
            "JAL moves an agent"
        );
        for state in CommonKnowledge::ALL {
            assert_eq!((iac.delegation(state), jal.delegation(state)), (1.0, 0.0));
        }
    }

    #[test]
    fn a_low_temperature_is_greedy() {
        let policy = Policy::new(Learner::Mackrl, &logits(5), 1e-6);
        for table in policy.agents_noa.iter().flatten() {
            assert_eq!(table.iter().filter(|p| **p == 1.0).count(), 1, "{table:?}");
        }
    }
}
