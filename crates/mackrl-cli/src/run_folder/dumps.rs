//! What an update leaves that was refused because of a number that is not finite.
//!
//! ```text
//! dumps/update-41/                       the update after 41 others
//!     config.toml                        that of the run
//!     tensors.safetensors, counters.json the run before the update, as in a checkpoint
//!     failure.json                       the number, and where the run comes from
//!     manifest.json                      length and hash of these
//! ```
//!
//! A run is a function of its configuration and of its state, so this is all that the update needs to go wrong once more: the
//! episodes that it learnt from are played again, from the same draws. A dump needs no other file and can be sent to somebody.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use anyhow::Context;
use mackrl::NotFinite;
use mackrl_run::{
    config::{Config, ConfigBuilder},
    training::Checkpoint,
};
use serde::{Deserialize, Serialize};

use super::{
    CONFIG,
    checkpoints::{self, COUNTERS, MANIFEST, Surroundings, TENSORS},
    disk::{self, Disk, cannot},
    manifest::{FORMAT, Fingerprint, Manifest},
};
use crate::{bounded, failure::Failure, provenance::Provenance};

const DUMPS: &str = "dumps";
const FAILURE: &str = "failure.json";
/// Beginning of a dump's name, before the number of the update.
const UPDATE: &str = "update-";
/// Greatest length of a file that holds settings, numbers or hashes.
const TEXT_MAX: usize = 2 << 20;
/// Greatest length of the tensors: what a run on the largest map with 4096 hidden units has, and more.
const TENSORS_MAX: usize = 1 << 32;

/// Why an update was refused.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Refusal {
    /// In words.
    pub(crate) message: String,
    /// The number that is not finite.
    pub(crate) number: NotFinite,
    /// Where the run comes from.
    pub(crate) provenance: Provenance,
}

/// A dump that was read and is as it was written.
#[derive(Debug, Clone)]
pub(crate) struct Dump {
    pub(crate) path: PathBuf,
    pub(crate) config: Config,
    /// The run before the update.
    pub(crate) before: Checkpoint,
    pub(crate) refusal: Refusal,
}

/// Writes the dump of a refused update, and gives its path. One that is there already is replaced.
///
/// # Errors
/// Path, bytes and what the operating system says.
pub(super) fn write(
    disk: &dyn Disk,
    run: &Path,
    (refusal, before): (&Refusal, &Checkpoint),
    config: &[u8],
    surroundings: Surroundings,
) -> anyhow::Result<PathBuf> {
    let update = refusal.number.moment.map_or(0, |moment| moment.update);
    let place = run.join(DUMPS).join(format!("{UPDATE}{update}"));
    let failure = serde_json::to_string_pretty(refusal)? + "\n";
    let mut contents = checkpoints::contents(before).to_vec();
    contents.extend([(CONFIG, config), (FAILURE, failure.as_bytes())]);
    checkpoints::create_parent(disk, &place)?;
    for old in [disk::temporary(&place), place.clone()] {
        if old.exists() {
            disk.remove_folder(&old)
                .with_context(|| cannot("remove", &old))?;
        }
    }
    checkpoints::make(disk, &place, &contents, surroundings)?;
    Ok(place)
}

impl Dump {
    /// Reads the dump at `path`, or the latest one of the run there.
    ///
    /// # Errors
    /// [`Failure::NotADump`] if there is none; otherwise what is wrong with which file.
    pub(crate) fn open(path: &Path) -> anyhow::Result<Self> {
        let path = if path.join(FAILURE).exists() {
            path.to_owned()
        } else {
            let none = || Failure::NotADump {
                folder: path.to_owned(),
            };
            latest(path)?.ok_or_else(none)?
        };
        let manifest_path = path.join(MANIFEST);
        let manifest: Manifest = serde_json::from_slice(&bounded::read(&manifest_path, TEXT_MAX)?)
            .map_err(|error| damaged(&manifest_path, &error))?;
        if manifest.format != FORMAT {
            let expected = format!("has format {}, expected {FORMAT}", manifest.format);
            return Err(damaged(&manifest_path, &expected));
        }
        let files = Files {
            folder: &path,
            files: &manifest.files,
        };
        let config = files.text(CONFIG)?;
        let refusal = serde_json::from_str(&files.text(FAILURE)?)
            .map_err(|error| damaged(&path.join(FAILURE), &error))?;
        let name = path.join(CONFIG).display().to_string();
        Ok(Self {
            config: ConfigBuilder::new().file(&name, &config)?.build()?,
            before: Checkpoint {
                tensors: files.read(TENSORS, TENSORS_MAX)?,
                counters: files.read(COUNTERS, TEXT_MAX)?,
            },
            refusal,
            path,
        })
    }
}

/// The files that a manifest lists.
struct Files<'a> {
    folder: &'a Path,
    files: &'a BTreeMap<String, Fingerprint>,
}

impl Files<'_> {
    fn read(&self, name: &str, length_max: usize) -> anyhow::Result<Vec<u8>> {
        let path = self.folder.join(name);
        let content = bounded::read(&path, length_max)?;
        if self.files.get(name) != Some(&Fingerprint::of(&content)) {
            return Err(damaged(&path, &format!("is not what {MANIFEST} says")));
        }
        Ok(content)
    }

    fn text(&self, name: &str) -> anyhow::Result<String> {
        String::from_utf8(self.read(name, TEXT_MAX)?)
            .map_err(|error| damaged(&self.folder.join(name), &error))
    }
}

fn damaged(path: &Path, problem: &dyn std::fmt::Display) -> anyhow::Error {
    let message = format!("{}: {problem}", path.display());
    Failure::BadData { message }.into()
}

/// The dump of the latest update among those of the run at `run`.
fn latest(run: &Path) -> anyhow::Result<Option<PathBuf>> {
    let folder = run.join(DUMPS);
    let entries = match fs::read_dir(&folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        entries => entries.with_context(|| cannot("read", &folder))?,
    };
    let names = entries
        .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
        .collect::<io::Result<Vec<_>>>()
        .with_context(|| cannot("read", &folder))?;
    let number = |name: &String| name.strip_prefix(UPDATE)?.parse::<u64>().ok();
    let latest = names.iter().filter_map(number).max();
    Ok(latest.map(|update| folder.join(format!("{UPDATE}{update}"))))
}
