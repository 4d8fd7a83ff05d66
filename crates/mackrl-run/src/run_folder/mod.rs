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

use checkpoints::Surroundings;
use disk::{Disk, RealDisk, cannot, cannot_write};
use mackrl::nn::InstructionSet;
use serde::{Deserialize, Serialize};

use crate::{
    bounded,
    config::Config,
    error::{Context, Result, RunError},
    provenance::{Provenance, Versions},
    training::{Checkpoint, assembly::tensors_bytes_max},
};
use event_file::EventFile;
pub use latest::{LatestRow, latest_row};
use manifest::{Fingerprint, Growing};
pub use recorded::{Recorded, Row, timeless};
pub use run::Run;

const CONFIG: &str = "config.toml";
/// Name of the file of metrics in a run folder.
pub const METRICS: &str = "metrics.jsonl";
const RUN: &str = "run.json";
const WEIGHTS: &str = "weights.safetensors";
const LOCK: &str = "lock";
const CHECKPOINTS: &str = "checkpoints";

/// How far a run has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
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
pub struct RunFolder {
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
pub struct Resumption {
    /// Its folder, at that checkpoint.
    pub folder: RunFolder,
    /// Everything that determines its result.
    pub config: Config,
    /// Where it goes on; a run that was interrupted before its first checkpoint begins again.
    pub checkpoint: Option<Checkpoint>,
    /// Later checkpoints that could not be used, and why.
    pub damaged: Vec<String>,
    /// The versions that made the run so far, if they are not those of this program.
    pub earlier: Option<Versions>,
}

impl RunFolder {
    /// Refuses a path that cannot become a run folder, without touching anything.
    ///
    /// # Errors
    /// [`RunError::FolderInUse`] if something lies there already.
    pub fn check_free(path: &Path) -> Result<()> {
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
            Some(Status::Finished) => RunError::FolderInUse {
                folder,
                holds: "a finished run",
            },
            _ if path.join(CONFIG).exists() => RunError::UnfinishedRun { folder },
            _ => RunError::FolderInUse {
                folder,
                holds: "other files",
            },
        })
    }

    /// Creates the folder of a new run, with its configuration and an empty list of metrics.
    ///
    /// # Errors
    /// [`RunError::FolderInUse`] or [`RunError::UnfinishedRun`] if something lies there already, [`RunError::FolderLocked`] if
    /// another process writes there; otherwise the path that could not be written.
    pub fn create(path: &Path, config: &Config, threads: usize) -> Result<Self> {
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
    pub fn prepare(path: &Path, config: &Config, threads: usize) -> Result<()> {
        Self::create(path, config, threads)?.set_status(Status::Interrupted)
    }

    /// Whether a process writes there now.
    pub fn is_in_use(path: &Path) -> bool {
        let lock = File::open(path.join(LOCK));
        lock.is_ok_and(|lock| matches!(lock.try_lock(), Err(TryLockError::WouldBlock)))
    }

    /// Whether the run there has reached its end.
    pub fn is_finished(path: &Path) -> bool {
        recorded_status(path) == Some(Status::Finished)
    }

    /// Opens the folder of an unfinished run at its latest checkpoint. What was written after it is removed: it will be written
    /// again.
    ///
    /// # Errors
    /// [`RunError::NotARun`], [`RunError::FolderLocked`] if another process writes there, [`RunError::BadData`] if no checkpoint can be used; otherwise the path that could not be read or written.
    pub fn resume(path: &Path, threads: usize) -> Result<Resumption> {
        untrusted::check(path)?;
        let config = run::read_config(path)?;
        let lock = lock(path)?;
        let record = read_record(path);
        let earlier = record
            .map(|record| match record.provenance.last() {
                Some(provenance) => provenance.versions,
                None => Provenance::of_unknown_code(&config).versions,
            })
            .filter(|versions| *versions != Versions::OWN);
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
            earlier,
        })
    }

    /// Opens the folder with these metrics.
    fn open(
        path: &Path,
        config: &Config,
        threads: usize,
        lock: File,
        metrics_so_far: Growing,
    ) -> Result<Self> {
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
        record.simd = InstructionSet::chosen()
            .ok()
            .map(|set| set.name().to_owned());
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
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Begins an event file for TensorBoard, in which rows of metrics stand from now on; the run has played `steps_env`
    /// environment steps, of which it has told already.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says.
    pub fn write_events(&mut self, steps_env: u64) -> Result<()> {
        let forgotten_from = if steps_env == 0 { 0 } else { steps_env + 1 };
        let events = EventFile::create(&*self.disk, &self.path, forgotten_from)?;
        self.events = Some(events);
        Ok(())
    }

    /// Adds one line to the metrics: a JSON object.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says.
    pub fn append_metrics(&mut self, object: &str) -> Result<()> {
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
    pub fn write_checkpoint(&mut self, number: u64, checkpoint: &Checkpoint) -> Result<()> {
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
    ///
    /// # Errors
    /// Path, bytes and what the operating system says.
    pub fn write_weights(&self, weights: &[u8]) -> Result<()> {
        self.replace(WEIGHTS, weights)
    }

    /// Records how far the run has come.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says.
    pub fn set_status(&mut self, status: Status) -> Result<()> {
        self.record.status = status;
        let json = serde_json::to_string_pretty(&self.record)
            .map_err(io::Error::from)
            .with_context(|| cannot("write", &self.path.join(RUN)))?;
        self.replace(RUN, (json + "\n").as_bytes())
    }

    fn replace(&self, name: &str, content: &[u8]) -> Result<()> {
        disk::replace(&*self.disk, &self.path.join(name), content)
    }
}

/// What can be said of a run without its weights.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Description {
    /// How far it has come.
    pub status: Status,
    /// Where its results come from: one entry for each version of the program that went on with it.
    pub provenance: Vec<Provenance>,
}

/// Whether a run lies in this folder.
pub fn is_run(path: &Path) -> bool {
    path.join(CONFIG).is_file()
}

/// Reads the configuration of the run at `path`, and what can be said of it.
///
/// # Errors
/// [`RunError::NotARun`] if there is no configuration; otherwise what is wrong with it.
pub fn read_description(path: &Path) -> Result<(Config, Description)> {
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
pub fn replace(path: &Path, content: &[u8]) -> Result<()> {
    disk::replace(&RealDisk, path, content)
}

/// Takes the folder for this process until the file is closed; the operating system closes it, however the process ends.
fn lock(path: &Path) -> Result<File> {
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
            Err(RunError::FolderLocked { folder })
        }
        Err(TryLockError::Error(error)) => Err(error).with_context(|| cannot("lock", &lock_path)),
    }
}

/// Opens the metrics for appending, and cuts off everything after the first `bytes` bytes.
fn open_metrics(path: &Path, bytes: u64) -> Result<File> {
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
