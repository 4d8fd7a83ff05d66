//! Reading a run folder that a stranger made.
//!
//! It may hold anything: links that lead elsewhere, pipes that block, files without end. But a run folder holds all that belongs
//! to the run itself, so nothing of ours may be anything but a plain file or a plain folder, and no file is longer than what is
//! known to be in it. Without the first rule, resuming a stranger's run could cut off a file of one's own.

use std::{
    fs::{self, FileType},
    io,
    path::Path,
};

use super::{CHECKPOINTS, CONFIG, LOCK, METRICS, RUN, WEIGHTS, disk::cannot};
use crate::error::{Context, Result, RunError};

/// Greatest length of a file that holds settings, facts or hashes; a configuration may hold a scenario of 256 KiB.
pub(super) const TEXT_MAX: usize = 2 << 20;

/// Refuses a run folder in which one of our names is a link, a device, a pipe or a socket.
///
/// # Errors
/// [`RunError::BadData`] with the first such name.
pub(super) fn check(run: &Path) -> Result<()> {
    for (name, kind) in entries(run)? {
        let own = name.strip_suffix(".tmp").unwrap_or(&name);
        match own {
            CONFIG | METRICS | RUN | WEIGHTS | LOCK => expect_file(&run.join(&name), kind)?,
            CHECKPOINTS => expect_folder(&run.join(&name), kind)?,
            _ => {}
        }
    }
    let checkpoints = run.join(CHECKPOINTS);
    for (name, kind) in entries(&checkpoints)? {
        let checkpoint = checkpoints.join(name);
        expect_folder(&checkpoint, kind)?;
        for (name, kind) in entries(&checkpoint)? {
            expect_file(&checkpoint.join(name), kind)?;
        }
    }
    Ok(())
}

/// Names and kinds of what is in a folder, links not followed; of a folder that is not there, none.
fn entries(folder: &Path) -> Result<Vec<(String, FileType)>> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.with_context(|| cannot("read", folder))?,
    };
    entries
        .map(|entry| {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            Ok((name, entry.file_type()?))
        })
        .collect::<io::Result<_>>()
        .with_context(|| cannot("read", folder))
}

fn expect_file(path: &Path, kind: FileType) -> Result<()> {
    expect(path, kind.is_file(), kind, "a file")
}

fn expect_folder(path: &Path, kind: FileType) -> Result<()> {
    expect(path, kind.is_dir(), kind, "a folder")
}

fn expect(path: &Path, holds: bool, kind: FileType, expected: &str) -> Result<()> {
    if holds {
        return Ok(());
    }
    let found = match kind {
        kind if kind.is_symlink() => "a symbolic link",
        kind if kind.is_dir() => "a folder",
        kind if kind.is_file() => "a file",
        _ => "neither a file nor a folder",
    };
    let message = format!(
        "{} is {found}, expected {expected}: a run folder holds all that belongs to the run itself",
        path.display()
    );
    Err(RunError::BadData { message })
}
