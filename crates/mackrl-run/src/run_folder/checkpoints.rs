//! The checkpoints of a run.
//!
//! ```text
//! checkpoints/000000000042/              after 42 updates and tests
//!     tensors.safetensors                parameters, target critic, moments of the optimisers
//!     counters.json                      counters, schedules, sums of the unfinished row of metrics
//!     manifest.json                      length and hash of these, of config.toml, and of metrics.jsonl so far
//! ```
//!
//! A checkpoint is made under a temporary name, and loses its name before it is removed. So a folder without the ending `.tmp`
//! is whole, whenever the program or the machine stopped. Two checkpoints of one number are equal to the byte, because a run
//! is a function of its configuration.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use super::{
    CHECKPOINTS, CONFIG, METRICS,
    disk::{self, Disk, cannot},
    manifest::{FORMAT, Fingerprint, Growing, Manifest},
    untrusted,
};
use crate::{
    bounded,
    error::{Context, Result, RunError},
    provenance::CODE,
    training::Checkpoint,
};

pub(super) const TENSORS: &str = "tensors.safetensors";
pub(super) const COUNTERS: &str = "counters.json";
pub(super) const MANIFEST: &str = "manifest.json";
/// Greatest length of the counters: a few dozen numbers.
const COUNTERS_MAX: usize = 1 << 20;
/// Digits of a number in the name of its folder: names sort as numbers do.
const DIGITS: usize = 12;

/// The files of the run that a checkpoint continues.
#[derive(Debug, Clone)]
pub(super) struct Surroundings {
    pub(super) config: Fingerprint,
    pub(super) metrics: Fingerprint,
}

/// A checkpoint that was read and is as it was written.
#[derive(Debug, Clone)]
pub(super) struct Stored {
    pub(super) number: u64,
    pub(super) checkpoint: Checkpoint,
    /// The metrics that belong to it.
    pub(super) metrics: Growing,
}

/// Writes the checkpoint with this number, unless it is there, and removes all but the latest `kept`.
///
/// # Errors
/// Path, bytes and what the operating system says; earlier checkpoints are intact then.
pub(super) fn write(
    disk: &dyn Disk,
    run: &Path,
    (number, checkpoint): (u64, &Checkpoint),
    surroundings: Surroundings,
    kept: usize,
) -> Result<()> {
    let place = place(run, number);
    if !place.exists() {
        create_parent(disk, &place)?;
        make(disk, &place, &contents(checkpoint), surroundings)?;
    }
    let numbers = numbers(run)?;
    for &old in &numbers[..numbers.len().saturating_sub(kept)] {
        remove(disk, run, old)?;
    }
    Ok(())
}

/// Makes the folder that `place` is to lie in, unless it is there.
pub(super) fn create_parent(disk: &dyn Disk, place: &Path) -> Result<()> {
    let parent = parent(place);
    if parent.exists() {
        return Ok(());
    }
    disk.create_folder(&parent)
        .with_context(|| cannot("create", &parent))?;
    disk::sync_folder(disk, &self::parent(&parent))
}

