//! A run of MACKRL: its configuration, the loop that trains a team, what is kept of it, and replays of what it did.
//!
//! The crate [`mackrl`] holds the paper and writes no file. This one brings worlds, policies and learners together
//! ([`training`]) as a configuration ([`config`]) describes them, and records episodes that can be played again ([`replay`]).
//!
//! # Examples
//! ```
//! use mackrl_run::{
//!     config::{ConfigBuilder, Registry},
//!     training::Trainer,
//! };
//!
//! let config = ConfigBuilder::new(&Registry::built_in())
//!     .preset("paper")?
//!     .set("env.map=3m")?
//!     .set("run.steps_env=500")?
//!     .build()?;
//! let mut trainer = Trainer::new(&config, 1)?;
//! while !trainer.finished() {
//!     if let Some(row) = trainer.update()? {
//!         println!("{:?}", row.get("test_battle_won_mean"));
//!     }
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
