//! A run that was made earlier, opened to be read: the one way in, for every command.
//!
//! The folder may be a stranger's, or damaged. It is opened once, nothing in it may lead elsewhere, and what a finished run ended
//! with has to be what `run.json` says.

use std::path::{Path, PathBuf};

use super::{
    CONFIG, METRICS, RUN, WEIGHTS, checkpoints,
    extension::FormerPlan,
    kept::{self, WhichWeights},
    manifest::Fingerprint,
    record::{RunRecord, Status, read_record},
    untrusted,
};
use crate::{
    bounded,
    config::{Config, ConfigBuilder, registry},
    error::{Result, RunError},
    folder::Folder,
    training::{assembly::tensors_bytes_max, trained_steps_env},
};

/// A run folder that was opened to be read.
#[derive(Debug)]
pub(crate) struct StoredRun {
    pub(crate) folder: Folder,
    pub(crate) config: ConfigFile,
    pub(super) record: Option<RunRecord>,
}

/// The configuration of a run as its file holds it.
#[derive(Debug, Clone)]
pub(crate) struct ConfigFile {
    /// What the file says.
    pub(crate) config: Config,
    text: String,
    /// What was planned before the run was extended.
    pub(super) former: Vec<FormerPlan>,
}

/// Whether what is left of a run is what it ended with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Completeness {
    /// It has not come to its end.
    Unfinished,
    /// It has, and everything is as it was.
    Finished,
    /// It has, and its weights were changed or lost since; its last checkpoint gives them again.
    WithoutWeights,
}

/// How long a run was planned when something was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Plan {
    /// As it is now.
    Present,
    /// For fewer environment steps, these.
    Former(u64),
}

impl ConfigFile {
    pub(super) fn read(folder: &Folder) -> Result<Self> {
        let shown = folder.shown(CONFIG).display().to_string();
        let Some(bytes) = folder.read(CONFIG, untrusted::TEXT_MAX)? else {
            let folder = folder.path().to_owned();
            return Err(RunError::NotARun { folder });
        };
        let text = bounded::text(&shown, bytes).map_err(|message| RunError::BadData { message })?;
        let config = ConfigBuilder::new(registry())
            .recorded(&shown, &text)?
            .build()?;
        // Tools for versions of files may end lines otherwise.
        let text = text.replace("\r\n", "\n");
        Ok(Self {
            config,
            text,
            former: Vec::new(),
        })
    }

    /// Under which plan of this run something was written with this fingerprint; nothing, if it is of another configuration.
    pub(super) fn plan(&self, fingerprint: &Fingerprint) -> Option<Plan> {
        let mut former = self.former.iter();
        match former.find(|plan| plan.config == *fingerprint) {
            Some(plan) => Some(Plan::Former(plan.steps_env)),
            None => self.is(fingerprint).then_some(Plan::Present),
        }
    }

    /// Of the file as it is.
    pub(super) fn fingerprint(&self) -> Fingerprint {
        Fingerprint::of(self.text.as_bytes())
    }

    /// Whether a fingerprint is that of this configuration: of the file, or of the same settings as this program writes them.
    pub(super) fn is(&self, fingerprint: &Fingerprint) -> bool {
        self.fingerprint() == *fingerprint
            || Fingerprint::of(self.config.to_toml().as_bytes()) == *fingerprint
    }
}

