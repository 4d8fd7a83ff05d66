//! Reading a run that was made earlier.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use anyhow::Context;
use mackrl::config::{Config, ConfigBuilder};

use super::{CONFIG, WEIGHTS, checkpoints, disk::cannot};
use crate::failure::Failure;

/// A run that was made earlier.
#[derive(Debug)]
pub(crate) struct Run {
    /// Its configuration.
    pub(crate) config: Config,
    /// Its weights as safetensors.
    pub(crate) weights: Vec<u8>,
    /// Where the weights lie.
    pub(crate) weights_path: PathBuf,
}

impl Run {
    /// Reads configuration and weights: those at the end of the run, or those of its latest checkpoint.
    ///
    /// # Errors
    /// [`Failure::NotARun`] if there is no configuration; otherwise what is wrong with which file.
    pub(crate) fn open(path: &Path) -> anyhow::Result<Self> {
        let config = read_config(path)?;
        let weights_path = path.join(WEIGHTS);
        if weights_path.exists() {
            return Self::with_weights(config, weights_path);
        }
        let (latest, _) = checkpoints::latest(path)?;
        let stored = latest.ok_or_else(|| Failure::BadData {
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
    pub(crate) fn open_with_weights(path: &Path, weights: &Path) -> anyhow::Result<Self> {
        Self::with_weights(read_config(path)?, weights.to_owned())
    }

    fn with_weights(config: Config, weights_path: PathBuf) -> anyhow::Result<Self> {
        let weights = fs::read(&weights_path).with_context(|| cannot("read", &weights_path))?;
        Ok(Self {
            config,
            weights,
            weights_path,
        })
    }
}

/// The configuration of the run at `path`.
pub(super) fn read_config(path: &Path) -> anyhow::Result<Config> {
    let config_path = path.join(CONFIG);
    let text = match fs::read_to_string(&config_path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let folder = path.to_owned();
            return Err(Failure::NotARun { folder }.into());
        }
        text => text.with_context(|| cannot("read", &config_path))?,
    };
    let config = ConfigBuilder::new()
        .file(&config_path.display().to_string(), &text)?
        .build()?;
    Ok(config)
}
