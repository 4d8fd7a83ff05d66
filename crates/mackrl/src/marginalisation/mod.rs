//! The probability of a joint action over all paths through the hierarchy (eq. (5)) and its gradient.
//!
//! Acting follows one path; learning sums over all that end in the same joint action. The pair that was not formed and the
//! controller that was not asked therefore learn too, in proportion to how likely they are to have been responsible: the
//! gradient with respect to every log-probability is a posterior weight.
//!
//! [`log_likelihood`] and [`log_likelihood_with_gradient`] do this in log space and without allocation: for any declaration
//! by [`recursive`], for the pairwise one in closed form ([`pairwise`]), which is tested to be the same.
//! [`reference`](mod@reference) is the general hierarchy of eq. (4), written as literally as possible, to test both against.

mod gradient;
mod logarithm;
pub mod pair;
pub mod pairwise;
pub mod recursive;
pub mod reference;

pub use gradient::{LevelGradient, MarginalGradient};

use mackrl_env::Action;

use crate::{Real, policy::PolicyTable};

/// log p(u), the log-probability that the hierarchy of `table` ends in the joint action `action_n`; −∞ if no path leads
/// there.
///
/// # Shapes
/// `action_n` \[N\].
#[must_use]
pub fn log_likelihood<F: Real>(table: &PolicyTable<'_, F>, action_n: &[Action]) -> F {
    log_likelihood_with_gradient(table, action_n, &mut MarginalGradient::default())
}

/// [`log_likelihood`], and its derivative with respect to every entry of the table, written to `gradient`.
///
/// Allocates nothing once `gradient` has had the table's sizes.
///
/// # Shapes
/// `action_n` \[N\].
pub fn log_likelihood_with_gradient<F: Real>(
    table: &PolicyTable<'_, F>,
    action_n: &[Action],
    gradient: &mut MarginalGradient<F>,
) -> F {
    if table.declaration().is_pairwise() {
        pairwise::log_likelihood_with_gradient(table, action_n, gradient)
    } else {
        recursive::log_likelihood_with_gradient(table, action_n, gradient)
    }
}
