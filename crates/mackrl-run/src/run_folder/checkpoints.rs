//! The checkpoints of a run.
//!
//! ```text
//! checkpoints/000000000042/              after 42 updates and tests
//!     tensors.safetensors                parameters, target critic, moments of the optimisers
//!     counters.json                      counters, schedules, sums of the unfinished row of metrics
//!     best.safetensors                   the weights that did best in a test so far, as the run folder has them
//!     manifest.json                      length and hash of these, of config.toml, of metrics.jsonl so far, and of other
//!                                        weights that the run folder keeps
//! ```
//!
//! A checkpoint is made under a temporary name, and loses its name before it is removed. So a folder without the ending `.tmp`
//! is whole, whenever the program or the machine stopped. Two checkpoints of one number are equal to the byte, because a run
//! is a function of its configuration.

use std::path::{Path, PathBuf};

use super::{
    CHECKPOINTS, CONFIG, METRICS,
    disk::{self, Disk},
    kept::Kept,
    manifest::{FORMAT, Fingerprint, Growing, Manifest},
    stored::ConfigFile,
    untrusted,
};
use crate::{
    error::{Context, Result, RunError},
    folder::{Folder, Kind},
    provenance::CODE,
    training::Checkpoint,
};

pub(super) const TENSORS: &str = "tensors.safetensors";
pub(super) const COUNTERS: &str = "counters.json";
const BEST: &str = "best.safetensors";
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
    /// Without the best weights.
    pub(super) weights: Kept,
}

/// A checkpoint that was read and is as it was written.
#[derive(Debug, Clone)]
pub(super) struct Stored {
    pub(super) number: u64,
    pub(super) checkpoint: Checkpoint,
    /// The metrics that belong to it; nothing, if they were damaged, lost or replaced.
    pub(super) metrics: Option<Growing>,
    /// The weights that the run kept then, the best aside.
    pub(super) weights: Kept,
}

/// Writes the checkpoint with this number, unless it is there, and removes all but the latest `kept` up to it.
///
/// # Errors
/// Path, bytes and what the operating system says; earlier checkpoints are intact then.
pub(super) fn write(
    disk: &dyn Disk,
    run: &Folder,
    (number, checkpoint): (u64, &Checkpoint),
    surroundings: Surroundings,
    kept: usize,
) -> Result<()> {
    let place = place(number);
    if run.kind(&place)?.is_none() {
        disk::ensure_folder(disk, run, Path::new(CHECKPOINTS))?;
        make(disk, run, &place, &contents(checkpoint), surroundings)?;
    }
    let mut numbers = numbers(run)?;
    numbers.retain(|&other| other <= number);
    for &old in &numbers[..numbers.len().saturating_sub(kept)] {
        remove(disk, run, old)?;
    }
    Ok(())
}

/// The files of a checkpoint.
fn contents(checkpoint: &Checkpoint) -> Vec<(&'static str, &[u8])> {
    let best = checkpoint.best.iter();
    let mut contents: Vec<(&str, &[u8])> = vec![
        (TENSORS, &checkpoint.tensors),
        (COUNTERS, &checkpoint.counters),
    ];
    contents.extend(best.map(|best| (BEST, best.as_slice())));
    contents
}

/// Makes a folder of these files and their manifest; what could not be completed is removed again, since a full disk needs the
/// room.
fn make(
    disk: &dyn Disk,
    run: &Folder,
    place: &Path,
    contents: &[(&str, &[u8])],
    Surroundings {
        config,
        metrics,
        weights,
    }: Surroundings,
) -> Result<()> {
    let manifest = Manifest {
        format: FORMAT,
        code: CODE.to_owned(),
        config,
        metrics,
        weights,
        files: contents
            .iter()
            .map(|(name, content)| ((*name).to_owned(), Fingerprint::of(content)))
            .collect(),
    };
    let manifest = serde_json::to_string_pretty(&manifest).expect("hashes can be written") + "\n";
    let temporary = disk::temporary(place);
    let complete = || {
        disk.create_folder(run, &temporary)
            .with_context(|| run.cannot("create", &temporary))?;
        for (name, content) in contents {
            disk::write_synced(disk, run, &temporary.join(name), content)?;
        }
        disk::write_synced(disk, run, &temporary.join(MANIFEST), manifest.as_bytes())?;
        disk::sync_folder(disk, run, &temporary)?;
        disk::rename(disk, run, &temporary, place)
    };
    if let Err(error) = complete() {
        // The first error is the one to report; resuming removes what is left here.
        let _ = disk.remove_folder(run, &temporary);
        return Err(error);
    }
    disk::sync_folder(disk, run, disk::parent(place))
}

pub(super) fn remove(disk: &dyn Disk, run: &Folder, number: u64) -> Result<()> {
    let place = place(number);
    let temporary = disk::temporary(&place);
    disk::rename(disk, run, &place, &temporary)?;
    disk.remove_folder(run, &temporary)
        .with_context(|| run.cannot("remove", &temporary))
}

