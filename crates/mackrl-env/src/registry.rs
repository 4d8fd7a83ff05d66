//! Every environment by its name.

use std::{ffi::OsStr, path::Path, sync::Arc};

use thiserror::Error;

use crate::{
    Environment,
    matrix_game::{InvalidProbability, MatrixGame, MatrixGameSettings},
    skirmish::{
        Scenario, Skirmish, SkirmishError, SkirmishSettings, custom, scenario,
        unit_types::UnitTypes,
    },
};

/// The matrix game's name; all other names are those of skirmishes.
pub const MATRIX_GAME: &str = "matrix-game";

/// Why an environment could not be built.
#[derive(Debug, Clone, PartialEq, Error)]
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
    /// The matrix game could not be set up.
    #[error(transparent)]
    MatrixGame(#[from] InvalidProbability),
}

/// Names of SMAC's maps, in the order in which they are listed to users.
#[must_use]
pub fn map_names() -> Vec<&'static str> {
    scenario::map_names()
}

/// Names of all environments, in the order in which they are listed to users: [`map_names`], then [`MATRIX_GAME`].
#[must_use]
pub fn names() -> Vec<&'static str> {
    let mut names = map_names();
    names.push(MATRIX_GAME);
    names
}

/// Builds the environment called `name`. `settings` concern skirmishes only; the matrix game has its own
/// ([`make_matrix_game`]) and is built with their defaults here.
///
/// # Errors
/// [`MakeError::UnknownName`] with the nearest name, or what is wrong with the settings.
pub fn make(name: &str, settings: &SkirmishSettings) -> Result<Box<dyn Environment>, MakeError> {
    if name == MATRIX_GAME {
        return Ok(Box::new(make_matrix_game(MatrixGameSettings::default())?));
    }
    Ok(Box::new(make_skirmish(name, settings)?))
}

/// Builds the matrix game.
///
/// # Errors
/// [`MakeError::MatrixGame`] if the probability of common knowledge is not in [0, 1].
pub fn make_matrix_game(settings: MatrixGameSettings) -> Result<MatrixGame, MakeError> {
    Ok(MatrixGame::new(settings)?)
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

fn nearest_name(name: &str) -> &'static str {
    // Comparing takes time and memory proportional to the length, and no name is longer than this.
    let name: String = name.chars().take(100).collect();
    names()
        .into_iter()
        .min_by_key(|candidate| strsim::damerau_levenshtein(candidate, &name))
        .unwrap_or_default()
}
