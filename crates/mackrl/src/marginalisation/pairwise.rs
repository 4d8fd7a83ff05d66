//! The marginal likelihood of pairwise MACKRL in closed form.
//!
//! Given a partition, its pairs act independently, so the sum over paths factorises: two ways for each pair, a product over
//! pairs, a sum over partitions. A product of many probabilities leaves the range of `f32` (24 agents that choose evenly
//! among 36 actions: e⁻⁸⁶, at its very edge; a sharper policy: far below), so everything stays in logarithms.

use mackrl_env::Action;

use super::{
    MarginalGradient,
    logarithm::{log_sum_exp, share},
};
use crate::{
    Real,
    policy::{Division, Part, PolicyTable, TEAM},
};

/// The column of a pair's row that stands for *delegate*; the joint actions follow.
pub const DELEGATE: usize = 0;
/// The levels of pairs and of agents.
const PAIRS: usize = 1;
const AGENTS: usize = 2;

/// One pair's factor of p(u | partition): the joint way plus the delegated way.
struct PairFactor<F> {
    /// `log π_pc(u_a, u_b)`
    joint: F,
    /// `log π_pc(d) + log π_a(u_a) + log π_b(u_b)`
    delegated: F,
    /// The logarithm of the sum of both probabilities.
    log_p: F,
}

/// log p(u) and its gradient for [`Declaration::pairwise`](crate::policy::Declaration::pairwise).
///
/// # Shapes
/// `action_n` \[N\].
///
/// # Equation
/// Eq. (5) for the pairwise hierarchy, with `w_P` the posterior of partition P, `r_k` that of pair k and `δ_k` the share of
/// delegation in the pair's factor:
///
/// ```text
/// log p(u) = LSE_P [ log π_ps(P)
///                  + Σ_{ {a,b} ∈ P } LSE( log π_pc(u_a, u_b), log π_pc(d) + log π_a(u_a) + log π_b(u_b) )
///                  + Σ_{singleton c of P} log π_c(u_c) ]
///
/// w_P = π_ps(P)·p(u | P) / p(u)                    ∂ log p(u) / ∂ log π_ps(P)         = w_P
/// r_k = Σ_{P ∋ k} w_P                              ∂ log p(u) / ∂ log π_pc(u_a, u_b)  = r_k·(1 − δ_k)
/// δ_k = π_pc(d)·π_a(u_a)·π_b(u_b) / p(u_a, u_b)    ∂ log p(u) / ∂ log π_pc(d)         = r_k·δ_k
///                                                  ∂ log p(u) / ∂ log π_a(u_a)        = Σ_{k ∋ a} r_k·δ_k + Σ_{P leaves a alone} w_P
/// ```
pub fn log_likelihood_with_gradient<F: Real>(
    table: &PolicyTable<'_, F>,
    action_n: &[Action],
    gradient: &mut MarginalGradient<F>,
) -> F {
    debug_assert_eq!(
        action_n.len(),
        table.declaration().agents(),
        "one action per agent"
    );
    gradient.reset(table);
    let [team, pairs, _] = &mut gradient.levels[..] else {
        unreachable!("the pairwise hierarchy has three levels");
    };
    let selector = table.row(Part {
        level: TEAM,
        group: 0,
    });
    for ((term, division), &log_p) in team
        .division_gd
        .iter_mut()
        .zip(table.in_force())
        .zip(selector)
    {
        let factor = |pair: Part| {
            let known = &mut pairs.log_p_g[pair.group];
            *known.get_or_insert_with(|| pair_factor(table, pair, action_n).log_p)
        };
        *term = log_p + log_p_given(table, division, action_n, factor);
    }
    let log_p = log_sum_exp(team.division_gd.iter().copied());
    for term in &mut team.division_gd {
        *term = share(*term, log_p);
    }
    distribute(table, action_n, gradient);
    log_p
}

/// Passes the posteriors of the partitions down to pairs and agents.
fn distribute<F: Real>(
    table: &PolicyTable<'_, F>,
    action_n: &[Action],
    gradient: &mut MarginalGradient<F>,
) {
    let [team, pairs, agents] = &mut gradient.levels[..] else {
        unreachable!("the pairwise hierarchy has three levels");
    };
    // The joint way's place collects the posteriors of the pairs before they are split.
    for (division, &posterior) in table.in_force().iter().zip(&team.division_gd) {
        for part in &division.parts {
            let level = if part.level == PAIRS {
                &mut *pairs
            } else {
                &mut *agents
            };
            level.joint_g[part.group] += posterior;
        }
    }
    for division in table.in_force() {
        for &pair in division.parts.iter().filter(|part| part.level == PAIRS) {
            let k = pair.group;
            // Taken, so that a pair of several partitions is split once.
            if pairs.log_p_g[k].take().is_none() {
                continue;
            }
            let factor = pair_factor(table, pair, action_n);
            let posterior = pairs.joint_g[k];
            pairs.joint_g[k] = posterior * share(factor.joint, factor.log_p);
            pairs.division_gd[k] = posterior * share(factor.delegated, factor.log_p);
            for agent in table.declaration().members(pair) {
                agents.joint_g[agent.index()] += pairs.division_gd[k];
            }
        }
    }
}

/// log p(u | `division`), given each pair's log factor: the pairs come first, an agent that is alone last.
fn log_p_given<F: Real>(
    table: &PolicyTable<'_, F>,
    division: &Division,
    action_n: &[Action],
    mut log_factor: impl FnMut(Part) -> F,
) -> F {
    let terms = division.parts.iter().map(|&part| {
        if part.level == PAIRS {
            log_factor(part)
        } else {
            table.row(part)[action_n[part.group].index()]
        }
    });
    terms.sum()
}

fn pair_factor<F: Real>(
    table: &PolicyTable<'_, F>,
    pair: Part,
    action_n: &[Action],
) -> PairFactor<F> {
    let declaration = table.declaration();
    let log_p_c = table.row(pair);
    let level = &declaration.levels()[PAIRS];
    let column = level.column(pair.group, declaration.actions(), action_n);
    let joint = log_p_c[column.expect("pairs act jointly")];
    let alone = |agent: &mackrl_env::AgentId| {
        let row = table.row(Part {
            level: AGENTS,
            group: agent.index(),
        });
        row[action_n[agent.index()].index()]
    };
    let members = declaration.members(pair).iter().map(alone);
    let delegated = members.fold(log_p_c[DELEGATE], |sum, log_p| sum + log_p);
    PairFactor {
        joint,
        delegated,
        log_p: log_sum_exp([joint, delegated]),
    }
}
