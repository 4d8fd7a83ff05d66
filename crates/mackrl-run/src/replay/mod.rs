//! Episodes on disk that can be played again, looked into and trusted.
//!
//! A [`Replay`] holds what cannot be derived: the world's settings (with the text of a scenario, if it is one), the name of the
//! episode, everybody's actions, and what the controllers computed ([`Thought`]). States are not stored. [`Replay::play`]
//! simulates the battle again and compares a hash of the state after every step, so what is shown is what happened, and a
//! file of many megabytes becomes one of a few kilobytes. The price is that a replay needs the simulator that it was recorded
//! with; it names its version and is refused by any other.
//!
//! [`GroupKnowledge`] answers, for any group at any step, what is commonly known, what is known to all without being common
//! knowledge, what is private, and why.

mod file;
mod knowledge;
mod names;
mod page;
mod playback;
mod recording;
mod shots;
mod summary;

use mackrl_env::{Action, EpisodeKey};
use mackrl_skirmish::scripted::ScriptedPolicy;
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use self::{
    knowledge::{GroupKnowledge, PrivateKnowledge, living_groups},
    names::Names,
    page::page,
    playback::{Moment, Playback},
    recording::{record_policy, record_script},
    shots::{Shot, shot},
    summary::{Summary, outcome_in_words},
};
use mackrl::policy::{Behaviour, Thought};

use crate::config::EnvironmentConfig;

/// Most steps of a replay; all states of so many steps of the largest map fit into a few hundred megabytes.
pub const STEPS_MOST: usize = 20_000;

/// An episode, with all that is needed to play it again.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// Version of the program that recorded it.
    pub program: String,
    /// The world. A scenario's text is part of it.
    pub env: EnvironmentConfig,
    /// Which episode it was.
    pub key: EpisodeKey,
    /// Who played.
    pub player: Player,
    /// What happened, at most [`STEPS_MOST`].
    pub steps: Vec<Step>,
}

/// Who plays the team.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind", deny_unknown_fields)]
pub enum Player {
    /// A script.
    Script {
        /// Which.
        policy: ScriptedPolicy,
    },
    /// A policy that was learnt.
    Policy {
        /// How it learnt.
        algorithm: String,
        /// How it chose.
        behaviour: Behaviour,
    },
    /// Another program, through StarCraft II's API.
    Client,
}

/// One step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// What everybody did \[N\].
    pub actions: Vec<Action>,
    /// Hash of the state after the step, in hexadecimal.
    pub state_hash: String,
    /// V(s) of the state before the step, if there is a critic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f32>,
    /// What the controllers computed, if there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thought: Option<Thought>,
}

/// Why a replay cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The bytes are no replay, or a damaged one.
    #[error("{0}")]
    Damaged(String),
    /// Another simulator would play another battle.
    #[error(
        "recorded by mackrl {program} with simulator version {recorded}, this program has version {own}"
    )]
    OtherSimulator {
        /// Version of the program that plays it.
        program: String,
        /// Version of its simulator.
        recorded: u32,
        /// Version of this simulator.
        own: u32,
    },
    /// The battle did not go as recorded.
    #[error("first differs after step {step}: state {found}, recorded {recorded}")]
    Differs {
        /// The step, from 1.
        step: usize,
        /// Hash of the state that was reached.
        found: String,
        /// Hash that stands in the file.
        recorded: String,
    },
}

impl Player {
    /// The name of the script or of the algorithm.
    #[must_use]
    pub fn name(&self) -> String {
        let name = match self {
            Self::Script { policy } => serde_json::to_value(policy),
            Self::Policy { algorithm, .. } => serde_json::to_value(algorithm),
            Self::Client => Ok("client".into()),
        };
        let name = name.ok().and_then(|name| name.as_str().map(str::to_owned));
        name.unwrap_or_default()
    }
}

/// A hash as it is written.
fn hexadecimal(hash: u64) -> String {
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests;