/// The files of a checkpoint.
pub(super) fn contents(checkpoint: &Checkpoint) -> [(&'static str, &[u8]); 2] {
    [
        (TENSORS, &checkpoint.tensors),
        (COUNTERS, &checkpoint.counters),
    ]
}

/// Makes a folder of these files and their manifest.
pub(super) fn make(
    disk: &dyn Disk,
    place: &Path,
    contents: &[(&str, &[u8])],
    Surroundings { config, metrics }: Surroundings,
) -> Result<()> {
    let manifest = Manifest {
        format: FORMAT,
        code: CODE.to_owned(),
        config,
        metrics,
        files: contents
            .iter()
            .map(|(name, content)| ((*name).to_owned(), Fingerprint::of(content)))
            .collect(),
    };
    let manifest = serde_json::to_string_pretty(&manifest).expect("hashes can be written") + "\n";
    let temporary = disk::temporary(place);
    disk.create_folder(&temporary)
        .with_context(|| cannot("create", &temporary))?;
    for (name, content) in contents {
        disk::write_synced(disk, &temporary.join(name), content)?;
    }
    disk::write_synced(disk, &temporary.join(MANIFEST), manifest.as_bytes())?;
    disk::sync_folder(disk, &temporary)?;
    disk::rename(disk, &temporary, place)?;
    disk::sync_folder(disk, &parent(place))
}

fn remove(disk: &dyn Disk, run: &Path, number: u64) -> Result<()> {
    let place = place(run, number);
    let temporary = disk::temporary(&place);
    disk::rename(disk, &place, &temporary)?;
    disk.remove_folder(&temporary)
        .with_context(|| cannot("remove", &temporary))
}

/// The latest checkpoint that is as it was written, if the run has checkpoints, and what is wrong with later ones. Its tensors
/// are expected to have at most `tensors_max` bytes.
///
/// # Errors
/// [`RunError::BadData`] if there are checkpoints and none can be used.
pub(super) fn latest(run: &Path, tensors_max: usize) -> Result<(Option<Stored>, Vec<String>)> {
    let mut wrong = Vec::new();
    for number in numbers(run)?.into_iter().rev() {
        match read(run, number, tensors_max) {
            Ok(stored) => return Ok((Some(stored), wrong)),
            Err(error) => wrong.push(format!(
                "{} is damaged: {}",
                place(run, number).display(),
                error.chain()
            )),
        }
    }
    if wrong.is_empty() {
        return Ok((None, wrong));
    }
    let message = wrong.join("; ");
    Err(RunError::BadData { message })
}

/// Removes what is not complete, and every checkpoint after the one with this number.
pub(super) fn tidy(disk: &dyn Disk, run: &Path, latest: Option<u64>) -> Result<()> {
    for number in numbers(run)? {
        if latest.is_some_and(|latest| number > latest) {
            remove(disk, run, number)?;
        }
    }
    for name in names(run)? {
        let path = run.join(CHECKPOINTS).join(name);
        if path.extension().is_some_and(|end| end == disk::TEMPORARY) {
            disk.remove_folder(&path)
                .with_context(|| cannot("remove", &path))?;
        }
    }
    Ok(())
}

/// Where the weights of a checkpoint lie.
pub(super) fn weights_path(run: &Path, number: u64) -> PathBuf {
    place(run, number).join(TENSORS)
}

/// Reads a checkpoint, and compares everything with its manifest.
fn read(run: &Path, number: u64, tensors_max: usize) -> Result<Stored> {
    let folder = place(run, number);
    let manifest = bounded::read(&folder.join(MANIFEST), untrusted::TEXT_MAX)?;
    let manifest: Manifest =
        serde_json::from_slice(&manifest).map_err(|error| RunError::BadData {
            message: format!("{}: {error}", cannot("understand", &folder.join(MANIFEST))),
        })?;
    if manifest.format != FORMAT {
        let message = format!(
            "{} has format {}, expected {FORMAT}",
            folder.join(MANIFEST).display(),
            manifest.format
        );
        return Err(RunError::BadData { message });
    }
    let differs = |path: &Path| RunError::BadData {
        message: format!("{} is not what {MANIFEST} says", path.display()),
    };
    let own = |name: &str, length_max| {
        let path = folder.join(name);
        let content = bounded::read(&path, length_max)?;
        let same = manifest.files.get(name) == Some(&Fingerprint::of(&content));
        if same {
            Ok(content)
        } else {
            Err(differs(&path))
        }
    };
    let beginning = |name: &str, fingerprint: &Fingerprint| {
        let path = run.join(name);
        let file = fs::File::open(&path).with_context(|| cannot("read", &path))?;
        let begins = fingerprint.begins(file);
        let begins = begins.with_context(|| cannot("read", &path))?;
        begins.ok_or_else(|| differs(&path))
    };
    beginning(CONFIG, &manifest.config)?;
    Ok(Stored {
        number,
        checkpoint: Checkpoint {
            tensors: own(TENSORS, tensors_max)?,
            counters: own(COUNTERS, COUNTERS_MAX)?,
        },
        metrics: beginning(METRICS, &manifest.metrics)?,
    })
}

fn place(run: &Path, number: u64) -> PathBuf {
    run.join(CHECKPOINTS).join(format!("{number:0DIGITS$}"))
}

fn parent(place: &Path) -> PathBuf {
    place.parent().map_or_else(PathBuf::new, Path::to_owned)
}

/// The numbers of all checkpoints, in order.
fn numbers(run: &Path) -> Result<Vec<u64>> {
    let names = names(run)?;
    let whole = names.iter().filter(|name| name.len() == DIGITS);
    let mut numbers: Vec<u64> = whole.filter_map(|name| name.parse().ok()).collect();
    numbers.sort_unstable();
    Ok(numbers)
}

/// What lies among the checkpoints.
fn names(run: &Path) -> Result<Vec<String>> {
    let folder = run.join(CHECKPOINTS);
    let entries = match fs::read_dir(&folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.with_context(|| cannot("read", &folder))?,
    };
    entries
        .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
        .collect::<io::Result<_>>()
        .with_context(|| cannot("read", &folder))
}
