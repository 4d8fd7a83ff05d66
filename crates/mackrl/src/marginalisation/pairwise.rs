//! The marginal likelihood of pairwise MACKRL in closed form.
//!
//! Given a partition, its pairs act independently, so the sum over paths factorises: two ways for each pair, a product over
//! pairs, a sum over partitions. A product of many probabilities leaves the range of `f32` (24 agents that choose evenly
//! among 36 actions: e⁻⁸⁶, at its very edge; a sharper policy: far below), so everything stays in logarithms.

use mackrl_env::{Action, AgentId};

use crate::{
    Real,
    partition::{Pair, Partition},
    policy::{DELEGATE, PolicyShape, PolicyTable},
};

/// d log p(u) / d log π for every table entry that the joint action u touches; all other entries have none.
///
/// Every number is a posterior probability given u, in [0, 1]. If p(u) = 0 there is no gradient, and all are 0.
#[derive(Debug, Clone, PartialEq)]
pub struct MarginalGradient<F> {
    /// For each partition \[P\]: that it was chosen. Sums to 1.
    pub selector_p: Vec<F>,
    /// For each pair \[K\]: that it was formed and acted jointly. Belongs to the column of `(u_a, u_b)`.
    pub joint_k: Vec<F>,
    /// For each pair \[K\]: that it was formed and delegated. Belongs to the column [`DELEGATE`].
    pub delegate_k: Vec<F>,
    /// For each agent \[N\]: that it acted alone. Belongs to the column `u_a`.
    pub agent_n: Vec<F>,
    /// Factors of the pairs in force \[K\], and whether they have been computed.
    factor_k: Vec<Option<PairFactor<F>>>,
}

/// One pair's factor of p(u | partition): the joint way plus the delegated way.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PairFactor<F> {
    /// `log π_pc(u_a, u_b)`
    joint: F,
    /// `log π_pc(d) + log π_a(u_a) + log π_b(u_b)`
    delegated: F,
    /// The logarithm of the sum of both probabilities.
    log_p: F,
}

impl<F: Real> MarginalGradient<F> {
    /// Room for `partitions` partitions in force.
    #[must_use]
    pub fn new(shape: PolicyShape, partitions: usize) -> Self {
        let zeros = |count| vec![F::ZERO; count];
        Self {
            selector_p: zeros(partitions),
            joint_k: zeros(shape.pairs()),
            delegate_k: zeros(shape.pairs()),
            agent_n: zeros(shape.agents),
            factor_k: vec![None; shape.pairs()],
        }
    }

    /// Forgets everything and takes the sizes of `table`; allocates only to grow.
    fn reset(&mut self, table: &PolicyTable<'_, F>) {
        let zero = |weights: &mut Vec<F>, count| {
            weights.clear();
            weights.resize(count, F::ZERO);
        };
        let shape = table.shape();
        zero(&mut self.selector_p, table.partitions().len());
        zero(&mut self.joint_k, shape.pairs());
        zero(&mut self.delegate_k, shape.pairs());
        zero(&mut self.agent_n, shape.agents);
        self.factor_k.clear();
        self.factor_k.resize(shape.pairs(), None);
    }
}

/// log p(u), the log-probability that the hierarchy of `table` ends in the joint action `actions_n`.
///
/// −∞ if no path leads there.
///
/// # Shapes
/// `actions_n` \[N\].
///
/// # Equation
/// Eq. (5) for the pairwise hierarchy:
///
/// ```text
/// log p(u) = LSE_P [ log π_ps(P)
///                  + Σ_{ {a,b} ∈ P } LSE( log π_pc(u_a, u_b), log π_pc(d) + log π_a(u_a) + log π_b(u_b) )
///                  + Σ_{singleton c of P} log π_c(u_c) ]
/// ```
#[must_use]
pub fn log_likelihood<F: Real>(table: &PolicyTable<'_, F>, actions_n: &[Action]) -> F {
    debug_assert_eq!(
        actions_n.len(),
        table.shape().agents,
        "one action per agent"
    );
    let terms = table
        .partitions()
        .iter()
        .zip(table.selector())
        .map(|(partition, &log_p)| {
            let factor = |pair: &Pair| pair_factor(table, *pair, actions_n).log_p;
            log_p + log_p_given(table, partition, actions_n, factor)
        });
    log_sum_exp(terms)
}

/// [`log_likelihood`], and its derivative with respect to every entry of the table, written to `gradient`.
///
/// Allocates nothing once `gradient` has had the table's sizes.
///
/// # Shapes
/// `actions_n` \[N\].
///
/// # Equation
/// With `w_P` the posterior of partition P, `r_k` that of pair k and `δ_k` the share of delegation in the pair's factor:
///
/// ```text
/// w_P = π_ps(P)·p(u | P) / p(u)                    ∂ log p(u) / ∂ log π_ps(P)         = w_P
/// r_k = Σ_{P ∋ k} w_P                              ∂ log p(u) / ∂ log π_pc(u_a, u_b)  = r_k·(1 − δ_k)
/// δ_k = π_pc(d)·π_a(u_a)·π_b(u_b) / p(u_a, u_b)    ∂ log p(u) / ∂ log π_pc(d)         = r_k·δ_k
///                                                  ∂ log p(u) / ∂ log π_a(u_a)        = Σ_{k ∋ a} r_k·δ_k + Σ_{P leaves a alone} w_P
/// ```
pub fn log_likelihood_with_gradient<F: Real>(
    table: &PolicyTable<'_, F>,
    actions_n: &[Action],
    gradient: &mut MarginalGradient<F>,
) -> F {
    debug_assert_eq!(
        actions_n.len(),
        table.shape().agents,
        "one action per agent"
    );
    gradient.reset(table);
    let MarginalGradient {
        selector_p,
        factor_k,
        ..
    } = gradient;
    for ((term, partition), &log_p) in selector_p
        .iter_mut()
        .zip(table.partitions())
        .zip(table.selector())
    {
        let factor = |pair: &Pair| {
            factor_k[pair.index()]
                .get_or_insert_with(|| pair_factor(table, *pair, actions_n))
                .log_p
        };
        *term = log_p + log_p_given(table, partition, actions_n, factor);
    }
    let log_p = log_sum_exp(selector_p.iter().copied());
    for term in selector_p {
        *term = share(*term, log_p);
    }
    distribute(table, gradient);
    log_p
}

