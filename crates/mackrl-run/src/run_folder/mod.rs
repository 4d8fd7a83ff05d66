//! What a run leaves on disk.
//!
//! ```text
//! DIR/config.toml           everything that determines the result; written before the first step
//! DIR/run.json              command line, provenance, status; of a finished run, hashes of what it ended with
//! DIR/metrics.jsonl         one JSON object a line
//! DIR/checkpoints/          the latest few, from which the run continues
//! DIR/weights.safetensors   the policy and the critic; written at the end
//! DIR/events.out.tfevents.* the metrics for TensorBoard, if `run.tensorboard` is set; one file for each process that trained
//! DIR/replays/              episodes that `mackrl evaluate --save-replays` kept
//! DIR/lock                  held by the process that writes
//! DIR/metrics.jsonl.damaged metrics that were not those of the checkpoint when the run continued, put aside
//! ```
//!
//! A folder belongs to one run for ever, and has one writer at a time. The writer opens the folder once, reaches everything
//! through it, and makes sure before every write that the lock in it is the one that it holds and that the path still leads there: a folder that was moved or
//! removed meanwhile, and another run in its place, get nothing of it.
//!
//! Files that are replaced are replaced atomically, so that a reader finds the old content or the new. Metrics are synced before
//! the checkpoint that counts them, and cut back to a checkpoint when the run continues from it: each row stands there once.
//! Metrics that are not those of the checkpoint cost no checkpoint: they are put aside, with a warning.

mod checkpoints;
mod description;
mod disk;
mod event_file;
mod latest;
mod manifest;
mod memory;
mod record;
mod recorded;
mod rows;
mod stored;
mod untrusted;

use std::{
    fs::{self, File, TryLockError},
    io,
    path::{Path, PathBuf},
};

use cap_std::fs::OpenOptions;
use checkpoints::Surroundings;
pub use description::{
    Description, is_run, keep_replay, read_checkpoint, read_description, replace,
};
use disk::{Disk, RealDisk, cannot_write};
use event_file::EventFile;
pub use latest::{LatestRow, latest_row};
use mackrl::nn::InstructionSet;
use manifest::{Fingerprint, Growing};
pub use record::Status;
use record::{RunRecord, build, read_record};
pub use recorded::{Recorded, timeless};
pub use rows::{Following, Row, follow_rows, read_rows};
pub use stored::Run;
pub(crate) use stored::{Completeness, StoredRun};

use crate::{
    config::Config,
    error::{Context, Result, RunError},
    folder::Folder,
    provenance::{Provenance, Versions},
    training::{Checkpoint, assembly::tensors_bytes_max},
};

const CONFIG: &str = "config.toml";
/// Name of the file of metrics in a run folder.
pub const METRICS: &str = "metrics.jsonl";
const RUN: &str = "run.json";
const WEIGHTS: &str = "weights.safetensors";
const LOCK: &str = "lock";
const CHECKPOINTS: &str = "checkpoints";
/// Name of the folder of recorded episodes in a run folder.
pub const REPLAYS: &str = "replays";

/// The folder of a run that is being made.
#[derive(Debug)]
pub struct RunFolder {
    folder: Folder,
    disk: Box<dyn Disk>,
    config: Fingerprint,
    metrics: File,
    metrics_so_far: Growing,
    weights: Option<Fingerprint>,
    events: Option<EventFile>,
    checkpoints_kept: usize,
    record: RunRecord,
    /// No other process writes while this is open.
    lock: File,
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
    /// Where metrics were put that are not those of the checkpoint.
    pub metrics_put_aside: Option<PathBuf>,
    /// The versions that made the run so far, if they are not those of this program.
    pub earlier: Option<Versions>,
}

