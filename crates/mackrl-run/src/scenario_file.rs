//! Scenarios that a map's name in a configuration leads to.

use std::path::Path;

use mackrl_skirmish::custom::LENGTH_MAX;

use crate::{
    bounded,
    config::{ConfigBuilder, ConfigError},
    error::Result,
};

/// Lays the text of the scenario file that the map names, if it names one.
///
/// # Errors
/// As [`read_scenario`].
pub fn with_scenario(builder: ConfigBuilder) -> Result<ConfigBuilder> {
    match builder.missing_scenario() {
        Some(file) => Ok(builder.scenario(&read_scenario(Path::new(&file))?)),
        None => Ok(builder),
    }
}

/// Reads a scenario file, which may be anything: no more of it than a scenario may have.
///
/// # Errors
/// What the operating system says; [`ConfigError::Scenario`] if the file is empty or not UTF-8.
pub fn read_scenario(path: &Path) -> Result<String> {
    let bytes = bounded::read(path, LENGTH_MAX)?;
    if bytes.is_empty() {
        let message = format!(
            "{}:1:1: found an empty file, expected a scenario",
            path.display()
        );
        return Err(ConfigError::Scenario { message }.into());
    }
    bounded::text(&path.display().to_string(), bytes)
        .map_err(|message| ConfigError::Scenario { message }.into())
}
