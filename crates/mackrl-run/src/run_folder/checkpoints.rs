//! The checkpoints of a run.
//!
//! ```text
//! checkpoints/000000000042/              after 42 updates and tests
//!     tensors.safetensors                parameters, target critic, moments of the optimisers
//!     counters.json                      counters, schedules, sums of the unfinished row of metrics
//!     best.safetensors                   the weights that did best in a test so far, as the run folder has them
//!     memory.episodes, memory-*.episodes a replay memory, if the algorithm has one; see [`memory`]
//!     manifest.json                      length and hash of these, of config.toml, of metrics.jsonl so far, and of other
//!                                        weights that the run folder keeps
//! ```
//!
//! A checkpoint is made under a temporary name, and loses its name before it is removed. So a folder without the ending `.tmp`
//! is whole, whenever the program or the machine stopped. Two checkpoints of one number are equal to the byte, because a run
//! is a function of its configuration.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::{
    CHECKPOINTS, CONFIG, METRICS,
    disk::{self, Disk},
    kept::Kept,
    manifest::{FORMAT, Fingerprint, Growing, Manifest},
    memory::{self, MEMORY},
    stored::{ConfigFile, Plan},
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

/// Writes the checkpoint with this number, unless it is there, and removes all but the latest `kept` up to it; where it has no
/// replay memory, because the run ends with it, also those that have one.
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
        let mut numbers = numbers(run)?;
        numbers.retain(|&other| other < number);
        let before = numbers.last().map(|&before| self::place(before));
        make(disk, run, &place, (checkpoint, before), surroundings)?;
    }
    let mut numbers = numbers(run)?;
    numbers.retain(|&other| other <= number);
    let superfluous = numbers.len().saturating_sub(kept);
    for (position, &old) in numbers.iter().enumerate() {
        if position < superfluous || old < number && outlives_memory(run, checkpoint, old)? {
            remove(disk, run, old)?;
        }
    }
    Ok(())
}

/// Whether an earlier checkpoint has a replay memory and this one, the last of a run, needs none any more: memories are large.
fn outlives_memory(run: &Folder, checkpoint: &Checkpoint, earlier: u64) -> Result<bool> {
    Ok(checkpoint.memory.is_none() && run.kind(place(earlier).join(MEMORY))?.is_some())
}

