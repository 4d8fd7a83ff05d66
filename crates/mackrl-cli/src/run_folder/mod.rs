//! What a run leaves on disk.
//!
//! ```text
//! DIR/config.toml           everything that determines the result; written before the first step
//! DIR/run.json              command line, provenance, status
//! DIR/metrics.jsonl         one JSON object a line
//! DIR/checkpoints/          the latest few, from which the run continues
//! DIR/weights.safetensors   the policy and the critic; written at the end
//! DIR/events.out.tfevents.* the metrics for TensorBoard, if `run.tensorboard` is set; one file for each process that trained
//! DIR/lock                  held by the process that writes
//! ```
//!
//! A folder belongs to one run for ever, and has one writer at a time. Files that are replaced are replaced atomically, so that
//! whoever reads them finds the old content or the new. Metrics are synced before the checkpoint that counts them, and cut back
//! to a checkpoint when the run continues from it: each row stands there once.

mod checkpoints;
mod disk;
mod event_file;
mod latest;
mod manifest;
mod recorded;
mod run;
mod untrusted;

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io,
    path::{Path, PathBuf},
};

use anyhow::Context;
use checkpoints::Surroundings;
use disk::{Disk, RealDisk, cannot, cannot_write};
use mackrl::nn::InstructionSet;
use mackrl_run::{
    config::Config,
    training::{Checkpoint, assembly::tensors_bytes_max},
};
use serde::{Deserialize, Serialize};

use crate::{
    bounded,
    failure::Failure,
    provenance::{CODE, Provenance},
};
use event_file::EventFile;
pub(crate) use latest::{LatestRow, latest_row};
use manifest::{Fingerprint, Growing};
pub(crate) use recorded::{Recorded, Row, timeless};
pub(crate) use run::Run;

const CONFIG: &str = "config.toml";
pub(crate) const METRICS: &str = "metrics.jsonl";
const RUN: &str = "run.json";
const WEIGHTS: &str = "weights.safetensors";
const LOCK: &str = "lock";
const CHECKPOINTS: &str = "checkpoints";

/// How far a run has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Status {
    /// Training goes on, or was interrupted without a chance to say so.
    Running,
    /// Training reached its end.
    Finished,
    /// Training stopped because it was asked to.
    Interrupted,
    /// Training stopped with an error.
    Failed,
}

/// What `run.json` tells: where the result comes from, and facts that do not determine it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct RunRecord {
    /// The command line, word by word.
    command: Vec<String>,
    /// Where the run's results come from: one entry, or one for each version of this program that went on with it, in their
    /// order.
    #[serde(default)]
    provenance: Vec<Provenance>,
    /// Threads in use, which change no result.
    threads: usize,
    /// Instruction set in use, which changes no result.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    simd: Option<String>,
    status: Status,
}

/// The folder of a run that is being made.
#[derive(Debug)]
pub(crate) struct RunFolder {
    path: PathBuf,
    disk: Box<dyn Disk>,
    config: Fingerprint,
    metrics: File,
    metrics_so_far: Growing,
    events: Option<EventFile>,
    checkpoints_kept: usize,
    record: RunRecord,
    /// Nobody else writes while this is open.
    _lock: File,
}

/// A run that goes on.
#[derive(Debug)]
pub(crate) struct Resumption {
    pub(crate) folder: RunFolder,
    pub(crate) config: Config,
    /// Where it goes on; a run that was interrupted before its first checkpoint begins again.
    pub(crate) checkpoint: Option<Checkpoint>,
    /// Later checkpoints that could not be used, and why.
    pub(crate) damaged: Vec<String>,
    /// The code that made the run so far, if it is not that of this program.
    pub(crate) earlier_code: Option<String>,
}

impl RunFolder {
    /// Refuses a path that cannot become a run folder, without touching anything.
    ///
    /// # Errors
    /// [`Failure::FolderInUse`] if something lies there already.
    pub(crate) fn check_free(path: &Path) -> anyhow::Result<()> {
        let entries = match fs::read_dir(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            entries => entries.with_context(|| cannot("use", path))?,
        };
        // What stands in the folder of a run that was killed before it had a configuration.
        let unborn = [PathBuf::from(LOCK), disk::temporary(Path::new(CONFIG))];
        let names: Vec<_> = entries
            .map(|entry| Ok(entry?.file_name()))
            .collect::<io::Result<_>>()
            .with_context(|| cannot("read", path))?;
        if names
            .iter()
            .all(|name| unborn.iter().any(|own| own == name))
        {
            return Ok(());
        }
        let folder = path.to_owned();
        Err(match recorded_status(path) {
            Some(Status::Finished) => Failure::FolderInUse {
                folder,
                holds: "a finished run".to_owned(),
            },
            _ if path.join(CONFIG).exists() => Failure::UnfinishedRun { folder },
            _ => Failure::FolderInUse {
                folder,
                holds: "other files".to_owned(),
            },
        }
        .into())
    }

