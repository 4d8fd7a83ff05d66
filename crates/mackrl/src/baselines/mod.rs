//! Central-V: the learner that MACKRL is measured against.
//!
//! Everything is MACKRL's but the hierarchy: each agent chooses alone from its own history, p(u) is the product of their
//! probabilities, and the same central critic judges. MACKRL whose pairs always delegate equals it.

mod central_v;

pub use central_v::CentralV;
