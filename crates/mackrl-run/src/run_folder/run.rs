//! Reading a run that was made earlier.

use std::path::{Path, PathBuf};

use super::{CONFIG, WEIGHTS, checkpoints, untrusted};
use crate::{
    bounded,
    config::{Config, ConfigBuilder, registry},
    error::{Result, RunError},
    training::assembly::tensors_bytes_max,
};

/// A run that was made earlier.
#[derive(Debug)]
pub struct Run {
    /// Its configuration.
    pub config: Config,
    /// Its weights as safetensors.
    pub weights: Vec<u8>,
    /// Where the weights lie.
    pub weights_path: PathBuf,
}

impl Run {
    /// Reads configuration and weights: those at the end of the run, or those of its latest checkpoint.
    ///
    /// # Errors
    /// [`RunError::NotARun`] if there is no configuration; otherwise what is wrong with which file.
    pub fn open(path: &Path) -> Result<Self> {
        untrusted::check(path)?;
        let config = read_config(path)?;
        let weights_path = path.join(WEIGHTS);
        if weights_path.exists() {
            return Self::with_weights(config, weights_path);
        }
        let (latest, _) = checkpoints::latest(path, tensors_bytes_max(&config)?)?;
        let stored = latest.ok_or_else(|| RunError::BadData {
            message: format!(
                "{} has no {WEIGHTS} and no checkpoint: the run has only begun",
                path.display()
            ),
        })?;
        Ok(Self {
            config,
            weights: stored.checkpoint.tensors,
            weights_path: checkpoints::weights_path(path, stored.number),
        })
    }

    /// Reads the configuration of the run at `path`, and weights from another place.
    ///
    /// # Errors
    /// As [`Run::open`].
    pub fn open_with_weights(path: &Path, weights: &Path) -> Result<Self> {
        untrusted::check(path)?;
        Self::with_weights(read_config(path)?, weights.to_owned())
    }

    fn with_weights(config: Config, weights_path: PathBuf) -> Result<Self> {
        let weights = bounded::read(&weights_path, tensors_bytes_max(&config)?)?;
        Ok(Self {
            config,
            weights,
            weights_path,
        })
    }
}

/// The configuration of the run at `path`.
pub(super) fn read_config(path: &Path) -> Result<Config> {
    let config_path = path.join(CONFIG);
    if !config_path.exists() {
        let folder = path.to_owned();
        return Err(RunError::NotARun { folder });
    }
    let text = bounded::read_text(&config_path, untrusted::TEXT_MAX)?;
    let config = ConfigBuilder::new(registry())
        .recorded(&config_path.display().to_string(), &text)?
        .build()?;
    Ok(config)
}
