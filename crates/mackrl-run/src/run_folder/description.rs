//! What can be said of a run without making it, and the small things that are written beside runs.

use std::{
    io,
    path::{Path, PathBuf},
};

use super::{
    CONFIG, REPLAYS, checkpoints,
    disk::{self, RealDisk, cannot_write},
    kept::{self, WhichWeights},
    record::Status,
    stored::StoredRun,
};
use crate::{
    config::Config,
    error::{Context, Result, RunError},
    folder::Folder,
    provenance::Provenance,
    training::{Checkpoint, Teams},
};

/// What can be said of a run without its weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Description {
    /// How far it has come.
    pub status: Status,
    /// Of a run that failed, why, if it says so.
    pub failure: Option<String>,
    /// Where its results come from: one entry for each version of the program that went on with it.
    pub provenance: Vec<Provenance>,
    /// Metrics that were found damaged and put aside: what they held is missing.
    pub metrics_put_aside: Vec<String>,
    /// Of a finished run, how its last and its best weights play; early versions do not say.
    pub teams: Option<Teams>,
    /// The weights that it keeps beside the last.
    pub kept: Vec<WhichWeights>,
}

/// Whether a run lies in this folder.
pub fn is_run(path: &Path) -> bool {
    path.join(CONFIG).symlink_metadata().is_ok()
}

/// Reads the configuration of the run at `path`, and what can be said of it.
///
/// # Errors
/// [`RunError::NotARun`] if there is no configuration; otherwise what is wrong with it.
pub fn read_description(path: &Path) -> Result<(Config, Description)> {
    let run = StoredRun::open(path)?;
    let status = run.status();
    let kept = kept::listed(&run.folder)?;
    let (mut provenance, metrics_put_aside, teams, failure) =
        run.record.map_or_else(Default::default, |record| {
            let super::record::RunRecord {
                provenance,
                metrics_put_aside,
                teams,
                failure,
                ..
            } = record;
            (provenance, metrics_put_aside, teams, failure)
        });
    let config = run.config.config;
    if provenance.is_empty() {
        // Early versions did not say.
        provenance.push(Provenance::of_unknown_code(&config));
    }
    let description = Description {
        status,
        failure,
        provenance,
        metrics_put_aside,
        teams,
        kept,
    };
    Ok((config, description))
}

/// The folder of the latest whole checkpoint of the run at `path`, if there is one.
pub(crate) fn latest_checkpoint(path: &Path) -> Option<PathBuf> {
    let numbers = checkpoints::numbers(&Folder::open(path).ok()?).ok()?;
    let latest = numbers.last()?;
    Some(path.join(checkpoints::place(*latest)))
}

/// Puts `content` at `path`: a reader, and a machine that loses power, finds the old content or the new.
///
/// # Errors
/// Path, bytes and what the operating system says; the file that was there is intact then.
pub fn replace(path: &Path, content: &[u8]) -> Result<()> {
    let Some(name) = path.file_name() else {
        let source = io::Error::from(io::ErrorKind::InvalidInput);
        let what = cannot_write(path, content.len());
        return Err(RunError::System { what, source });
    };
    let folder =
        Folder::open(disk::parent(path)).with_context(|| cannot_write(path, content.len()))?;
    disk::replace(&RealDisk, &folder, Path::new(name), content)
}

/// Keeps a recorded episode in the folder of a run, under a plain name, and says where.
///
/// # Errors
/// If there is no run, if something in its folder leads elsewhere, or what the operating system says.
pub fn keep_replay(run: &Path, name: &str, content: &[u8]) -> Result<PathBuf> {
    let folder = StoredRun::open(run)?.folder;
    let replays = Path::new(REPLAYS);
    disk::ensure_folder(&RealDisk, &folder, replays)?;
    let path = replays.join(name);
    disk::replace(&RealDisk, &folder, &path, content)?;
    Ok(folder.shown(path))
}

/// Reads the checkpoint in a folder of its own.
///
/// # Errors
/// [`RunError::BadData`] if it is not what its manifest says; otherwise what the operating system says.
pub fn read_checkpoint(path: &Path) -> Result<Checkpoint> {
    checkpoints::read_alone(&Folder::open(path)?)
}
