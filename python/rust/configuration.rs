//! The settings that a caller names, laid over each other as the program lays them.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use mackrl_env::World;
use mackrl_run::{
    bounded,
    config::{Config, ConfigBuilder, EnvironmentConfig, registry},
    scenario_file::with_scenario,
};
use pyo3::prelude::*;

use crate::errors::{IntoException, configuration, learning};

/// Greatest length of a configuration in bytes, as for the program.
const FILE_MAX: usize = 2 << 20;

/// What is laid over the built-in values: a preset, a file, a map, then single settings.
#[pyclass(module = "mackrl._native", frozen)]
pub(crate) struct Layers {
    preset: Option<String>,
    file: Option<PathBuf>,
    map: Option<String>,
    /// What was typed, and the assignment that it means: ("sight_range=8", "env.sight_range=8").
    settings: Vec<(String, String)>,
}

#[pymethods]
impl Layers {
    #[new]
    #[pyo3(signature = (*, preset=None, file=None, map=None, settings=Vec::new()))]
    fn new(
        preset: Option<String>,
        file: Option<PathBuf>,
        map: Option<String>,
        settings: Vec<(String, String)>,
    ) -> Self {
        Self {
            preset,
            file,
            map,
            settings,
        }
    }

    /// The complete configuration, as JSON.
    fn resolved(&self) -> PyResult<String> {
        Ok(crate::json(&self.config()?))
    }

    /// Where the program would put the run.
    fn folder(&self) -> PyResult<PathBuf> {
        let config = self.config()?;
        let map = config.env.map();
        let map = map.rsplit_once(':').map_or(map, |(_, class)| class);
        let map = Path::new(map).file_stem().unwrap_or_default();
        let (algorithm, seed) = (config.algorithm.name(), config.run.seed);
        let name = format!("{}-{algorithm}-seed{seed}", map.display());
        Ok(Path::new("runs").join(name))
    }
}

impl Layers {
    fn builder(&self) -> PyResult<ConfigBuilder> {
        let mut builder = ConfigBuilder::new(registry());
        let wrong = |error| configuration(&error);
        if let Some(preset) = &self.preset {
            builder = builder.preset(preset).map_err(wrong)?;
        }
        if let Some(path) = &self.file {
            let text = bounded::read_text(path, FILE_MAX).map_err(IntoException::into_exception)?;
            let name = path.display().to_string();
            builder = builder.file(&name, &text).map_err(wrong)?;
        }
        if let Some(map) = &self.map {
            builder = builder.map(&format!("map={map:?}"), map);
        }
        for (typed, assignment) in &self.settings {
            builder = builder.flag(typed, assignment).map_err(wrong)?;
        }
        with_scenario(builder).map_err(IntoException::into_exception)
    }

    /// The configuration of a run.
    pub(crate) fn config(&self) -> PyResult<Config> {
        let config = self.builder()?.build();
        config.map_err(|error| configuration(&error))
    }

    /// The section `env`, where nothing is learnt.
    pub(crate) fn environment(&self) -> PyResult<EnvironmentConfig> {
        let env = self.builder()?.build_environment();
        env.map_err(|error| configuration(&error))
    }

    /// The world.
    pub(crate) fn world(&self) -> PyResult<Arc<dyn World>> {
        self.environment()?.world().map_err(learning)
    }
}
