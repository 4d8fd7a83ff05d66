//! What judges, and what it learns from: V(state, last actions) of the team, a value of each member that reads what the member
//! sees as well, or a mixture of what members expect of their choices.
//!
//! A critic may be central and see the state, which holds the last actions of all agents. It is needed for learning alone,
//! so it takes nothing away from decentralised execution.

mod central;
mod members;
mod mixers;
mod team;

pub use central::{CentralCritic, CriticMinibatch, CriticReport, CriticSettings, CriticState};
pub use members::{MemberCritic, MemberCriticSettings, MemberRows};
pub use mixers::{Mixer, Monotonic, MonotonicSizes, MonotonicTrace, MonotonicWeights};
pub use team::{ReturnScale, TeamCritic, TeamCriticSettings, ValueInputs};

/// What the names of the critic's parameters begin with.
const CRITIC: &str = "critic";