/// The latest checkpoint that is as it was written, if the run has checkpoints, and what is wrong with later ones. Its tensors
/// are expected to have at most `tensors_max` bytes.
///
/// # Errors
/// [`RunError::BadData`] if there are checkpoints and none can be used.
pub(super) fn latest(
    run: &Folder,
    config: &ConfigFile,
    tensors_max: usize,
) -> Result<(Option<Stored>, Vec<String>)> {
    let mut wrong = Vec::new();
    for number in numbers(run)?.into_iter().rev() {
        match read(run, config, number, tensors_max) {
            Ok(stored) => return Ok((Some(stored), wrong)),
            Err(error) => wrong.push(format!(
                "{} is damaged: {}",
                run.shown(place(number)).display(),
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
pub(super) fn tidy(disk: &dyn Disk, run: &Folder, latest: Option<u64>) -> Result<()> {
    for number in numbers(run)? {
        if latest.is_some_and(|latest| number > latest) {
            remove(disk, run, number)?;
        }
    }
    for (name, kind) in run.entries(CHECKPOINTS)? {
        let path = Path::new(CHECKPOINTS).join(name);
        let is_temporary = path.extension().is_some_and(|end| end == disk::TEMPORARY);
        if is_temporary && kind == Kind::Folder {
            disk.remove_folder(run, &path)
                .with_context(|| run.cannot("remove", &path))?;
        }
    }
    Ok(())
}

/// Where the weights of a checkpoint lie in the folder of the run.
pub(super) fn weights_path(number: u64) -> PathBuf {
    place(number).join(TENSORS)
}

/// Reads a checkpoint, and compares everything with its manifest. The configuration decides what a checkpoint means; the metrics
/// only stand beside it, so damage to them costs no checkpoint.
fn read(run: &Folder, config: &ConfigFile, number: u64, tensors_max: usize) -> Result<Stored> {
    let place = place(number);
    let manifest = read_manifest(run, &place)?;
    if !config.is(&manifest.config) {
        return Err(differs(run, Path::new(CONFIG)));
    }
    let metrics = match run.file(METRICS)? {
        Some(file) => (manifest.metrics.begins(file))
            .with_context(|| run.cannot("read", Path::new(METRICS)))?,
        None => manifest.metrics.begins(&b""[..]).unwrap_or_default(),
    };
    Ok(Stored {
        number,
        checkpoint: read_files(run, &place, &manifest, tensors_max)?,
        metrics,
        weights: manifest.weights,
    })
}

/// Reads the checkpoint in a folder whose run is not known.
pub(super) fn read_alone(checkpoint: &Folder) -> Result<Checkpoint> {
    let manifest = read_manifest(checkpoint, Path::new(""))?;
    // What the file should hold bounds how much of it is read.
    let expected = manifest.files.get(TENSORS).map_or(0, |file| file.bytes);
    let tensors_max = usize::try_from(expected).unwrap_or(usize::MAX);
    read_files(checkpoint, Path::new(""), &manifest, tensors_max)
}

fn read_manifest(folder: &Folder, place: &Path) -> Result<Manifest> {
    let place = place.join(MANIFEST);
    let manifest = folder.read_needed(&place, untrusted::TEXT_MAX)?;
    let manifest: Manifest =
        serde_json::from_slice(&manifest).map_err(|error| RunError::BadData {
            message: format!("{}: {error}", folder.cannot("understand", &place)),
        })?;
    if (1..=FORMAT).contains(&manifest.format) {
        return Ok(manifest);
    }
    let message = format!(
        "{} has format {}, expected at most {FORMAT}",
        folder.shown(place).display(),
        manifest.format
    );
    Err(RunError::BadData { message })
}

fn read_files(
    folder: &Folder,
    place: &Path,
    manifest: &Manifest,
    tensors_max: usize,
) -> Result<Checkpoint> {
    let own = |name: &str, length_max| {
        let path = place.join(name);
        let content = folder.read_needed(&path, length_max)?;
        match manifest.files.get(name) {
            Some(file) if *file == Fingerprint::of(&content) => Ok(content),
            _ => Err(differs(folder, &path)),
        }
    };
    let has_best = manifest.files.contains_key(BEST);
    Ok(Checkpoint {
        tensors: own(TENSORS, tensors_max)?,
        counters: own(COUNTERS, COUNTERS_MAX)?,
        best: has_best.then(|| own(BEST, tensors_max)).transpose()?,
    })
}

fn differs(folder: &Folder, path: &Path) -> RunError {
    let shown = folder.shown(path);
    let message = format!("{} is not what {MANIFEST} says", shown.display());
    RunError::BadData { message }
}

pub(super) fn place(number: u64) -> PathBuf {
    Path::new(CHECKPOINTS).join(format!("{number:0DIGITS$}"))
}

/// The numbers of all checkpoints, in order.
pub(super) fn numbers(run: &Folder) -> Result<Vec<u64>> {
    let entries = run.entries(CHECKPOINTS)?;
    let whole = entries.iter().filter(|(name, _)| name.len() == DIGITS);
    let mut numbers: Vec<u64> = whole.filter_map(|(name, _)| name.parse().ok()).collect();
    numbers.sort_unstable();
    Ok(numbers)
}
