//! What judges: V(state, last actions), and what it learns from.
//!
//! The critic is central: it sees the state, which holds the last actions of all agents. It is needed for learning alone,
//! so it takes nothing away from decentralised execution.

mod central;

pub use central::{CentralCritic, CriticMinibatch, CriticReport, CriticSettings, CriticState};

/// What the names of the critic's parameters begin with.
const CRITIC: &str = "critic";