    /// Creates the folder of a new run, with its configuration and an empty list of metrics.
    ///
    /// # Errors
    /// [`Failure::FolderInUse`] or [`Failure::UnfinishedRun`] if something lies there already, [`Failure::FolderLocked`] if
    /// another process writes there; otherwise the path that could not be written.
    pub(crate) fn create(path: &Path, config: &Config, threads: usize) -> anyhow::Result<Self> {
        Self::check_free(path)?;
        fs::create_dir_all(path).with_context(|| cannot("create", path))?;
        let lock = lock(path)?;
        // Somebody else may have been quicker, and be done already.
        Self::check_free(path)?;
        disk::replace(&RealDisk, &path.join(CONFIG), config.to_toml().as_bytes())?;
        Self::open(path, config, threads, lock, Growing::default())
    }

    /// Creates the folder of a new run for another process to make: with its configuration, and nothing else.
    ///
    /// # Errors
    /// As [`RunFolder::create`].
    pub(crate) fn prepare(path: &Path, config: &Config, threads: usize) -> anyhow::Result<()> {
        Self::create(path, config, threads)?.set_status(Status::Interrupted)
    }

    /// Whether a process writes there now.
    pub(crate) fn is_in_use(path: &Path) -> bool {
        let lock = File::open(path.join(LOCK));
        lock.is_ok_and(|lock| matches!(lock.try_lock(), Err(TryLockError::WouldBlock)))
    }

    /// Whether the run there has reached its end.
    pub(crate) fn is_finished(path: &Path) -> bool {
        recorded_status(path) == Some(Status::Finished)
    }

    /// Opens the folder of an unfinished run at its latest checkpoint. What was written after it is removed: it will be written
    /// again.
    ///
    /// # Errors
    /// [`Failure::NotARun`], [`Failure::FolderLocked`] if another process writes there, [`Failure::BadData`] if no checkpoint can be used; otherwise the path that could not be read or written.
    pub(crate) fn resume(path: &Path, threads: usize) -> anyhow::Result<Resumption> {
        untrusted::check(path)?;
        let config = run::read_config(path)?;
        let lock = lock(path)?;
        let record = read_record(path);
        let earlier_code = record
            .map(|record| match record.provenance.last() {
                Some(provenance) => provenance.code.clone(),
                None => "of an early version".to_owned(),
            })
            .filter(|code| code != CODE);
        let (latest, damaged) = checkpoints::latest(path, tensors_bytes_max(&config)?)?;
        checkpoints::tidy(&RealDisk, path, latest.as_ref().map(|stored| stored.number))?;
        let (metrics, checkpoint) = latest
            .map(|stored| (stored.metrics, stored.checkpoint))
            .unzip();
        let metrics = metrics.unwrap_or_default();
        Ok(Resumption {
            folder: Self::open(path, &config, threads, lock, metrics)?,
            config,
            checkpoint,
            damaged,
            earlier_code,
        })
    }

    /// Opens the folder with these metrics.
    fn open(
        path: &Path,
        config: &Config,
        threads: usize,
        lock: File,
        metrics_so_far: Growing,
    ) -> anyhow::Result<Self> {
        let config_path = path.join(CONFIG);
        let config_text = bounded::read(&config_path, untrusted::TEXT_MAX)?;
        let metrics = open_metrics(&path.join(METRICS), metrics_so_far.bytes())?;
        let mut record = read_record(path).unwrap_or_else(|| RunRecord {
            command: std::env::args().collect(),
            provenance: Vec::new(),
            threads,
            simd: None,
            status: Status::Running,
        });
        record.threads = threads;
        record.simd = Some(InstructionSet::chosen()?.name().to_owned());
        let provenance = Provenance::of_run(config);
        if !record.provenance.contains(&provenance) {
            record.provenance.push(provenance);
        }
        let mut folder = Self {
            path: path.to_owned(),
            disk: Box::new(RealDisk),
            config: Fingerprint::of(&config_text),
            metrics,
            metrics_so_far,
            events: None,
            checkpoints_kept: config.run.checkpoints_kept,
            record,
            _lock: lock,
        };
        folder.set_status(Status::Running)?;
        Ok(folder)
    }

