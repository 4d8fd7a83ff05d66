//! The settings of a run: built-in values, presets, files and overrides.
//!
//! A run is described by one [`Config`], a plain value that is written into the run folder before the first step. It is put
//! together by a [`ConfigBuilder`] from layers, each of which may leave out what it does not change:
//!
//! ```text
//! built-in values  <  preset  <  file  <  --set key=value
//! ```
//!
//! Each value remembers which layer it came from, so that an error can name the file, the line and the key, and a print-out
//! can show the origin of every value. The alternative, merging the layers as text or as untyped tables and deserialising
//! once at the end, is shorter, but its errors cannot say where a value was written.
//!
//! A setting is declared once, in `sections.rs`, or with the world that it belongs to: its name, type, built-in value, accepted
//! values and meaning. Checks, error messages, name suggestions, explanations and the JSON schema all read that declaration.
//!
//! The number of threads is not part of a configuration, because it changes no result.

mod builder;
mod choices;
mod document;
mod environment;
mod error;
mod presets;
mod schema;
mod sections;
mod settings;

pub use builder::ConfigBuilder;
pub use choices::{Algorithm, Engine, OptimiserKind, PartitionChoice};
pub use document::{Leaf, SyntaxError, line_and_column, parse_document};
pub use environment::{EnvironmentConfig, world_names};
pub use error::{ConfigError, Origin, nearest};
pub use presets::{Preset, presets};
pub use schema::schema;
pub use sections::{Config, ExplorationConfig, LearnerConfig, PolicyConfig, RunConfig, TestConfig};
pub use settings::Setting;

pub use mackrl::{
    common_knowledge::CommonKnowledgeFeatures,
    objectives::LossAverage,
    policy::{Delegation, Selection},
};
