//! StarCraft micromanagement: the rules of battle and their reinforcement-learning face.
//!
//! The rules ([`rules`]) know units, orders, weapons and walls; the face ([`Skirmish`]) shows them to agents as SMAC does
//! (Samvelyan and others, "The StarCraft Multi-Agent Challenge", 2019) and adds the local views of [`mackrl_env::Environment`].
//! Unit statistics and maps are data ([`unit_types`], [`scenario`]), read from the files under `units/` and `maps/`.

mod actions;
pub mod custom;
mod encounter;
pub mod error;
mod face;
pub mod fidelity;
mod kind;
mod paths;
mod registry;
pub mod rules;
pub mod scenario;
pub mod scripted;
mod settings;
pub mod terrain;
pub mod unit_types;

pub use encounter::Encounter;
pub use error::SkirmishError;
pub use face::{BattleStatistics, BattleTally, Face, Layout, Skirmish, SkirmishKnowledge};
pub use kind::{PlaceSettings, SKIRMISH, SkirmishKind};
pub use registry::{MakeError, make, make_custom, map_names};
pub use scenario::Scenario;
pub use settings::{Compatibility, EnemyBehaviour, SkirmishSettings};
pub use unit_types::UnitData;

/// Version of the rules and of their data: one key and the same actions give the same battle in every program with this number.
///
/// It is raised whenever `tests/golden/skirmish_hashes.txt` is recorded anew.
pub const SIMULATOR_VERSION: u32 = 3;
