//! Reading files that may be anything: folders, devices, pipes that nobody writes into, files of many gigabytes.
//!
//! Only regular files are read, because a pipe may never have a writer. These are files that a person named, so links are followed;
//! what lies in a run folder is read through [`Folder`](crate::folder::Folder), which follows none.

use std::{
    fs::{self, File, FileType},
    io,
    path::Path,
};

use cap_std::{ambient_authority, fs::OpenOptions};

use crate::{
    error::{Context, Result, RunError},
    folder::read_bounded,
};

/// The content of a file of at most `length_max` bytes.
///
/// # Errors
/// What the operating system says, an error of the same kind for what is no regular file, or [`RunError::BadData`] if there is
/// more.
pub fn read(path: &Path, length_max: usize) -> Result<Vec<u8>> {
    let cannot = || format!("cannot read {}", path.display());
    let expect_file = |kind: FileType| {
        if kind.is_file() {
            return Ok(());
        }
        let message = format!("it is {}, expected a file", in_words(kind));
        Err(io::Error::new(io::ErrorKind::InvalidInput, message)).with_context(cannot)
    };
    // Opening some devices does something; a pipe that takes a file's place after this look is opened without waiting.
    expect_file(fs::metadata(path).with_context(cannot)?.file_type())?;
    let file = open_without_waiting(path).with_context(cannot)?;
    expect_file(file.metadata().with_context(cannot)?.file_type())?;
    read_bounded(file, path, length_max)
}

/// Opens a file; where a pipe stands, its other end is not waited for.
fn open_without_waiting(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    {
        use cap_fs_ext::OpenOptionsSyncExt;
        options.nonblock(true);
    }
    let file = cap_std::fs::File::open_ambient_with(path, &options, ambient_authority())?;
    Ok(file.into_std())
}

/// The text of a file of at most `length_max` bytes.
///
/// # Errors
/// As [`read`], and [`RunError::BadData`] if it is not UTF-8.
pub fn read_text(path: &Path, length_max: usize) -> Result<String> {
    text(&path.display().to_string(), read(path, length_max)?)
        .map_err(|message| RunError::BadData { message })
}

/// These bytes of the file called `name` as text, or what is wrong with them.
///
/// # Errors
/// Where they are not UTF-8, in words.
pub fn text(name: &str, bytes: Vec<u8>) -> Result<String, String> {
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        format!("{name}: not UTF-8 text at byte {at}")
    })
}

/// What is no regular file.
fn in_words(kind: FileType) -> &'static str {
    if kind.is_dir() {
        "a folder"
    } else {
        "a pipe or a device"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_its_bound_and_not_beyond() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, [7; 11]).unwrap();
        assert_eq!(read(&path, 11).unwrap(), [7; 11]);
        assert!(
            read(&path, 10)
                .unwrap_err()
                .to_string()
                .contains("at most 10 bytes")
        );
    }

    #[test]
    fn what_is_no_file_is_refused_before_it_is_opened() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |path: &Path| read(path, 11).unwrap_err().chain();
        assert!(refused(folder.path()).ends_with("it is a folder, expected a file"));
        if cfg!(unix) {
            let endless = refused(Path::new("/dev/zero"));
            assert_eq!(
                endless,
                "cannot read /dev/zero: it is a pipe or a device, expected a file"
            );
        }
    }
}
