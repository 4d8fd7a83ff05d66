//! What agents see of a battle, what they can do in it and what it pays: SMAC's interface and the local views of ours.

mod environment;
mod knowledge;
mod layout;
mod observation;
mod reward;
mod state_vector;
mod statistics;
mod view;

pub use environment::Skirmish;
pub use knowledge::SkirmishKnowledge;
pub use layout::Layout;
pub use statistics::BattleStatistics;
pub use view::{BattleTally, Face};

#[cfg(test)]
mod tests;