    /// Where it lies.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Begins an event file for TensorBoard, in which rows of metrics stand from now on; the run has played `steps_env`
    /// environment steps, of which it has told already.
    pub(crate) fn write_events(&mut self, steps_env: u64) -> anyhow::Result<()> {
        let forgotten_from = if steps_env == 0 { 0 } else { steps_env + 1 };
        let events = EventFile::create(&*self.disk, &self.path, forgotten_from)?;
        self.events = Some(events);
        Ok(())
    }

    /// Adds one line to the metrics.
    pub(crate) fn append_metrics(&mut self, object: &str) -> anyhow::Result<()> {
        debug_assert!(!object.contains('\n'), "a row of metrics is one line");
        let line = format!("{object}\n");
        self.disk
            .write(&mut self.metrics, line.as_bytes())
            .with_context(|| cannot_write(&self.path.join(METRICS), line.len()))?;
        self.metrics_so_far.append(line.as_bytes());
        if let Some(events) = &mut self.events {
            events.append(&*self.disk, object)?;
        }
        Ok(())
    }

    /// Writes the checkpoint with this number, after the metrics that belong to it, and removes old ones.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says; earlier checkpoints are intact then.
    pub(crate) fn write_checkpoint(
        &mut self,
        number: u64,
        checkpoint: &Checkpoint,
    ) -> anyhow::Result<()> {
        self.disk
            .sync(&self.metrics)
            .with_context(|| cannot("sync", &self.path.join(METRICS)))?;
        let surroundings = self.surroundings();
        checkpoints::write(
            &*self.disk,
            &self.path,
            (number, checkpoint),
            surroundings,
            self.checkpoints_kept,
        )
    }

    fn surroundings(&self) -> Surroundings {
        Surroundings {
            config: self.config.clone(),
            metrics: self.metrics_so_far.fingerprint(),
        }
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
        disk::replace(&*self.disk, &self.path.join(name), content)
    }
}

/// What can be said of a run without its weights.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Description {
    /// How far it has come.
    pub(crate) status: Status,
    /// Where its results come from: one entry for each version of the program that went on with it.
    pub(crate) provenance: Vec<Provenance>,
}

/// Whether a run lies in this folder.
pub(crate) fn is_run(path: &Path) -> bool {
    path.join(CONFIG).is_file()
}

/// Reads the configuration of the run at `path`, and what can be said of it.
///
/// # Errors
/// [`Failure::NotARun`] if there is no configuration; otherwise what is wrong with it.
pub(crate) fn read_description(path: &Path) -> anyhow::Result<(Config, Description)> {
    let config = run::read_config(path)?;
    let (status, mut provenance) = read_record(path)
        .map_or((Status::Running, Vec::new()), |record| {
            (record.status, record.provenance)
        });
    if provenance.is_empty() {
        // Early versions did not say.
        provenance.push(Provenance::of_unknown_code(&config));
    }
    Ok((config, Description { status, provenance }))
}

/// Puts `content` at `path`: whoever reads there, and whenever power is lost, finds the old content or the new.
///
/// # Errors
/// Path, bytes and what the operating system says; the file that was there is intact then.
pub(crate) fn replace(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    disk::replace(&RealDisk, path, content)
}

/// Takes the folder for this process until the file is closed; the operating system closes it, however the process ends.
fn lock(path: &Path) -> anyhow::Result<File> {
    let lock_path = path.join(LOCK);
    let lock = OpenOptions::new()
        .create(true)
        .truncate(false)
        .write(true)
        .open(&lock_path)
        .with_context(|| cannot("open", &lock_path))?;
    match lock.try_lock() {
        Ok(()) => Ok(lock),
        Err(TryLockError::WouldBlock) => {
            let folder = path.to_owned();
            Err(Failure::FolderLocked { folder }.into())
        }
        Err(TryLockError::Error(error)) => Err(error).with_context(|| cannot("lock", &lock_path)),
    }
}

/// Opens the metrics for appending, and cuts off everything after the first `bytes` bytes.
fn open_metrics(path: &Path, bytes: u64) -> anyhow::Result<File> {
    let file = OpenOptions::new()
        .create(true)
        .append(true)
        .open(path)
        .with_context(|| cannot("open", path))?;
    file.set_len(bytes)
        .and_then(|()| file.sync_all())
        .with_context(|| cannot("cut", path))?;
    Ok(file)
}

fn recorded_status(path: &Path) -> Option<Status> {
    Some(read_record(path)?.status)
}

fn read_record(path: &Path) -> Option<RunRecord> {
    let json = bounded::read(&path.join(RUN), untrusted::TEXT_MAX).ok()?;
    serde_json::from_slice(&json).ok()
}

#[cfg(test)]
mod faults;
#[cfg(test)]
mod tests;
