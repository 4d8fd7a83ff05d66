//! What a run leaves on disk.
//!
//! ```text
//! DIR/config.toml           everything that determines the result; written before the first step
//! DIR/run.json              command line, provenance, status; of a finished run, how its last and its best weights play, and
//!                           hashes of what it ended with
//! DIR/metrics.jsonl         one JSON object a line
//! DIR/checkpoints/          the latest few, from which the run continues
//! DIR/weights.safetensors   the policy and the critic; written at the end
//! DIR/initial.safetensors   the weights of another run that this one began with, if it did
//! DIR/weights/              those that did best in a test, and those of every so many steps, if `run.weights_interval_steps_env` is set
//! DIR/events.out.tfevents.* the metrics for TensorBoard, if `run.tensorboard` is set; one file for each process that trained
//! DIR/replays/              episodes that `mackrl evaluate --save-replays` kept
//! DIR/lock                  of the process that writes, while it does: who it is
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
mod claim;
mod description;
mod disk;
mod event_file;
mod extension;
mod kept;
mod latest;
mod manifest;
mod memory;
mod metrics_file;
mod mirror;
mod record;
mod recorded;
mod rows;
mod stored;
mod untrusted;

use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use checkpoints::Surroundings;
use claim::Claim;
pub use claim::Holder;
pub(crate) use claim::Occupation;
pub(crate) use description::latest_checkpoint;
pub use description::{
    Description, is_run, keep_replay, read_checkpoint, read_description, replace,
};
use disk::{Disk, RealDisk, cannot_write};
use event_file::EventFile;
use extension::forget_former_end;
pub use extension::{Extension, InitialSource, InitialWeights, extend};
use kept::Kept;
pub use kept::WhichWeights;
pub use latest::{LatestRow, latest_row};
use mackrl::nn::InstructionSet;
use manifest::{Fingerprint, Growing};
pub use mirror::Mirror;
pub use record::Status;
use record::{RunRecord, build, command_line, read_record};
pub use recorded::{Recorded, timeless};
pub use rows::{Following, Row, follow_rows, read_rows};
pub use stored::Run;
pub(crate) use stored::{Completeness, StoredRun};

pub use crate::batch_system::Job;
use crate::{
    config::Config,
    error::{Context, Result, RunError},
    folder::Folder,
    provenance::{Provenance, Versions},
    training::{Checkpoint, Teams, assembly::tensors_bytes_max},
};

