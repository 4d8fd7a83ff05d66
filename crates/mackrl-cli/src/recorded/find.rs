//! From folders that were named to the runs below them.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;

use super::RecordedRun;
use crate::{failure::Failure, run_folder};

/// How far below a named folder runs are looked for.
const DEPTH_MAX: usize = 5;
/// More runs than anybody compares: a folder that holds more was named by mistake.
const RUNS_MAX: usize = 10_000;

/// The runs in or below `paths`, in the order of their names, each once.
///
/// # Errors
/// If there is none at one of the paths, or one cannot be read.
pub(crate) fn find(paths: &[PathBuf]) -> anyhow::Result<Vec<RecordedRun>> {
    let mut found = BTreeSet::new();
    for path in paths {
        let before = found.len();
        let canonical =
            (path.canonicalize()).with_context(|| format!("cannot read {}", path.display()))?;
        let mut here = BTreeSet::new();
        collect(path, &canonical, DEPTH_MAX, &mut here)?;
        if here.is_empty() {
            let message = format!("there is no run in or below {}", path.display());
            return Err(Failure::Usage { message }.into());
        }
        found.extend(here);
        debug_assert!(found.len() >= before, "nothing is forgotten");
    }
    // Ordered by where they really are, so that a run that is named twice counts once; shown as they were named.
    found
        .into_iter()
        .map(|(_, shown)| RecordedRun::open(shown))
        .collect()
}

/// Adds the run at a path, or those below it: where it really is, and how it was named.
fn collect(
    shown: &Path,
    canonical: &Path,
    depth: usize,
    found: &mut BTreeSet<(PathBuf, PathBuf)>,
) -> anyhow::Result<()> {
    if run_folder::is_run(canonical) {
        if !found.iter().any(|(real, _)| real == canonical) {
            found.insert((canonical.to_owned(), shown.to_owned()));
        }
        if found.len() > RUNS_MAX {
            let message = format!(
                "there are more than {RUNS_MAX} runs below {}",
                shown.display()
            );
            return Err(Failure::Usage { message }.into());
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
    names
        .iter()
        .try_for_each(|name| collect(&shown.join(name), &canonical.join(name), depth - 1, found))
}
