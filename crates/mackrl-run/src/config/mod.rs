//! The settings of a run: built-in values, presets, files and overrides.
//!
//! A run is described by one [`Config`], a plain value that is written into the run folder before the first step. It names a
//! world and an algorithm, each with a table of the settings that *it* declares, and holds the settings of the run itself.
//! It is put together by a [`ConfigBuilder`] from layers, each of which may leave out what it does not change:
//!
//! ```text
//! built-in values  <  preset  <  file  <  --set key=value
//! ```
//!
//! Which settings there are depends on the names of the world and of the algorithm, and any layer may change those. So layers
//! are collected first, each value with the place where it was written, and resolved together: an error can name the file,
//! the line and the key, and a print-out can show the origin of every value. The alternative, merging the layers as untyped
//! tables and deserialising once at the end, is shorter, but its errors cannot say where a value was written.
//!
//! A setting is declared once, where it acts: its name, type, built-in value, accepted values and meaning. Checks, error
//! messages, name suggestions, explanations and the JSON schema all read that declaration. The kinds of worlds and of
//! algorithms that can be named stand in a [`Registry`], to which programs add their own.
//!
//! The number of threads is not part of a configuration, because it changes no result.

mod builder;
mod document;
mod environment;
mod error;
mod registry;
mod renamed;
mod schema;
mod sections;
mod selected;
mod star_craft;

pub use builder::{ConfigBuilder, Resolved};
pub use document::{Leaf, SyntaxError, line_and_column, parse_document};
pub use environment::EnvironmentConfig;
pub use error::{ConfigError, Origin, nearest};
pub use registry::{Registry, registry, remark};
pub use schema::schema;
pub use sections::{AlgorithmConfig, Config, RunConfig, Setting, TestConfig};
pub use selected::{Kind, Selected};
pub use star_craft::{STAR_CRAFT, StarCraftKind};

pub use mackrl::algorithms::Preset;
