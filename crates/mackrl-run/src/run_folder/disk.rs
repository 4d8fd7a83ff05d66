//! The few operations by which a run changes what is on disk, and what is built from them.
//!
//! They stand behind a trait so that tests can make every single one of them fail; nothing else implements it.

use std::{
    fmt::Debug,
    fs::File,
    io::{self, Write},
    path::{Path, PathBuf},
};

use cap_std::fs::OpenOptions;

use crate::{
    error::{Context, Result},
    folder::Folder,
};

/// Ending of what is not complete yet, or not needed any more: it may be removed.
pub(super) const TEMPORARY: &str = "tmp";

/// What can be done in a folder of a disk. Paths lead from that folder on.
pub(super) trait Disk: Debug {
    /// Makes a folder whose parent exists.
    fn create_folder(&self, within: &Folder, path: &Path) -> io::Result<()>;
    /// Makes a file, or empties the one that is there.
    fn create(&self, within: &Folder, path: &Path) -> io::Result<File>;
    /// Writes all of `content`.
    fn write(&self, file: &mut File, content: &[u8]) -> io::Result<()>;
    /// Waits until a file's content, or a folder's names, would survive a loss of power.
    fn sync(&self, file: &File) -> io::Result<()>;
    /// Gives a file or a folder another name, at once.
    fn rename(&self, within: &Folder, from: &Path, to: &Path) -> io::Result<()>;
    /// Gives a file a second name.
    fn link(&self, within: &Folder, from: &Path, to: &Path) -> io::Result<()>;
    /// Removes a folder and what is in it.
    fn remove_folder(&self, within: &Folder, path: &Path) -> io::Result<()>;
}

/// The disk of this machine.
#[derive(Debug, Clone, Copy)]
pub(super) struct RealDisk;

impl Disk for RealDisk {
    fn create_folder(&self, within: &Folder, path: &Path) -> io::Result<()> {
        within.dir().create_dir(path)
    }

    fn create(&self, within: &Folder, path: &Path) -> io::Result<File> {
        let mut options = OpenOptions::new();
        within.open_with(path, options.write(true).create(true).truncate(true))
    }

    fn write(&self, file: &mut File, content: &[u8]) -> io::Result<()> {
        file.write_all(content)
    }

    fn sync(&self, file: &File) -> io::Result<()> {
        file.sync_all()
    }

    fn rename(&self, within: &Folder, from: &Path, to: &Path) -> io::Result<()> {
        within.dir().rename(from, within.dir(), to)
    }

    fn link(&self, within: &Folder, from: &Path, to: &Path) -> io::Result<()> {
        within.dir().hard_link(from, within.dir(), to)
    }

    fn remove_folder(&self, within: &Folder, path: &Path) -> io::Result<()> {
        within.dir().remove_dir_all(path)
    }
}

/// Puts `content` at `path`, so that a reader, or a machine that loses power, finds the old content or the new and never a
/// mixture: a temporary file in the same folder, synced, renamed, and the folder synced.
///
/// # Errors
/// Path, bytes and what the operating system says; the file that was there is intact then.
pub(super) fn replace(disk: &dyn Disk, within: &Folder, path: &Path, content: &[u8]) -> Result<()> {
    let temporary = temporary(path);
    let written = write_synced(disk, within, &temporary, content);
    let renamed = written.and_then(|()| rename(disk, within, &temporary, path));
    if renamed.is_err() {
        // The first error is the one to report; a temporary file that is left does no harm.
        let _ = within.dir().remove_file(&temporary);
    }
    renamed?;
    sync_folder(disk, within, parent(path))
}

/// Writes a file and waits until its content is safe. Its name is safe when its folder has been synced as well.
pub(super) fn write_synced(
    disk: &dyn Disk,
    within: &Folder,
    path: &Path,
    content: &[u8],
) -> Result<()> {
    let write = || {
        let mut file = disk.create(within, path)?;
        disk.write(&mut file, content)?;
        disk.sync(&file)
    };
    write().with_context(|| cannot_write(&within.shown(path), content.len()))
}

/// Gives a file or a folder another name.
pub(super) fn rename(disk: &dyn Disk, within: &Folder, from: &Path, to: &Path) -> Result<()> {
    disk.rename(within, from, to).with_context(|| {
        let to = within.shown(to);
        format!("{} to {}", within.cannot("rename", from), to.display())
    })
}

/// Makes the names in a folder safe; only Unix lets a folder be opened and synced.
pub(super) fn sync_folder(disk: &dyn Disk, within: &Folder, path: &Path) -> Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    let path = if path.as_os_str().is_empty() {
        Path::new(".")
    } else {
        path
    };
    within
        .open_with(path, OpenOptions::new().read(true))
        .and_then(|file| disk.sync(&file))
        .with_context(|| within.cannot("sync", path))
}

/// Makes a folder whose parent exists, unless it is there.
pub(super) fn ensure_folder(disk: &dyn Disk, within: &Folder, path: &Path) -> Result<()> {
    if within.kind(path)?.is_some() {
        return Ok(());
    }
    disk.create_folder(within, path)
        .with_context(|| within.cannot("create", path))?;
    sync_folder(disk, within, parent(path))
}

/// The folder that a path lies in.
pub(super) fn parent(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

/// The name under which something is written that shall become `path`.
pub(super) fn temporary(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(TEMPORARY);
    name.into()
}

/// "cannot write PATH (N bytes)"
pub(super) fn cannot_write(path: &Path, bytes: usize) -> String {
    format!("cannot write {} ({bytes} bytes)", path.display())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_failed_replacement_leaves_the_old_content() {
        let parent = tempfile::tempdir().unwrap();
        let folder = Folder::open(parent.path()).unwrap();
        let path = Path::new("weights");
        replace(&RealDisk, &folder, path, b"old").unwrap();
        // A folder in the way of the temporary file makes every write to it fail.
        fs::create_dir(parent.path().join(temporary(path))).unwrap();
        assert!(replace(&RealDisk, &folder, path, b"new").is_err());
        assert_eq!(fs::read(parent.path().join(path)).unwrap(), b"old");
    }

    #[test]
    fn a_replacement_leaves_no_temporary_file() {
        let parent = tempfile::tempdir().unwrap();
        let folder = Folder::open(parent.path()).unwrap();
        let path = Path::new("weights");
        replace(&RealDisk, &folder, path, b"old").unwrap();
        replace(&RealDisk, &folder, path, b"new").unwrap();
        assert_eq!(fs::read(parent.path().join(path)).unwrap(), b"new");
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 1);
    }
}
