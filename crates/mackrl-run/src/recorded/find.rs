//! From folders that were named to the runs below them.

use std::{
    collections::BTreeSet,
    ffi::OsString,
    fs,
    path::{Path, PathBuf},
};

use super::{KEPT, RecordedRun, TRAINING};
use crate::{
    error::{Context, Result, RunError},
    run_folder,
};

/// How far below a named folder runs are looked for.
const DEPTH_MAX: usize = 5;
/// More runs than anybody compares: a folder that holds more was named by mistake.
const RUNS_MAX: usize = 10_000;

/// The runs in or below `paths`, in the order of their names, each once.
///
/// # Errors
/// If there is none at one of the paths, or one cannot be read.
pub fn find(paths: &[PathBuf]) -> Result<Vec<RecordedRun>> {
    locate(paths)?.into_iter().map(open).collect()
}

/// Reads the run at a path that [`locate`] gave: a run folder, or a file that is kept of a run.
///
/// # Errors
/// If it cannot be read.
pub fn open(path: PathBuf) -> Result<RecordedRun> {
    match is_kept(&path) {
        true => RecordedRun::open_kept(path),
        false => RecordedRun::open(path),
    }
}

/// Where the runs in or below `paths` lie, in the order of their names, each once; none of them is read.
///
/// # Errors
/// If there is none at one of the paths, or one cannot be read.
pub fn locate(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut found = BTreeSet::new();
    for path in paths {
        let before = found.len();
        let canonical =
            (path.canonicalize()).with_context(|| format!("cannot read {}", path.display()))?;
        let mut here = BTreeSet::new();
        collect(path, &canonical, DEPTH_MAX, &mut here)?;
        if here.is_empty() {
            let message = format!("there is no run in or below {}", path.display());
            return Err(RunError::Selection { message });
        }
        found.extend(here);
        debug_assert!(found.len() >= before, "nothing is forgotten");
    }
    // Ordered by where they really are, so that a run that is named twice counts once; shown as they were named.
    Ok(found.into_iter().map(|(_, shown)| shown).collect())
}

/// Whether a file is named as those that are kept of runs.
fn is_kept(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "json") && path.is_file()
}

/// Adds the run at a path, or those below it: where it really is, and how it was named.
fn collect(
    shown: &Path,
    canonical: &Path,
    depth: usize,
    found: &mut BTreeSet<(PathBuf, PathBuf)>,
) -> Result<()> {
    if run_folder::is_run(canonical) || is_kept(canonical) {
        if !found.iter().any(|(real, _)| real == canonical) {
            found.insert((canonical.to_owned(), shown.to_owned()));
        }
        if found.len() > RUNS_MAX {
            let message = format!(
                "there are more than {RUNS_MAX} runs below {}",
                shown.display()
            );
            return Err(RunError::Selection { message });
        }
        return Ok(());
    }
    if depth == 0 || !canonical.is_dir() {
        return Ok(());
    }
    let cannot = || format!("cannot read {}", shown.display());
    let mut names = Vec::new();
    for entry in fs::read_dir(canonical).with_context(cannot)? {
        let entry = entry.with_context(cannot)?;
        // Links are not followed: they could lead in a circle.
        if entry.file_type().with_context(cannot)?.is_dir() {
            names.push(entry.file_name());
        }
    }
    names.sort();
    // A run that is kept in a file is not counted once more by its folder.
    let kept = kept_beside(canonical);
    names.retain(|name| !kept.contains(Path::new(name)));
    if canonical.ends_with(KEPT) {
        names.extend(kept_files(canonical));
    }
    names
        .iter()
        .try_for_each(|name| collect(&shown.join(name), &canonical.join(name), depth - 1, found))
}

/// The names of the files in a folder that are named as those that are kept of runs.
fn kept_files(folder: &Path) -> Vec<OsString> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    // A link that was found, and not named, could lead to anything.
    let is_plain = |entry: &fs::DirEntry| entry.file_type().is_ok_and(|kind| kind.is_file());
    let kept = entries.filter(|entry| is_plain(entry) && is_kept(&entry.path()));
    let mut names: Vec<OsString> = kept.map(|entry| entry.file_name()).collect();
    names.sort();
    names
}

/// The names of runs of which files are kept beside `training`, the folder of their run folders.
fn kept_beside(training: &Path) -> BTreeSet<PathBuf> {
    match training.parent() {
        Some(figure) if training.ends_with(TRAINING) => kept_files(&figure.join(KEPT))
            .into_iter()
            .map(|name| Path::new(&name).with_extension(""))
            .collect(),
        _ => BTreeSet::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kept_runs_are_found_once_and_their_folders_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        let config = crate::config::Config::default().to_toml();
        for name in [
            "training/3m-mackrl-seed1",
            "training/3m-mackrl-seed2",
            "runs",
            "other",
        ] {
            fs::create_dir_all(folder.path().join(name)).unwrap();
        }
        for name in ["training/3m-mackrl-seed1", "training/3m-mackrl-seed2"] {
            fs::write(folder.path().join(name).join("config.toml"), &config).unwrap();
        }
        let kept = serde_json::to_string(&crate::recorded::TrainingRun::new(
            &crate::config::Config::default(),
            vec![0.0, 0.5],
            Vec::new(),
        ));
        fs::write(
            folder.path().join("runs/3m-mackrl-seed1.json"),
            kept.unwrap(),
        )
        .unwrap();
        fs::write(folder.path().join("other/unrelated.json"), "{}").unwrap();
        let found = find(&[folder.path().to_owned(), folder.path().join("runs")]).unwrap();
        let names: Vec<PathBuf> = (found.iter())
            .map(|run| run.path.strip_prefix(folder.path()).unwrap().to_owned())
            .collect();
        let expected = ["runs/3m-mackrl-seed1.json", "training/3m-mackrl-seed2"];
        assert_eq!(names, expected.map(PathBuf::from));
        assert!(find(&[folder.path().join("other")]).is_err());
    }
}
