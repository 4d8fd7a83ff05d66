//! A folder that was opened once, and all that is looked up in it.
//!
//! A path is looked up anew at every use: when the folder that it named was moved or removed, another one in its place gets what
//! was meant for the first. Here every name is looked up in the folder that was opened (`openat` and its kin, by the crate
//! `cap-std`). Its content may be a stranger's: links are not followed, nothing waits for the other end of a pipe, and no file is
//! read beyond a stated length.

use std::{
    fmt,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

use cap_fs_ext::{FollowSymlinks, OpenOptionsFollowExt};
use cap_std::{
    ambient_authority,
    fs::{Dir, FileType, OpenOptions},
};

use crate::error::{Context, Result, RunError};

/// A folder that was opened once.
pub struct Folder {
    dir: Dir,
    path: PathBuf,
}

/// What a name in a folder stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A plain file.
    File,
    /// A folder.
    Folder,
    /// A symbolic link, wherever it leads.
    Link,
    /// A pipe, a socket or a device.
    Other,
}

impl Kind {
    fn of(file_type: FileType) -> Self {
        match file_type {
            kind if kind.is_symlink() => Self::Link,
            kind if kind.is_file() => Self::File,
            kind if kind.is_dir() => Self::Folder,
            _ => Self::Other,
        }
    }

    const fn in_words(self) -> &'static str {
        match self {
            Self::File => "a file",
            Self::Folder => "a folder",
            Self::Link => "a symbolic link",
            Self::Other => "neither a file nor a folder",
        }
    }
}

impl Folder {
    /// Opens the folder that a person named; the path itself may lead over links.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn open(path: &Path) -> Result<Self> {
        let named = if path.as_os_str().is_empty() {
            Path::new(".")
        } else {
            path
        };
        let dir = Dir::open_ambient_dir(named, ambient_authority())
            .with_context(|| format!("cannot open {}", path.display()))?;
        let path = path.to_owned();
        Ok(Self { dir, path })
    }

    /// Where it lay when it was opened.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A name in it, as it is shown.
    pub(crate) fn shown(&self, name: impl AsRef<Path>) -> PathBuf {
        self.path.join(name)
    }

    /// What stands under a name; nothing, if nothing does.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn kind(&self, name: impl AsRef<Path>) -> Result<Option<Kind>> {
        let name = name.as_ref();
        match self.dir.symlink_metadata(name) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            found => {
                let found = found.with_context(|| self.cannot("look at", name))?;
                Ok(Some(Kind::of(found.file_type())))
            }
        }
    }

    /// The names in it and what they stand for, in the order of the names; of a folder inside it that is not there, none.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn entries(&self, inside: impl AsRef<Path>) -> Result<Vec<(String, Kind)>> {
        let inside = inside.as_ref();
        let place = if inside.as_os_str().is_empty() {
            Path::new(".")
        } else {
            inside
        };
        let entries = match self.dir.read_dir(place) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries.with_context(|| self.cannot("read", inside))?,
        };
        let mut found = Vec::new();
        for entry in entries {
            let entry = entry.with_context(|| self.cannot("read", inside))?;
            match entry.file_type() {
                // It was removed meanwhile.
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                kind => {
                    let name = entry.file_name().to_string_lossy().into_owned();
                    let kind = kind.with_context(|| self.cannot("read", inside))?;
                    found.push((name, Kind::of(kind)));
                }
            }
        }
        found.sort_unstable_by(|(a, _), (b, _)| a.cmp(b));
        Ok(found)
    }

    /// Opens a plain file for reading; nothing, if there is none.
    ///
    /// # Errors
    /// [`RunError::BadData`] for what is no plain file; otherwise what the operating system says.
    pub fn file(&self, name: impl AsRef<Path>) -> Result<Option<File>> {
        let name = name.as_ref();
        let Some(kind) = self.kind(name)? else {
            return Ok(None);
        };
        self.expect(name, kind, Kind::File)?;
        match self.open_with(name, OpenOptions::new().read(true)) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            file => {
                let file = file.with_context(|| self.cannot("read", name))?;
                let metadata = file.metadata().with_context(|| self.cannot("read", name))?;
                // What was replaced between the look and the opening.
                let kind = if metadata.is_file() {
                    Kind::File
                } else {
                    Kind::Other
                };
                self.expect(name, kind, Kind::File)?;
                Ok(Some(file))
            }
        }
    }

    /// The content of a plain file of at most `length_max` bytes; nothing, if there is none.
    ///
    /// # Errors
    /// As [`Self::file`], and [`RunError::BadData`] if it is longer.
    pub fn read(&self, name: impl AsRef<Path>, length_max: usize) -> Result<Option<Vec<u8>>> {
        let name = name.as_ref();
        let Some(file) = self.file(name)? else {
            return Ok(None);
        };
        read_bounded(file, &self.shown(name), length_max).map(Some)
    }

    /// As [`Self::read`], of a file that has to be there.
    ///
    /// # Errors
    /// As [`Self::read`], and what the operating system says of a file that is missing.
    pub fn read_needed(&self, name: impl AsRef<Path>, length_max: usize) -> Result<Vec<u8>> {
        let name = name.as_ref();
        let missing = || io::Error::from(io::ErrorKind::NotFound);
        self.read(name, length_max)?
            .ok_or_else(missing)
            .with_context(|| self.cannot("read", name))
    }

    /// Refuses what is not of the expected kind.
    ///
    /// # Errors
    /// [`RunError::BadData`] with both.
    pub(crate) fn expect(&self, name: &Path, kind: Kind, expected: Kind) -> Result<()> {
        if kind == expected {
            return Ok(());
        }
        let message = format!(
            "{} is {}, expected {}: a run folder holds all that belongs to the run itself",
            self.shown(name).display(),
            kind.in_words(),
            expected.in_words()
        );
        Err(RunError::BadData { message })
    }

    /// Opens a file in it as `options` say, never over a link and never waiting.
    pub(crate) fn open_with(&self, name: &Path, options: &OpenOptions) -> io::Result<File> {
        let mut options = options.clone();
        options.follow(FollowSymlinks::No);
        #[cfg(unix)]
        {
            use cap_fs_ext::OpenOptionsSyncExt;
            options.nonblock(true);
        }
        Ok(self.dir.open_with(name, &options)?.into_std())
    }

    /// The folder itself, to be changed.
    pub(crate) const fn dir(&self) -> &Dir {
        &self.dir
    }

    /// "cannot VERB PATH"
    pub(crate) fn cannot(&self, verb: &str, name: &Path) -> String {
        format!("cannot {verb} {}", self.shown(name).display())
    }
}

impl fmt::Debug for Folder {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Folder").field(&self.path).finish()
    }
}

/// The rest of a file of at most `length_max` bytes.
pub(crate) fn read_bounded(file: File, path: &Path, length_max: usize) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(length_max as u64 + 1)
        .read_to_end(&mut bytes)
        .with_context(|| format!("cannot read {}", path.display()))?;
    if bytes.len() > length_max {
        let message = format!(
            "{} is too long, expected at most {length_max} bytes",
            path.display()
        );
        return Err(RunError::BadData { message });
    }
    Ok(bytes)
}
