//! The critic V(state, last actions) and the returns that it learns from.
//!
//! The critic is central: it sees the state, which holds the last actions of all agents. It is needed for learning alone,
//! so it takes nothing away from decentralised execution.

mod critic;
mod returns;
mod value;

pub use critic::{CentralCritic, CriticReport, CriticSettings, CriticState};
pub(crate) use critic::{broken_step, check_gradient, named_step};
pub use returns::{ReturnSettings, lambda_returns};
pub use value::ValueFunction;

/// What the names of the critic's parameters begin with.
const CRITIC: &str = "critic";