/// Passes the posteriors of the partitions, in `selector_p`, down to pairs and agents.
fn distribute<F: Real>(table: &PolicyTable<'_, F>, gradient: &mut MarginalGradient<F>) {
    // `joint_k` collects the posteriors of the pairs before they are split.
    for (partition, &posterior) in table.partitions().iter().zip(&gradient.selector_p) {
        for pair in partition.pairs() {
            gradient.joint_k[pair.index()] += posterior;
        }
        if let Some(agent) = partition.singleton() {
            gradient.agent_n[agent.index()] += posterior;
        }
    }
    for partition in table.partitions() {
        for pair in partition.pairs() {
            let k = pair.index();
            // Taken, so that a pair of several partitions is split once.
            let Some(factor) = gradient.factor_k[k].take() else {
                continue;
            };
            let posterior = gradient.joint_k[k];
            gradient.joint_k[k] = posterior * share(factor.joint, factor.log_p);
            gradient.delegate_k[k] = posterior * share(factor.delegated, factor.log_p);
            for agent in pair.agents() {
                gradient.agent_n[agent.index()] += gradient.delegate_k[k];
            }
        }
    }
}

/// log p(u | `partition`), given each pair's log factor.
fn log_p_given<F: Real>(
    table: &PolicyTable<'_, F>,
    partition: &Partition,
    actions_n: &[Action],
    log_factor: impl FnMut(&Pair) -> F,
) -> F {
    let alone = partition.singleton().map_or(F::ZERO, |agent| {
        table.agent(agent.index())[actions_n[agent.index()].index()]
    });
    partition.pairs().iter().map(log_factor).sum::<F>() + alone
}

fn pair_factor<F: Real>(
    table: &PolicyTable<'_, F>,
    pair: Pair,
    actions_n: &[Action],
) -> PairFactor<F> {
    let [a, b] = pair.agents().map(AgentId::index);
    let log_p_c = table.pair(pair.index());
    let joint = log_p_c[table.shape().column(actions_n[a], actions_n[b])];
    let delegated = log_p_c[DELEGATE]
        + table.agent(a)[actions_n[a].index()]
        + table.agent(b)[actions_n[b].index()];
    PairFactor {
        joint,
        delegated,
        log_p: log_sum_exp([joint, delegated]),
    }
}

/// e^{term − total}: the share of a term in a sum, both in logarithms; 0 if the sum is empty of probability.
fn share<F: Real>(term: F, total: F) -> F {
    if term == F::NEG_INFINITY {
        F::ZERO
    } else {
        (term - total).exp()
    }
}

/// log Σ e^{x} in one pass, −∞ if there is no probability. If one term alone is not −∞, it is returned to the bit; a NaN
/// stays one, so that whoever checks the result finds it.
fn log_sum_exp<F: Real>(terms: impl IntoIterator<Item = F>) -> F {
    let mut largest = F::NEG_INFINITY;
    // Σ e^{x − largest} over the terms so far.
    let mut sum = F::ZERO;
    for term in terms {
        if term > largest {
            sum = sum * (largest - term).exp() + F::ONE;
            largest = term;
        } else if term != F::NEG_INFINITY {
            sum += (term - largest).exp();
        }
    }
    largest + sum.ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: f64 = f64::NEG_INFINITY;

    #[test]
    fn a_sum_without_probability_is_minus_infinity_and_has_no_shares() {
        assert_eq!(log_sum_exp::<f64>([]), NONE);
        assert_eq!(log_sum_exp([NONE, NONE]), NONE);
        assert_eq!(share(NONE, NONE), 0.0);
        assert_eq!(share(NONE, -3.0), 0.0);
    }

    #[test]
    fn a_sum_of_one_term_is_that_term_to_the_bit() {
        let term = -0.123_456_789_f64;
        for terms in [[term, NONE], [NONE, term]] {
            assert_eq!(log_sum_exp(terms).to_bits(), term.to_bits());
        }
    }

    #[test]
    fn sums_do_not_depend_on_where_the_largest_term_stands() {
        let expected = -1_000.0 + (1.0 + 2.0 * (-1.0_f64).exp()).ln();
        for terms in [
            [-1_000.0, -1_001.0, -1_001.0],
            [-1_001.0, -1_000.0, -1_001.0],
            [-1_001.0, -1_001.0, -1_000.0],
        ] {
            assert!((log_sum_exp(terms) - expected).abs() < 1e-12, "{terms:?}");
        }
    }

    #[test]
    fn what_is_not_a_number_is_not_hidden() {
        for terms in [[f64::NAN, 0.0], [0.0, f64::NAN], [NONE, f64::NAN]] {
            assert!(log_sum_exp(terms).is_nan(), "{terms:?}");
        }
    }
}
