//! The marginal likelihood of any declaration, by recursion over its groups.
//!
//! Given how a group divides, its parts act independently; given that it acts jointly, they do not choose at all. A group is
//! reached on many ways but its factor is the same on each, so it is computed once.

use mackrl_env::Action;

use super::{
    MarginalGradient,
    logarithm::{log_sum_exp, share},
};
use crate::{
    Real,
    policy::{Division, Part, PolicyTable, TEAM},
};

/// log p(u) and its gradient for any declaration.
///
/// # Shapes
/// `action_n` \[N\].
///
/// # Equation
/// Eq. (5), where `p_𝒢` is the probability that the controller of 𝒢 and those below it end in the actions of u:
///
/// ```text
/// p_𝒢(u) = π_𝒢(u_𝒢) + Σ_{P ∈ 𝓟(𝒢)} π_𝒢(P) Π_{𝒢' ∈ P} p_𝒢'(u)          p(u) = p_team(u)
/// r_team = 1      r_𝒢' = Σ_{𝒢, P ∋ 𝒢'} r_𝒢 · π_𝒢(P) Π_{𝒢'' ∈ P} p_𝒢''(u) / p_𝒢(u)
/// ∂ log p(u) / ∂ log π_𝒢(P)   = r_𝒢 · π_𝒢(P) Π_{𝒢' ∈ P} p_𝒢'(u) / p_𝒢(u)
/// ∂ log p(u) / ∂ log π_𝒢(u_𝒢) = r_𝒢 · π_𝒢(u_𝒢) / p_𝒢(u)
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
    let team = Part {
        level: TEAM,
        group: 0,
    };
    let log_p = log_factor(table, team, action_n, gradient);
    // Posteriors of being asked, kept where those of acting jointly will stand.
    gradient.levels[TEAM].joint_g[0] = if log_p == F::NEG_INFINITY {
        F::ZERO
    } else {
        F::ONE
    };
    for level in 0..gradient.levels.len() {
        for group in 0..gradient.levels[level].joint_g.len() {
            distribute(table, Part { level, group }, action_n, gradient);
        }
    }
    log_p
}

/// log `p_𝒢(u)`
fn log_factor<F: Real>(
    table: &PolicyTable<'_, F>,
    part: Part,
    action_n: &[Action],
    gradient: &mut MarginalGradient<F>,
) -> F {
    if let Some(log_p) = gradient.levels[part.level].log_p_g[part.group] {
        return log_p;
    }
    for (column, division) in table.divisions(part).iter().enumerate() {
        if table.row(part)[column] > F::NEG_INFINITY {
            for &inner in &division.parts {
                log_factor(table, inner, action_n, gradient);
            }
        }
    }
    let divided = table.divisions(part).iter().enumerate();
    let divided =
        divided.map(|(column, division)| log_term(table, part, column, division, gradient));
    let log_p = log_sum_exp(log_joint(table, part, action_n).into_iter().chain(divided));
    gradient.levels[part.level].log_p_g[part.group] = Some(log_p);
    log_p
}

/// log `π_𝒢(u_𝒢)`, if the group may act jointly.
fn log_joint<F: Real>(table: &PolicyTable<'_, F>, part: Part, action_n: &[Action]) -> Option<F> {
    let declaration = table.declaration();
    let level = &declaration.levels()[part.level];
    let column = level.column(part.group, declaration.actions(), action_n)?;
    Some(table.row(part)[column])
}

/// log `π_𝒢(P)` + Σ log `p_𝒢'(u)`, of factors that have been computed.
fn log_term<F: Real>(
    table: &PolicyTable<'_, F>,
    part: Part,
    column: usize,
    division: &Division,
    gradient: &MarginalGradient<F>,
) -> F {
    let chosen = table.row(part)[column];
    if chosen == F::NEG_INFINITY {
        return chosen;
    }
    let factors = division.parts.iter().map(|inner| {
        let log_p = gradient.levels[inner.level].log_p_g[inner.group];
        log_p.expect("the factors of a possible division were computed")
    });
    chosen + factors.sum::<F>()
}

/// Passes the posterior of a group on to its choices and to the groups that it may divide into.
fn distribute<F: Real>(
    table: &PolicyTable<'_, F>,
    part: Part,
    action_n: &[Action],
    gradient: &mut MarginalGradient<F>,
) {
    let asked = gradient.levels[part.level].joint_g[part.group];
    let Some(log_p) = gradient.levels[part.level].log_p_g[part.group] else {
        return;
    };
    if asked == F::ZERO {
        return;
    }
    let joint = log_joint(table, part, action_n);
    gradient.levels[part.level].joint_g[part.group] =
        joint.map_or(F::ZERO, |joint| asked * share(joint, log_p));
    for (column, division) in table.divisions(part).iter().enumerate() {
        let term = log_term(table, part, column, division, gradient);
        let posterior = asked * share(term, log_p);
        let level = &mut gradient.levels[part.level];
        level.division_gd[part.group * level.divisions + column] = posterior;
        for inner in &division.parts {
            gradient.levels[inner.level].joint_g[inner.group] += posterior;
        }
    }
}