impl StoredRun {
    /// Opens the run at `path`.
    ///
    /// # Errors
    /// [`RunError::NotARun`] if there is no configuration; otherwise what is wrong with which file.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        Self::within(open_folder(path)?)
    }

    /// Reads the run in a folder that was opened.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub(super) fn within(folder: Folder) -> Result<Self> {
        untrusted::check(&folder)?;
        let mut config = ConfigFile::read(&folder)?;
        let record = read_record(&folder);
        if let Some(record) = &record {
            // If the program was stopped in between, the new plan was not written.
            let own = config.fingerprint();
            let former = record.former_plans.iter();
            let former = former.filter(|plan| plan.config != own);
            config.former.extend(former.cloned());
        }
        let run = Self {
            config,
            record,
            folder,
        };
        match run.seal(CONFIG) {
            Some(seal) if !run.config.is(seal) => Err(run.differs(CONFIG)),
            _ => Ok(run),
        }
    }

    /// How far it has come.
    pub(super) fn status(&self) -> Status {
        let status = self.record.as_ref().map(|record| record.status);
        status.unwrap_or(Status::Running)
    }

    /// Its final weights, if it has any.
    ///
    /// # Errors
    /// [`RunError::BadData`] if they are not those that the run ended with.
    pub(crate) fn weights(&self) -> Result<Option<Vec<u8>>> {
        self.weights_of(WhichWeights::Last)
    }

    /// The file of these weights, if there is one.
    fn weights_of(&self, which: WhichWeights) -> Result<Option<Vec<u8>>> {
        let length_max = tensors_bytes_max(&self.config.config)?;
        let weights = self.folder.read(which.path(), length_max)?;
        let name = which.name();
        match (&weights, self.seal(&name)) {
            (Some(found), Some(seal)) if Fingerprint::of(found) != *seal => {
                Err(self.differs(&name))
            }
            _ => Ok(weights),
        }
    }

    /// Whether it is finished, and still is what it was then.
    ///
    /// # Errors
    /// [`RunError::BadData`] if metrics were changed since, which nothing can give again.
    pub(crate) fn completeness(&self) -> Result<Completeness> {
        if self.status() != Status::Finished {
            return Ok(Completeness::Unfinished);
        }
        if self.seal(METRICS).is_some() {
            self.rows(|_| ())?;
        }
        let best = WhichWeights::Best;
        let needed = [
            Some(WhichWeights::Last),
            self.seal(&best.name()).map(|_| best),
        ];
        for which in needed.into_iter().flatten() {
            match self.weights_of(which) {
                Ok(Some(weights)) if !weights.is_empty() => {}
                Ok(_) | Err(RunError::BadData { .. }) => return Ok(Completeness::WithoutWeights),
                Err(error) => return Err(error),
            }
        }
        Ok(Completeness::Finished)
    }

    /// What `run.json` says of a file of the run that ended, if it does.
    pub(super) fn seal(&self, name: &str) -> Option<&Fingerprint> {
        let record = self.record.as_ref()?;
        let is_finished = record.status == Status::Finished;
        record.files.get(name).filter(|_| is_finished)
    }

    pub(super) fn differs(&self, name: &str) -> RunError {
        let shown = self.folder.shown(name);
        RunError::BadData {
            message: format!(
                "{} is not what {RUN} says: it was changed or damaged after the run had ended",
                shown.display()
            ),
        }
    }

    pub(super) fn provenance_ids(&self) -> Vec<String> {
        let records = self.record.iter();
        let provenance = records.flat_map(|record| &record.provenance);
        provenance.map(|one| one.id.clone()).collect()
    }
}

/// Opens the folder of a run that a person named.
///
/// # Errors
/// [`RunError::NotARun`] if no folder is there.
pub(super) fn open_folder(path: &Path) -> Result<Folder> {
    use std::io::ErrorKind::{NotADirectory, NotFound};
    Folder::open(path).map_err(|error| match error {
        RunError::System { source, .. } if matches!(source.kind(), NotFound | NotADirectory) => {
            let folder = path.to_owned();
            RunError::NotARun { folder }
        }
        error => error,
    })
}

/// A run with the weights that it has.
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
    /// Reads configuration and weights. The last are those at the end of the run, or those of its latest checkpoint.
    ///
    /// # Errors
    /// [`RunError::NotARun`] if there is no configuration; [`RunError::NoSuchWeights`] if it does not keep these weights;
    /// [`RunError::BadData`] if they are not those that the run ended with; otherwise what is wrong with which file.
    pub fn open(path: &Path, which: WhichWeights) -> Result<Self> {
        let run = StoredRun::open(path)?;
        if which != WhichWeights::Last {
            let weights = run.weights_of(which)?;
            return Ok(Self {
                weights: weights.ok_or_else(|| kept::missing(&run.folder, which))?,
                weights_path: path.join(which.path()),
                config: run.config.config,
            });
        }
        if let Some(weights) = run.weights()? {
            return Ok(Self {
                weights,
                weights_path: path.join(WEIGHTS),
                config: run.config.config,
            });
        }
        let length_max = tensors_bytes_max(&run.config.config)?;
        let (latest, _) = checkpoints::latest(
            &run.folder,
            &run.config,
            (checkpoints::Wanted::Parameters, length_max),
        )?;
        let stored = latest.ok_or_else(|| RunError::BadData {
            message: format!(
                "{} has no {WEIGHTS} and no checkpoint: the run has only begun",
                path.display()
            ),
        })?;
        Ok(Self {
            config: run.config.config,
            weights: stored.checkpoint.tensors,
            weights_path: path.join(checkpoints::weights_path(stored.number)),
        })
    }

    /// Environment steps of training that the weights had seen, if their file says so; those of checkpoints do not.
    #[must_use]
    pub fn steps_env(&self) -> Option<u64> {
        trained_steps_env(&self.weights)
    }

    /// Reads the configuration of the run at `path`, and weights from another place.
    ///
    /// # Errors
    /// As [`Run::open`].
    pub fn open_with_weights(path: &Path, weights: &Path) -> Result<Self> {
        let config = StoredRun::open(path)?.config.config;
        Ok(Self {
            weights: bounded::read(weights, tensors_bytes_max(&config)?)?,
            weights_path: weights.to_owned(),
            config,
        })
    }
}
