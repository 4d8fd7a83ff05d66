//! Skirmishes by the names of their maps.

use std::{ffi::OsStr, path::Path, sync::Arc};

use thiserror::Error;

use crate::{
    Scenario, Skirmish, SkirmishError, SkirmishSettings, custom, scenario, unit_types::UnitTypes,
};

/// Why a skirmish could not be built.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MakeError {
    /// Nothing has this name.
    #[error("no map is called `{name}`")]
    UnknownName {
        /// What was asked for.
        name: String,
        /// The name that differs least from it.
        nearest: &'static str,
    },
    /// The skirmish could not be set up.
    #[error(transparent)]
    Skirmish(#[from] SkirmishError),
}

/// Names of SMAC's maps, in the order in which they are listed to users.
#[must_use]
pub fn map_names() -> Vec<&'static str> {
    scenario::map_names()
}

/// Builds the skirmish on the map called `name`.
///
/// # Errors
/// [`MakeError::UnknownName`] with the nearest name, or what is wrong with the settings.
pub fn make(name: &str, settings: &SkirmishSettings) -> Result<Skirmish, MakeError> {
    let units = UnitTypes::load(settings.units)?;
    let scenario = Scenario::shipped(name, &units).ok_or_else(|| MakeError::UnknownName {
        name: name.to_owned(),
        nearest: nearest_name(name),
    })??;
    Ok(Skirmish::new(Arc::new(scenario), settings.clone())?)
}

/// Builds the skirmish of the scenario `text` that a user wrote; `file` is what errors call it, and its stem names the world.
///
/// # Errors
/// [`SkirmishError::Scenario`] with line and column, or what is wrong with the settings.
pub fn make_custom(
    file: &str,
    text: &str,
    settings: &SkirmishSettings,
) -> Result<Skirmish, MakeError> {
    let units = UnitTypes::load(settings.units)?;
    let stem = Path::new(file).file_stem().and_then(OsStr::to_str);
    let scenario = custom::parse(stem.unwrap_or(file), text, &units).map_err(|problem| {
        SkirmishError::Scenario {
            file: file.to_owned(),
            problem,
        }
    })?;
    Ok(Skirmish::new(Arc::new(scenario), settings.clone())?)
}

fn nearest_name(name: &str) -> &'static str {
    // Comparing takes time and memory proportional to the length, and no name is longer than this.
    let name: String = name.chars().take(100).collect();
    map_names()
        .into_iter()
        .min_by_key(|candidate| strsim::damerau_levenshtein(candidate, &name))
        .unwrap_or_default()
}