impl RunFolder {
    /// Refuses a path that cannot become a run folder, without touching anything.
    ///
    /// # Errors
    /// [`RunError::FolderInUse`] if something lies there already.
    pub fn check_free(path: &Path) -> Result<()> {
        match Folder::open(path) {
            Err(RunError::System { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
                Ok(())
            }
            folder => expect_free(&folder?),
        }
    }

    /// Creates the folder of a new run, with its configuration and an empty list of metrics.
    ///
    /// # Errors
    /// [`RunError::FolderInUse`] or [`RunError::UnfinishedRun`] if something lies there already, [`RunError::FolderLocked`] if
    /// another process writes there; otherwise the path that could not be written.
    pub fn create(path: &Path, config: &Config, threads: usize) -> Result<Self> {
        Self::check_free(path)?;
        fs::create_dir_all(path).with_context(|| format!("cannot create {}", path.display()))?;
        let folder = Folder::open(path)?;
        let lock = lock(&folder)?;
        // Another process may have been quicker, and be done already.
        expect_free(&folder)?;
        let text = config.to_toml();
        disk::replace(&RealDisk, &folder, Path::new(CONFIG), text.as_bytes())?;
        let fingerprint = Fingerprint::of(text.as_bytes());
        Self::open(
            folder,
            (config, fingerprint),
            threads,
            lock,
            Growing::default(),
        )
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
        let lock = Folder::open(path).and_then(|folder| folder.file(LOCK));
        lock.is_ok_and(|lock| {
            lock.is_some_and(|lock| matches!(lock.try_lock(), Err(TryLockError::WouldBlock)))
        })
    }

    /// Opens the folder of an unfinished run at its latest checkpoint. What was written after it is removed: it will be written
    /// again.
    ///
    /// # Errors
    /// [`RunError::NotARun`], [`RunError::FolderLocked`] if another process writes there, [`RunError::BadData`] if no checkpoint can be used; otherwise the path that could not be read or written.
    pub fn resume(path: &Path, threads: usize) -> Result<Resumption> {
        let folder = StoredRun::open(path)?.folder;
        let lock = lock(&folder)?;
        // Another process may have gone on meanwhile.
        let StoredRun {
            folder,
            config,
            record,
        } = StoredRun::within(folder)?;
        let earlier = record
            .map(|record| match record.provenance.last() {
                Some(provenance) => provenance.versions,
                None => Provenance::of_unknown_code(&config.config).versions,
            })
            .filter(|versions| *versions != Versions::OWN);
        let tensors_max = tensors_bytes_max(&config.config)?;
        let (latest, damaged) = checkpoints::latest(
            &folder,
            &config,
            (checkpoints::Wanted::Everything, tensors_max),
        )?;
        let number = latest.as_ref().map(|stored| stored.number);
        checkpoints::tidy(&RealDisk, &folder, number)?;
        let fingerprint = config.fingerprint();
        let config = config.config;
        let (metrics, checkpoint) = latest
            .map(|stored| (stored.metrics, stored.checkpoint))
            .unzip();
        let put_aside = match metrics {
            Some(None) => Some(put_metrics_aside(&folder)?),
            _ => None,
        };
        let metrics = metrics.flatten().unwrap_or_default();
        let mut opened = Self::open(folder, (&config, fingerprint), threads, lock, metrics)?;
        if let Some(name) = &put_aside {
            opened.record.metrics_put_aside.push(name.clone());
            opened.set_status(Status::Running)?;
        }
        Ok(Resumption {
            metrics_put_aside: put_aside.map(|name| opened.folder.shown(name)),
            folder: opened,
            config,
            checkpoint,
            damaged,
            earlier,
        })
    }

    /// Opens the folder with these metrics.
    fn open(
        folder: Folder,
        (config, fingerprint): (&Config, Fingerprint),
        threads: usize,
        lock: File,
        metrics_so_far: Growing,
    ) -> Result<Self> {
        let metrics = open_metrics(&folder, metrics_so_far.bytes())?;
        let mut record = read_record(&folder).unwrap_or_else(|| RunRecord {
            command: std::env::args_os()
                .map(|word| word.to_string_lossy().into_owned())
                .collect(),
            provenance: Vec::new(),
            threads,
            simd: None,
            build: None,
            status: Status::Running,
            metrics_put_aside: Vec::new(),
            files: Default::default(),
        });
        record.threads = threads;
        record.build = Some(build());
        record.simd = InstructionSet::chosen()
            .ok()
            .map(|set| set.name().to_owned());
        let provenance = Provenance::of_run(config);
        if !record.provenance.contains(&provenance) {
            record.provenance.push(provenance);
        }
        let mut folder = Self {
            folder,
            disk: Box::new(RealDisk),
            config: fingerprint,
            metrics,
            metrics_so_far,
            weights: None,
            events: None,
            checkpoints_kept: config.run.checkpoints_kept,
            record,
            lock,
        };
        folder.set_status(Status::Running)?;
        Ok(folder)
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Begins an event file for TensorBoard, in which rows of metrics stand from now on; the run has played `steps_env`
    /// environment steps, of which it has told already.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says.
    pub fn write_events(&mut self, steps_env: u64) -> Result<()> {
        self.expect_own()?;
        let forgotten_from = if steps_env == 0 { 0 } else { steps_env + 1 };
        let events = EventFile::create(&*self.disk, &self.folder, forgotten_from)?;
        self.events = Some(events);
        Ok(())
    }

    /// Adds one line to the metrics: a JSON object.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says; [`RunError::FolderReplaced`] as for every writing below.
    pub fn append_metrics(&mut self, object: &str) -> Result<()> {
        debug_assert!(!object.contains('\n'), "a row of metrics is one line");
        self.expect_own()?;
        let line = format!("{object}\n");
        self.disk
            .write(&mut self.metrics, line.as_bytes())
            .with_context(|| cannot_write(&self.folder.shown(METRICS), line.len()))?;
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
        self.expect_own()?;
        self.disk
            .sync(&self.metrics)
            .with_context(|| self.folder.cannot("sync", Path::new(METRICS)))?;
        let surroundings = Surroundings {
            config: self.config.clone(),
            metrics: self.metrics_so_far.fingerprint(),
        };
        checkpoints::write(
            &*self.disk,
            &self.folder,
            (number, checkpoint),
            surroundings,
            self.checkpoints_kept,
        )
    }

    /// Puts the weights in place of earlier ones.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says.
    pub fn write_weights(&mut self, weights: &[u8]) -> Result<()> {
        self.expect_own()?;
        self.weights = Some(Fingerprint::of(weights));
        self.replace(WEIGHTS, weights)
    }

    /// Records how far the run has come; of a finished one, also length and hash of what it ended with.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says.
    pub fn set_status(&mut self, status: Status) -> Result<()> {
        self.expect_lock()?;
        self.record.status = status;
        self.record.files.clear();
        if status == Status::Finished {
            let files = [
                (CONFIG, Some(self.config.clone())),
                (METRICS, Some(self.metrics_so_far.fingerprint())),
                (WEIGHTS, self.weights.clone()),
            ];
            let present = files
                .into_iter()
                .filter_map(|(name, file)| Some((name.to_owned(), file?)));
            self.record.files.extend(present);
        }
        let json = serde_json::to_string_pretty(&self.record)
            .map_err(io::Error::from)
            .with_context(|| self.folder.cannot("write", Path::new(RUN)))?;
        self.replace(RUN, (json + "\n").as_bytes())
    }

    fn replace(&self, name: &str, content: &[u8]) -> Result<()> {
        disk::replace(&*self.disk, &self.folder, Path::new(name), content)
    }

    /// Makes sure that the lock in the folder is the one that is held: the content may have been removed, and another run begun.
    fn expect_lock(&self) -> Result<()> {
        let there = self.folder.dir().symlink_metadata(LOCK).ok();
        let held = self.lock.metadata().ok();
        #[cfg(unix)]
        let is_own = {
            use cap_std::fs::MetadataExt as _;
            use std::os::unix::fs::MetadataExt as _;
            let there = there.map(|there| (there.dev(), there.ino()));
            held.is_some_and(|held| there == Some((held.dev(), held.ino())))
        };
        // Elsewhere a file that is open keeps its name and its folder.
        #[cfg(not(unix))]
        let is_own = held.is_some() && there.is_some();
        self.replaced_unless(is_own)
    }

    /// As [`Self::expect_lock`], and that the folder still lies where it was opened.
    fn expect_own(&self) -> Result<()> {
        self.expect_lock()?;
        #[cfg(unix)]
        {
            use std::os::unix::fs::MetadataExt as _;
            let identity = |file: fs::Metadata| (file.dev(), file.ino());
            let there = fs::symlink_metadata(self.path().join(LOCK)).map(identity);
            let held = self.lock.metadata().map(identity);
            self.replaced_unless(there.ok() == held.ok())?;
        }
        Ok(())
    }

    fn replaced_unless(&self, is_own: bool) -> Result<()> {
        if is_own {
            return Ok(());
        }
        let folder = self.path().to_owned();
        Err(RunError::FolderReplaced { folder })
    }
}

/// Refuses a folder that cannot become a run folder.
fn expect_free(there: &Folder) -> Result<()> {
    // What stands in the folder of a run that was killed before it had a configuration.
    let unborn = [PathBuf::from(LOCK), disk::temporary(Path::new(CONFIG))];
    let entries = there.entries("")?;
    let is_unborn = |name: &str| unborn.iter().any(|own| own == Path::new(name));
    if entries.iter().all(|(name, _)| is_unborn(name)) {
        return Ok(());
    }
    let folder = there.path().to_owned();
    Err(match read_record(there).map(|record| record.status) {
        Some(Status::Finished) => RunError::FolderInUse {
            folder,
            holds: "a finished run",
        },
        _ if there.kind(CONFIG)?.is_some() => RunError::UnfinishedRun { folder },
        _ => RunError::FolderInUse {
            folder,
            holds: "other files",
        },
    })
}

/// Takes the folder for this process until the file is closed; the operating system closes it, however the process ends.
fn lock(folder: &Folder) -> Result<File> {
    let path = Path::new(LOCK);
    let mut options = OpenOptions::new();
    options.create(true).write(true);
    let lock = folder
        .open_with(path, &options)
        .with_context(|| folder.cannot("open", path))?;
    match lock.try_lock() {
        Ok(()) => Ok(lock),
        Err(TryLockError::WouldBlock) => {
            let folder = folder.path().to_owned();
            Err(RunError::FolderLocked { folder })
        }
        Err(TryLockError::Error(error)) => Err(error).with_context(|| folder.cannot("lock", path)),
    }
}

/// Opens the metrics for appending, and cuts off everything after the first `bytes` bytes.
fn open_metrics(folder: &Folder, bytes: u64) -> Result<File> {
    let path = Path::new(METRICS);
    let mut options = OpenOptions::new();
    options.create(true).append(true);
    let file = folder
        .open_with(path, &options)
        .with_context(|| folder.cannot("open", path))?;
    file.set_len(bytes)
        .and_then(|()| file.sync_all())
        .with_context(|| folder.cannot("cut", path))?;
    Ok(file)
}

/// Gives metrics that are not those of the checkpoint another name, and says which; where there are none, nothing is moved.
fn put_metrics_aside(folder: &Folder) -> Result<String> {
    let mut name = format!("{METRICS}.damaged");
    let mut number = 1;
    while folder.kind(&name)?.is_some() {
        number += 1;
        name = format!("{METRICS}.damaged{number}");
    }
    if folder.kind(METRICS)?.is_some() {
        disk::rename(&RealDisk, folder, Path::new(METRICS), Path::new(&name))?;
    }
    Ok(name)
}

#[cfg(test)]
mod faults;
#[cfg(test)]
mod integrity;
#[cfg(test)]
mod tests;
