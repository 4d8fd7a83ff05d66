//! A run of MACKRL: its configuration, the loop that trains a team, what is kept of it, and replays of what it did.
//!
//! The crate [`mackrl`] holds the paper and writes no file. This one brings worlds, policies and learners together
//! ([`training`]) as a configuration ([`config`]) describes them, and records episodes that can be played again ([`replay`]).

mod apart;
mod batch_system;
pub mod bounded;
pub mod config;
pub mod folder;
pub mod number;
pub mod provenance;
pub mod recorded;
pub mod replay;
pub mod run_folder;
pub mod scenario_file;
pub mod stop_request;
pub mod sweep;
pub mod training;
pub mod training_loop;

mod error;

pub use error::{Result, RunError};
pub use mackrl::{Error, NotFinite};

/// Compiles and runs the examples of README.md.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeExamples;
