//! The few operations by which a run changes what is on disk, and what is built from them.
//!
//! They stand behind a trait so that tests can make every single one of them fail; nothing else implements it.

use std::{
    fmt::Debug,
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
};

use crate::error::{Context, Result};

/// Ending of what is not complete yet, or not needed any more: whoever finds it may remove it.
pub(super) const TEMPORARY: &str = "tmp";

/// What can be done to a disk.
pub(super) trait Disk: Debug {
    /// Makes a folder whose parent exists.
    fn create_folder(&self, path: &Path) -> io::Result<()>;
    /// Makes a file, or empties the one that is there.
    fn create(&self, path: &Path) -> io::Result<File>;
    /// Writes all of `content`.
    fn write(&self, file: &mut File, content: &[u8]) -> io::Result<()>;
    /// Waits until a file's content, or a folder's names, would survive a loss of power.
    fn sync(&self, file: &File) -> io::Result<()>;
    /// Gives a file or a folder another name, at once.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;
    /// Removes a folder and what is in it.
    fn remove_folder(&self, path: &Path) -> io::Result<()>;
}

/// The disk of this machine.
#[derive(Debug, Clone, Copy)]
pub(super) struct RealDisk;

impl Disk for RealDisk {
    fn create_folder(&self, path: &Path) -> io::Result<()> {
        fs::create_dir(path)
    }

    fn create(&self, path: &Path) -> io::Result<File> {
        File::create(path)
    }

    fn write(&self, file: &mut File, content: &[u8]) -> io::Result<()> {
        file.write_all(content)
    }

    fn sync(&self, file: &File) -> io::Result<()> {
        file.sync_all()
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        fs::remove_dir_all(path)
    }
}

/// Puts `content` at `path`, so that a reader, or a machine that loses power, finds the old content or the new and never a
/// mixture: a temporary file in the same folder, synced, renamed, and the folder synced.
///
/// # Errors
/// Path, bytes and what the operating system says; the file that was there is intact then.
pub(super) fn replace(disk: &dyn Disk, path: &Path, content: &[u8]) -> Result<()> {
    let temporary = temporary(path);
    let written = write_synced(disk, &temporary, content);
    let renamed = written.and_then(|()| rename(disk, &temporary, path));
    if renamed.is_err() {
        // The first error is the one to report; a leftover temporary file harms nobody.
        let _ = fs::remove_file(&temporary);
    }
    renamed?;
    path.parent()
        .map_or(Ok(()), |folder| sync_folder(disk, folder))
}

/// Writes a file and waits until its content is safe. Its name is safe when its folder has been synced as well.
pub(super) fn write_synced(disk: &dyn Disk, path: &Path, content: &[u8]) -> Result<()> {
    let write = || {
        let mut file = disk.create(path)?;
        disk.write(&mut file, content)?;
        disk.sync(&file)
    };
    write().with_context(|| cannot_write(path, content.len()))
}

/// Gives a file or a folder another name.
pub(super) fn rename(disk: &dyn Disk, from: &Path, to: &Path) -> Result<()> {
    disk.rename(from, to)
        .with_context(|| format!("{} to {}", cannot("rename", from), to.display()))
}

/// Makes the names in a folder safe; only Unix lets a folder be opened and synced.
pub(super) fn sync_folder(disk: &dyn Disk, folder: &Path) -> Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    // The parent of a relative path of one name has an empty name.
    let folder = match folder {
        empty if empty.as_os_str().is_empty() => Path::new("."),
        named => named,
    };
    File::open(folder)
        .and_then(|file| disk.sync(&file))
        .with_context(|| cannot("sync", folder))
}

/// The name under which something is written that shall become `path`.
pub(super) fn temporary(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(TEMPORARY);
    name.into()
}

/// "cannot VERB PATH"
pub(super) fn cannot(verb: &str, path: &Path) -> String {
    format!("cannot {verb} {}", path.display())
}

/// "cannot write PATH (N bytes)"
pub(super) fn cannot_write(path: &Path, bytes: usize) -> String {
    format!("{} ({bytes} bytes)", cannot("write", path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_replacement_leaves_the_old_content() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("weights");
        replace(&RealDisk, &path, b"old").unwrap();
        // A folder in the way of the temporary file makes every write to it fail.
        fs::create_dir(temporary(&path)).unwrap();
        assert!(replace(&RealDisk, &path, b"new").is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
    }

    #[test]
    fn a_replacement_leaves_no_temporary_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("weights");
        replace(&RealDisk, &path, b"old").unwrap();
        replace(&RealDisk, &path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
