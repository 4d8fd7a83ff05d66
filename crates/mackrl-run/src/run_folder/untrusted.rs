//! Reading a run folder that a stranger made.
//!
//! It may hold anything: links that lead elsewhere, pipes that block, files without end. But a run folder holds all that belongs
//! to the run itself, so nothing of ours may be anything but a plain file or a plain folder, and no file is longer than what is
//! known to be in it. Without the first rule, resuming a stranger's run could cut off a file of one's own.

use std::path::Path;

use super::{CHECKPOINTS, CONFIG, INITIAL, KEPT, LOCK, METRICS, REPLAYS, RUN, WEIGHTS};
use crate::{
    error::Result,
    folder::{Folder, Kind},
};

/// Greatest length of a file that holds settings, facts or hashes; a configuration may hold a scenario of 256 KiB.
pub(super) const TEXT_MAX: usize = 2 << 20;

/// Refuses a run folder in which one of our names is a link, a device, a pipe or a socket.
///
/// # Errors
/// [`RunError::BadData`](crate::RunError::BadData) with the first such name.
pub(super) fn check(run: &Folder) -> Result<()> {
    for (name, kind) in run.entries("")? {
        let own = name.strip_suffix(".tmp").unwrap_or(&name);
        match own {
            CONFIG | METRICS | RUN | WEIGHTS | INITIAL | LOCK => {
                run.expect(Path::new(&name), kind, Kind::File)?;
            }
            CHECKPOINTS | KEPT | REPLAYS => run.expect(Path::new(&name), kind, Kind::Folder)?,
            _ => {}
        }
    }
    for (name, kind) in run.entries(CHECKPOINTS)? {
        let checkpoint = Path::new(CHECKPOINTS).join(name);
        run.expect(&checkpoint, kind, Kind::Folder)?;
        expect_files(run, &checkpoint)?;
    }
    expect_files(run, Path::new(KEPT))?;
    expect_files(run, Path::new(REPLAYS))
}

fn expect_files(run: &Folder, inside: &Path) -> Result<()> {
    for (name, kind) in run.entries(inside)? {
        run.expect(&inside.join(name), kind, Kind::File)?;
    }
    Ok(())
}