const CONFIG: &str = "config.toml";
/// Name of the file of metrics in a run folder.
pub const METRICS: &str = "metrics.jsonl";
const RUN: &str = "run.json";
const WEIGHTS: &str = "weights.safetensors";
/// Weights of another run that this one began with.
const INITIAL: &str = "initial.safetensors";
/// Folder of the weights that are kept beside the last.
const KEPT: &str = "weights";
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
    kept: Kept,
    events: Option<EventFile>,
    checkpoints_kept: usize,
    record: RunRecord,
    /// No other process writes while this lives.
    claim: Claim,
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
    /// The weights of another run that it begins with, if it does and begins again.
    pub initial: Option<Vec<u8>>,
    /// Later checkpoints that could not be used, and why.
    pub damaged: Vec<String>,
    /// Where metrics were put that are not those of the checkpoint.
    pub metrics_put_aside: Option<PathBuf>,
    /// Weights that were kept and are lost or damaged.
    pub weights_lost: Vec<String>,
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
        Self::create_from(path, config, None, threads)
    }

    /// As [`RunFolder::create`], of a run that begins with the weights of another, of which `config` has the hash.
    ///
    /// # Errors
    /// As [`RunFolder::create`].
    pub fn create_from(
        path: &Path,
        config: &Config,
        initial: Option<&InitialWeights>,
        threads: usize,
    ) -> Result<Self> {
        Self::check_free(path)?;
        fs::create_dir_all(path).with_context(|| format!("cannot create {}", path.display()))?;
        let folder = Folder::open(path)?;
        let claim = Claim::acquire(&folder, None)?;
        // Another process may have been quicker, and be done already.
        expect_free(&folder)?;
        if let Some(initial) = initial {
            disk::replace(&RealDisk, &folder, Path::new(INITIAL), &initial.bytes)?;
        }
        let text = config.to_toml();
        disk::replace(&RealDisk, &folder, Path::new(CONFIG), text.as_bytes())?;
        let fingerprint = Fingerprint::of(text.as_bytes());
        let mut opened = Self::open(
            folder,
            (config, fingerprint),
            threads,
            claim,
            Growing::default(),
        )?;
        if let Some(initial) = initial {
            opened.record.initial_weights = Some(initial.source.clone());
            opened.set_status(Status::Running)?;
        }
        Ok(opened)
    }

    /// Creates the folder of a new run for another process to make: with its configuration, and nothing else.
    ///
    /// # Errors
    /// As [`RunFolder::create`].
    pub fn prepare(path: &Path, config: &Config, threads: usize) -> Result<()> {
        Self::create(path, config, threads)?.set_status(Status::Interrupted)
    }

    /// Opens the folder of an unfinished run at its latest checkpoint. What was written after it is removed: it will be written
    /// again.
    ///
    /// # Errors
    /// [`RunError::NotARun`], [`RunError::FolderLocked`] if another process writes there, [`RunError::BadData`] if no checkpoint can be used; otherwise the path that could not be read or written.
    pub fn resume(path: &Path, threads: usize) -> Result<Resumption> {
        let folder = StoredRun::open(path)?.folder;
        let claim = Claim::acquire(&folder, None)?;
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
        let known = latest.as_ref().map(|stored| &stored.weights);
        let best = (latest.as_ref()).and_then(|stored| stored.checkpoint.best.as_deref());
        let nothing = Kept::new();
        let (kept, weights_lost) = kept::restore(
            &RealDisk,
            &folder,
            known.unwrap_or(&nothing),
            best,
            tensors_max,
        )?;
        forget_former_end(&folder, read_record(&folder).as_ref())?;
        let is_first = latest.is_none() && !config.config.run.initial_weights.is_empty();
        let initial = is_first
            .then(|| folder.read_needed(Path::new(INITIAL), tensors_max))
            .transpose()?;
        let fingerprint = config.fingerprint();
        let config = config.config;
        let (metrics, checkpoint) = latest
            .map(|stored| (stored.metrics, stored.checkpoint))
            .unzip();
        let put_aside = match metrics {
            Some(None) => Some(metrics_file::put_aside(&folder)?),
            _ => None,
        };
        let metrics = metrics.flatten().unwrap_or_default();
        let mut opened = Self::open(folder, (&config, fingerprint), threads, claim, metrics)?;
        opened.kept = kept;
        if let Some(name) = &put_aside {
            opened.record.metrics_put_aside.push(name.clone());
            opened.set_status(Status::Running)?;
        }
        Ok(Resumption {
            metrics_put_aside: put_aside.map(|name| opened.folder.shown(name)),
            weights_lost,
            folder: opened,
            config,
            checkpoint,
            initial,
            damaged,
            earlier,
        })
    }

    /// Opens the folder with these metrics.
    fn open(
        folder: Folder,
        (config, fingerprint): (&Config, Fingerprint),
        threads: usize,
        claim: Claim,
        metrics_so_far: Growing,
    ) -> Result<Self> {
        let metrics = metrics_file::open(&folder, metrics_so_far.bytes())?;
        let mut record = read_record(&folder).unwrap_or_else(|| RunRecord {
            command: command_line(),
            initial_weights: None,
            former_plans: Vec::new(),
            provenance: Vec::new(),
            threads,
            simd: None,
            build: None,
            status: Status::Running,
            failure: None,
            metrics_put_aside: Vec::new(),
            teams: None,
            files: Default::default(),
        });
        record.threads = threads;
        record
            .former_plans
            .retain(|plan| plan.config != fingerprint);
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
            kept: Kept::new(),
            events: None,
            checkpoints_kept: config.run.checkpoints_kept,
            record,
            claim,
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
        let mut weights = self.kept.clone();
        weights.retain(|which, _| matches!(which, WhichWeights::Step(_)));
        let surroundings = Surroundings {
            config: self.config.clone(),
            metrics: self.metrics_so_far.fingerprint(),
            weights,
        };
        checkpoints::write(
            &*self.disk,
            &self.folder,
            (number, checkpoint),
            surroundings,
            self.checkpoints_kept,
        )
    }

    /// Puts these weights in place of earlier ones.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says.
    pub fn write_weights(&mut self, which: WhichWeights, weights: &[u8]) -> Result<()> {
        self.expect_own()?;
        kept::write(&*self.disk, &self.folder, which, weights)?;
        self.kept.insert(which, Fingerprint::of(weights));
        Ok(())
    }

    /// Records that the run is finished, how its teams play, and length and hash of what it ended with.
    ///
    /// # Errors
    /// As [`Self::set_status`].
    pub fn finish(&mut self, teams: Teams) -> Result<()> {
        self.record.teams = Some(teams);
        self.set_status(Status::Finished)
    }

    /// Records how far the run has come; of a finished one, also length and hash of what it ended with.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says.
    pub fn set_status(&mut self, status: Status) -> Result<()> {
        self.record_status(status, None)
    }

    /// Records that the run failed, and why.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says.
    pub fn set_failed(&mut self, why: String) -> Result<()> {
        self.record_status(Status::Failed, Some(why))
    }

    fn record_status(&mut self, status: Status, failure: Option<String>) -> Result<()> {
        self.expect_claim()?;
        self.record.status = status;
        self.record.failure = failure;
        self.record.files.clear();
        if status == Status::Finished {
            let own = [
                (CONFIG.to_owned(), self.config.clone()),
                (METRICS.to_owned(), self.metrics_so_far.fingerprint()),
            ];
            let weights = self.kept.iter();
            let weights = weights.map(|(which, file)| (which.name(), file.clone()));
            self.record.files.extend(own.into_iter().chain(weights));
        } else {
            self.record.teams = None;
        }
        let json = serde_json::to_string_pretty(&self.record)
            .map_err(io::Error::from)
            .with_context(|| self.folder.cannot("write", Path::new(RUN)))?;
        self.replace(RUN, (json + "\n").as_bytes())
    }

    fn replace(&self, name: &str, content: &[u8]) -> Result<()> {
        disk::replace(&*self.disk, &self.folder, Path::new(name), content)
    }

    /// Makes sure that the folder is still claimed by this process.
    fn expect_claim(&self) -> Result<()> {
        self.replaced_unless(self.claim.is_held())
    }

    /// As [`Self::expect_claim`], and that the folder still lies where it was opened.
    fn expect_own(&self) -> Result<()> {
        self.replaced_unless(self.claim.is_held_at(self.path()))
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
    let unborn = [
        PathBuf::from(LOCK),
        PathBuf::from(INITIAL),
        disk::temporary(Path::new(INITIAL)),
        disk::temporary(Path::new(CONFIG)),
    ];
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

#[cfg(test)]
mod faults;
#[cfg(test)]
mod integrity;
#[cfg(test)]
mod tests;