/// Makes a folder of the checkpoint's files and their manifest; what could not be completed is removed again, since a full disk
/// needs the room. Blocks of a replay memory are linked where the checkpoint `before` has them.
fn make(
    disk: &dyn Disk,
    run: &Folder,
    place: &Path,
    (checkpoint, before): (&Checkpoint, Option<PathBuf>),
    Surroundings {
        config,
        metrics,
        weights,
    }: Surroundings,
) -> Result<()> {
    let temporary = disk::temporary(place);
    let complete = || {
        disk.create_folder(run, &temporary)
            .with_context(|| run.cannot("create", &temporary))?;
        let mut files = BTreeMap::new();
        let mut write = |name: &str, content: &[u8]| {
            files.insert(name.to_owned(), Fingerprint::of(content));
            disk::write_synced(disk, run, &temporary.join(name), content)
        };
        write(TENSORS, &checkpoint.tensors)?;
        write(COUNTERS, &checkpoint.counters)?;
        if let Some(best) = &checkpoint.best {
            write(BEST, best)?;
        }
        if let Some(own) = &checkpoint.memory {
            write(MEMORY, &memory::rest(own))?;
            let mut missing = Vec::new();
            let held = before.and_then(|before| Some((read_manifest(run, &before).ok()?, before)));
            for block in memory::whole_blocks(&memory::numbers(own)) {
                let name = memory::block_name(block);
                let linked = held.as_ref().and_then(|(manifest, before)| {
                    let fingerprint = manifest.files.get(&name)?;
                    let (from, to) = (before.join(&name), temporary.join(&name));
                    // Where links cannot be made, the block is written.
                    disk.link(run, &from, &to).ok()?;
                    Some(fingerprint.clone())
                });
                match linked {
                    Some(fingerprint) => {
                        files.insert(name, fingerprint);
                    }
                    None => missing.push((name, block)),
                }
            }
            for (name, block) in missing {
                let content = memory::block(own, block);
                files.insert(name.clone(), Fingerprint::of(&content));
                disk::write_synced(disk, run, &temporary.join(name), &content)?;
            }
        }
        let manifest = Manifest {
            format: FORMAT,
            code: CODE.to_owned(),
            config: config.clone(),
            metrics: metrics.clone(),
            weights: weights.clone(),
            files,
        };
        let manifest = serde_json::to_string_pretty(&manifest).expect("hashes can be written");
        let manifest = manifest + "\n";
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

/// How much of a checkpoint is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    /// All that a run continues from.
    Everything,
    /// The parameters; a replay memory is not looked at.
    Parameters,
}

/// The latest checkpoint that is as it was written, if the run has checkpoints, and what is wrong with later ones. Its tensors
/// are expected to have at most `tensors_max` bytes.
///
/// # Errors
/// [`RunError::BadData`] if there are checkpoints and none can be used.
pub(super) fn latest(
    run: &Folder,
    config: &ConfigFile,
    (wanted, tensors_max): (Wanted, usize),
) -> Result<(Option<Stored>, Vec<String>)> {
    let mut wrong = Vec::new();
    for number in numbers(run)?.into_iter().rev() {
        match read(run, config, number, (wanted, tensors_max)) {
            Ok(Some(stored)) => return Ok((Some(stored), wrong)),
            Ok(None) => {}
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

/// Reads a checkpoint, and compares everything with its manifest; nothing, if it is one from the end of a run that was extended
/// since. The configuration decides what a checkpoint means; the metrics
/// only stand beside it, so damage to them costs no checkpoint.
fn read(
    run: &Folder,
    config: &ConfigFile,
    number: u64,
    wanted: (Wanted, usize),
) -> Result<Option<Stored>> {
    let place = place(number);
    let manifest = read_manifest(run, &place)?;
    let Some(plan) = config.plan(&manifest.config) else {
        return Err(differs(run, Path::new(CONFIG)));
    };
    let checkpoint = read_files(run, &place, &manifest, wanted)?;
    if let Plan::Former(steps_env) = plan
        && !checkpoint.is_before_end(steps_env)?
    {
        return Ok(None);
    }
    let metrics = match run.file(METRICS)? {
        Some(file) => (manifest.metrics.begins(file))
            .with_context(|| run.cannot("read", Path::new(METRICS)))?,
        None => manifest.metrics.begins(&b""[..]).unwrap_or_default(),
    };
    Ok(Some(Stored {
        number,
        checkpoint,
        metrics,
        weights: manifest.weights,
    }))
}

/// Reads the checkpoint in a folder whose run is not known.
pub(super) fn read_alone(checkpoint: &Folder) -> Result<Checkpoint> {
    let manifest = read_manifest(checkpoint, Path::new(""))?;
    // What the file should hold bounds how much of it is read.
    let expected = manifest.files.get(TENSORS).map_or(0, |file| file.bytes);
    let tensors_max = usize::try_from(expected).unwrap_or(usize::MAX);
    read_files(
        checkpoint,
        Path::new(""),
        &manifest,
        (Wanted::Everything, tensors_max),
    )
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
    (wanted, tensors_max): (Wanted, usize),
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
    let has_memory = wanted == Wanted::Everything && manifest.files.contains_key(MEMORY);
    let memory = has_memory.then(|| {
        // Nothing larger than the files themselves is made of them.
        let read = |name: &str| {
            let bytes = manifest.files.get(name).map_or(0, |file| file.bytes);
            own(name, usize::try_from(bytes).unwrap_or(usize::MAX))
        };
        memory::assemble(read, |name| differs(folder, &place.join(name)))
    });
    Ok(Checkpoint {
        tensors: own(TENSORS, tensors_max)?,
        counters: own(COUNTERS, COUNTERS_MAX)?,
        best: has_best.then(|| own(BEST, tensors_max)).transpose()?,
        memory: memory.transpose()?,
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
