//! What can be wrong with the files and settings of a skirmish.

use thiserror::Error;

use crate::custom::ScenarioProblem;

/// Why a skirmish could not be set up.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SkirmishError {
    /// A file of unit statistics is broken.
    #[error("unit statistics: {0}")]
    UnitFile(String),
    /// The file of what the real game does is broken.
    #[error("reference values of the real game: {0}")]
    ReferenceFile(String),
    /// A map file is broken.
    #[error("map `{map}`: {problem}")]
    MapFile {
        /// Name of the map.
        map: String,
        /// What was found and what was expected.
        problem: String,
    },
    /// A scenario that a user wrote is broken.
    #[error("{file}:{problem}")]
    Scenario {
        /// The file, as the user named it.
        file: String,
        /// What is wrong, and where.
        problem: ScenarioProblem,
    },
    /// A setting has a value outside its range.
    #[error("setting `{key}` is {found}, expected {expected}")]
    Setting {
        /// Name of the setting.
        key: &'static str,
        /// Its value.
        found: String,
        /// What it may be.
        expected: String,
    },
}
