//! Every environment by its name.

use std::{ffi::OsStr, path::Path, sync::Arc};

use thiserror::Error;

use crate::{
    Environment, EnvironmentSpec,
    skirmish::{
        Scenario, Skirmish, SkirmishError, SkirmishSettings, custom, scenario,
        unit_types::UnitTypes,
    },
};

/// Why an environment could not be built.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MakeError {
    /// Nothing has this name.
    #[error("no environment is called `{name}`")]
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

/// Names of all environments, in the order in which they are listed to users.
#[must_use]
pub fn names() -> Vec<&'static str> {
    scenario::map_names()
}

/// Builds the environment called `name`; `settings` concern skirmishes only.
///
/// # Errors
/// [`MakeError::UnknownName`] with the nearest name, or what is wrong with the settings.
pub fn make(name: &str, settings: &SkirmishSettings) -> Result<Box<dyn Environment>, MakeError> {
    Ok(Box::new(make_skirmish(name, settings)?))
}

/// Builds the skirmish on the map called `name`.
///
/// # Errors
/// [`MakeError::UnknownName`] with the nearest name, or what is wrong with the settings.
pub fn make_skirmish(name: &str, settings: &SkirmishSettings) -> Result<Skirmish, MakeError> {
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

/// Sizes and limits of all environments, in the order of [`names`].
///
/// # Errors
/// As [`make`].
pub fn specs(settings: &SkirmishSettings) -> Result<Vec<EnvironmentSpec>, MakeError> {
    names()
        .into_iter()
        .map(|name| Ok(make(name, settings)?.spec().clone()))
        .collect()
}

fn nearest_name(name: &str) -> &'static str {
    names()
        .into_iter()
        .min_by_key(|candidate| strsim::damerau_levenshtein(candidate, name))
        .unwrap_or_default()
}
