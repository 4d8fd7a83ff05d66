//! What a run leaves on disk.
//!
//! ```text
//! DIR/config.toml           everything that determines the result; written before the first step
//! DIR/run.json              command line, version, status
//! DIR/metrics.jsonl         one JSON object a line
//! DIR/weights.safetensors   the policy and the critic
//! ```
//!
//! A folder belongs to one run for ever: nothing in it is overwritten by another. Files that are replaced (`run.json`,
//! `weights.safetensors`) are replaced atomically, so that whoever reads them finds the old content or the new.

mod atomic;

use std::{
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::Context;
use mackrl::config::{Config, ConfigBuilder};
use serde::{Deserialize, Serialize};

use crate::failure::Failure;

const CONFIG: &str = "config.toml";
const METRICS: &str = "metrics.jsonl";
const RUN: &str = "run.json";
const WEIGHTS: &str = "weights.safetensors";

/// How far a run has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Status {
    /// Training goes on, or was interrupted without a chance to say so.
    Running,
    /// Training reached its end.
    Finished,
    /// Training stopped with an error.
    Failed,
}

/// What `run.json` tells: facts that do not determine the result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct RunRecord {
    /// The command line, word by word.
    command: Vec<String>,
    /// Version of this program.
    version: String,
    /// Seed of the run, also in `config.toml`.
    seed: u64,
    /// Threads in use, which change no result.
    threads: usize,
    status: Status,
}

/// The folder of a run that is being made.
#[derive(Debug)]
pub(crate) struct RunFolder {
    path: PathBuf,
    metrics: File,
    record: RunRecord,
}

impl RunFolder {
    /// Refuses a path that cannot become a run folder, without touching anything.
    ///
    /// # Errors
    /// [`Failure::FolderInUse`] if something lies there already.
    pub(crate) fn check_free(path: &Path) -> anyhow::Result<()> {
        let mut entries = match fs::read_dir(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            entries => entries.with_context(|| cannot("use", path))?,
        };
        if entries.next().is_none() {
            return Ok(());
        }
        let holds = match recorded_status(path) {
            Some(Status::Finished) => "a finished run",
            Some(_) => "an unfinished run",
            None if path.join(CONFIG).exists() => "a run",
            None => "other files",
        };
        Err(Failure::FolderInUse {
            folder: path.to_owned(),
            holds: holds.to_owned(),
        }
        .into())
    }

    /// Creates the folder of a new run, with its configuration and an empty list of metrics.
    ///
    /// # Errors
    /// [`Failure::FolderInUse`] if something lies there already; otherwise the path that could not be written.
    pub(crate) fn create(path: &Path, config: &Config, threads: usize) -> anyhow::Result<Self> {
        Self::check_free(path)?;
        fs::create_dir_all(path).with_context(|| cannot("create", path))?;
        let new = |name: &str| {
            let path = path.join(name);
            File::create_new(&path).with_context(|| cannot("create", &path))
        };
        // Whoever creates this file first owns the folder.
        let mut file = new(CONFIG)?;
        file.write_all(config.to_toml().as_bytes())
            .and_then(|()| file.sync_all())
            .with_context(|| cannot("write", &path.join(CONFIG)))?;
        let mut folder = Self {
            path: path.to_owned(),
            metrics: new(METRICS)?,
            record: RunRecord {
                command: std::env::args().collect(),
                version: env!("CARGO_PKG_VERSION").to_owned(),
                seed: config.run.seed,
                threads,
                status: Status::Running,
            },
        };
        folder.set_status(Status::Running)?;
        Ok(folder)
    }

    /// Where it lies.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Adds one line to the metrics.
    pub(crate) fn append_metrics(&mut self, object: &str) -> anyhow::Result<()> {
        debug_assert!(!object.contains('\n'), "a row of metrics is one line");
        self.metrics
            .write_all(format!("{object}\n").as_bytes())
            .with_context(|| cannot("write", &self.path.join(METRICS)))
    }

    /// Puts the weights in place of earlier ones.
    pub(crate) fn write_weights(&self, weights: &[u8]) -> anyhow::Result<()> {
        self.replace(WEIGHTS, weights)
    }

    /// Records how far the run has come.
    pub(crate) fn set_status(&mut self, status: Status) -> anyhow::Result<()> {
        self.record.status = status;
        let json = serde_json::to_string_pretty(&self.record)?;
        self.replace(RUN, (json + "\n").as_bytes())
    }

    fn replace(&self, name: &str, content: &[u8]) -> anyhow::Result<()> {
        let path = self.path.join(name);
        atomic::replace(&path, content)
            .with_context(|| format!("{} ({} bytes)", cannot("write", &path), content.len()))
    }
}

/// A run that was made earlier.
#[derive(Debug)]
pub(crate) struct Run {
    /// Its configuration.
    pub(crate) config: Config,
    /// Its weights as safetensors.
    pub(crate) weights: Vec<u8>,
}

impl Run {
    /// Reads configuration and weights.
    ///
    /// # Errors
    /// [`Failure::NotARun`] if there is no configuration; otherwise what is wrong with which file.
    pub(crate) fn open(path: &Path) -> anyhow::Result<Self> {
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
        let weights_path = path.join(WEIGHTS);
        let weights = match fs::read(&weights_path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let message = format!(
                    "{} has no {WEIGHTS}: the run did not reach its end",
                    path.display()
                );
                return Err(Failure::BadData { message }.into());
            }
            weights => weights.with_context(|| cannot("read", &weights_path))?,
        };
        Ok(Self { config, weights })
    }
}

fn recorded_status(path: &Path) -> Option<Status> {
    let text = fs::read_to_string(path.join(RUN)).ok()?;
    let record: RunRecord = serde_json::from_str(&text).ok()?;
    Some(record.status)
}

fn cannot(verb: &str, path: &Path) -> String {
    format!("cannot {verb} {}", path.display())
}

#[cfg(test)]
mod tests;
