//! The probability of a joint action over all paths through the hierarchy (eq. (5)) and its gradient.
//!
//! Acting follows one path; learning sums over all that end in the same joint action. The pair that was not formed and the
//! controller that was not asked therefore learn too, in proportion to how likely they are to have been responsible: the
//! gradient with respect to every log-probability is a posterior weight.
//!
//! [`log_likelihood`] and [`log_likelihood_with_gradient`] do this for the pairwise hierarchy, in log space and without
//! allocation. [`reference`](mod@reference) is the general hierarchy of eq. (4) with any groups, written as literally as possible, to test
//! them against.

mod pairwise;
pub mod reference;

pub use pairwise::{MarginalGradient, log_likelihood, log_likelihood_with_gradient};
