//! Who writes in a run folder: one process at a time, on this machine or on another that shares the disk.
//!
//! The claim is the file `lock`. It is made with `O_EXCL`, which only one process can do, over NFS too; it says on which host and in
//! which job its process runs; it is locked as long as the process lives, and removed when it has done. What a killed process leaves
//! is taken over:
//!
//! | the lock is | the process ran | the claim |
//! |---|---|---|
//! | free | on this host | is left over: within one host locks can be relied on |
//! | free | on another host, in a job | holds until the job has ended: file systems may keep locks from other hosts |
//! | free | on another host, in no job | is left over: nothing but the lock can tell |
//! | held | on another host, in a job | holds, unless the job was begun again: a server may keep the lock of a host that is dead |
//! | held | else | holds |
//! | not known to the file system | in a job | holds until the job has ended |
//! | not known to the file system | in no job | holds |
//!
//! Whoever holds a claim makes sure before every write that `lock` still is the file that it made. So if two processes on two hosts should
//! take over one claim at the same moment, one of them stops before it writes.

use std::{
    fmt,
    fs::{File, TryLockError},
    io::{self, Write},
    path::{Path, PathBuf},
    thread,
    time::Duration,
};

use cap_std::fs::{Dir, OpenOptions};
use serde::{Deserialize, Serialize};

use super::LOCK;
use crate::{
    batch_system::{self, Fate, Job},
    error::{Context, Result, RunError},
    folder::{Folder, read_bounded},
};

/// Longest claim that is read, in bytes.
const LENGTH_MAX: usize = 1 << 14;
/// How long a claim may be without a word of who holds it, and how long somebody who only looks may hold the lock.
const PATIENCE: Duration = Duration::from_millis(100);
/// How often a claim is tried to be made that others make and leave at the same time.
const ATTEMPTS_MAX: usize = 10;

/// The process that writes in a run folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Holder {
    /// The name of its machine.
    pub host: String,
    /// Its number there.
    pub process: u32,
    /// The job of a batch system that it belongs to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub job: Option<Job>,
    /// The folder on that machine's own disk in which the run is made meanwhile.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scratch: Option<PathBuf>,
}

/// Whether a process writes in a run folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Occupation {
    /// None does.
    Free,
    /// One does; who, if it says so.
    Held(Option<Holder>),
    /// This one does, unless its job was begun again, or has ended where `is_free` says that no lock speaks for it.
    HeldByJob {
        holder: Holder,
        job: Job,
        is_free: bool,
    },
}

/// The right to write in a run folder, for as long as this lives.
#[derive(Debug)]
pub(super) struct Claim {
    file: File,
    within: Dir,
}

/// A claim that is there, as far as the file system tells.
struct There {
    file: File,
    holder: Option<Holder>,
    lock: Lock,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lock {
    Free,
    Held,
    Unsupported,
}

impl Holder {
    /// This process; `scratch` is where it makes the run, if that is not the run folder.
    fn own(scratch: Option<&Path>) -> Self {
        Self {
            host: host(),
            process: std::process::id(),
            job: Job::own(),
            scratch: scratch.map(Path::to_owned),
        }
    }
}

impl fmt::Display for Holder {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "process {} on {}", self.process, self.host)?;
        match &self.job {
            Some(job) => write!(formatter, ", job {job}"),
            None => Ok(()),
        }
    }
}

impl Occupation {
    /// Of the run folder at `path`; one that cannot be looked into is free.
    pub(crate) fn of(path: &Path) -> Self {
        let there = Folder::open(path).and_then(|folder| There::look(&folder));
        match there {
            Ok(Some(there)) => there.occupation(),
            _ => Self::Free,
        }
    }

    /// All of them, with those settled that depend on a job; the batch system is asked once.
    pub(crate) fn settled(mut occupations: Vec<Self>) -> Vec<Self> {
        let jobs: Vec<Job> = occupations.iter().filter_map(Self::job).cloned().collect();
        let mut fates = batch_system::fates(&jobs).into_iter();
        for occupation in &mut occupations {
            if let Self::HeldByJob {
                holder, is_free, ..
            } = occupation
            {
                let is_left = match fates.next() {
                    Some(Fate::BegunAgain) => true,
                    Some(Fate::Unknown) => *is_free,
                    _ => false,
                };
                *occupation = if is_left {
                    Self::Free
                } else {
                    Self::Held(Some(holder.clone()))
                };
            }
        }
        occupations
    }

    const fn job(&self) -> Option<&Job> {
        match self {
            Self::HeldByJob { job, .. } => Some(job),
            _ => None,
        }
    }
}

impl Claim {
    /// Claims the folder for this process; `scratch` is where it makes the run, if that is not this folder.
    ///
    /// # Errors
    /// [`RunError::FolderLocked`] if another process writes there; otherwise what the operating system says.
    pub(super) fn acquire(folder: &Folder, scratch: Option<&Path>) -> Result<Self> {
        let mut latest = None;
        for _ in 0..ATTEMPTS_MAX {
            match Self::make(folder, scratch) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                made => {
                    let made = made.with_context(|| folder.cannot("claim", Path::new(LOCK)))?;
                    if let Some(claim) = made {
                        return Ok(claim);
                    }
                }
            }
            let Some(there) = There::find(folder)? else {
                // It was left meanwhile.
                continue;
            };
            match Occupation::settled(vec![there.occupation()]).pop() {
                Some(Occupation::Free) => there.remove(folder)?,
                Some(Occupation::Held(holder)) => return Err(locked(folder, holder)),
                _ => {}
            }
            latest = there.holder;
        }
        Err(locked(folder, latest))
    }

    /// Makes the file; nothing, if another process took it for a left one at the same moment.
    fn make(folder: &Folder, scratch: Option<&Path>) -> io::Result<Option<Self>> {
        let mut options = OpenOptions::new();
        options.create_new(true).read(true).write(true);
        let mut file = folder.open_with(Path::new(LOCK), &options)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(error)) if !is_unsupported(&error) => return Err(error),
            // Without locks there is still the name of the job.
            _ => {}
        }
        let within = folder.dir().try_clone()?;
        let claim = serde_json::to_string(&Holder::own(scratch)).map_err(io::Error::from)?;
        file.write_all(format!("{claim}\n").as_bytes())?;
        file.sync_all()?;
        let claim = Self { file, within };
        Ok(claim.is_held().then_some(claim))
    }

    /// Whether the claim in the folder is this one: its content may have been removed, and another run begun.
    pub(super) fn is_held(&self) -> bool {
        is_claim_in(&self.within, &self.file)
    }

    /// As [`Self::is_held`], and whether the folder still lies at `path`.
    pub(super) fn is_held_at(&self, path: &Path) -> bool {
        #[cfg(unix)]
        {
            let there = std::fs::symlink_metadata(path.join(LOCK)).map(|file| identity(&file));
            let held = self.file.metadata().map(|file| identity(&file));
            if there.ok() != held.ok() {
                return false;
            }
        }
        #[cfg(not(unix))]
        let _ = path;
        self.is_held()
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        if self.is_held() {
            // What is left is taken over by the next process.
            let _ = self.within.remove_file(LOCK);
        }
    }
}

impl There {
    /// The claim in the folder, if there is one, as it stands now, for one who only looks.
    fn look(folder: &Folder) -> Result<Option<Self>> {
        match folder.file(LOCK)? {
            Some(file) => Self::of(folder, file, File::try_lock_shared).map(Some),
            None => Ok(None),
        }
    }

    /// As [`Self::look`], for one who may take it over: nobody else of this host can then. A claim that does not say yet who holds it gets
    /// the time to do so.
    fn find(folder: &Folder) -> Result<Option<Self>> {
        let mut options = OpenOptions::new();
        options.read(true).write(true);
        for patience in [true, false] {
            let file = match folder.open_with(Path::new(LOCK), &options) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
                file => file.with_context(|| folder.cannot("open", Path::new(LOCK)))?,
            };
            let there = Self::of(folder, file, File::try_lock)?;
            if !patience || (there.holder.is_some() && there.lock != Lock::Held) {
                return Ok(Some(there));
            }
            drop(there);
            thread::sleep(PATIENCE);
        }
        Ok(None)
    }

    fn of(
        folder: &Folder,
        file: File,
        lock: fn(&File) -> Result<(), TryLockError>,
    ) -> Result<Self> {
        let cannot = |verb| folder.cannot(verb, Path::new(LOCK));
        let lock = match lock(&file) {
            Ok(()) => Lock::Free,
            Err(TryLockError::WouldBlock) => Lock::Held,
            Err(TryLockError::Error(error)) if is_unsupported(&error) => Lock::Unsupported,
            Err(TryLockError::Error(error)) => return Err(error).with_context(|| cannot("lock")),
        };
        let content = file.try_clone().with_context(|| cannot("read"))?;
        let content = read_bounded(content, &folder.shown(LOCK), LENGTH_MAX).unwrap_or_default();
        Ok(Self {
            file,
            holder: serde_json::from_slice(&content).ok(),
            lock,
        })
    }

    /// What it means, by the table above.
    fn occupation(&self) -> Occupation {
        let is_elsewhere = (self.holder.as_ref()).is_some_and(|holder| holder.host != host());
        match (self.holder.clone(), self.lock) {
            (Some(holder), lock) if is_elsewhere || lock == Lock::Unsupported => {
                match holder.job.clone() {
                    Some(job) => Occupation::HeldByJob {
                        holder,
                        job,
                        is_free: lock != Lock::Held,
                    },
                    None if lock == Lock::Free => Occupation::Free,
                    None => Occupation::Held(Some(holder)),
                }
            }
            (_, Lock::Free) => Occupation::Free,
            (holder, _) => Occupation::Held(holder),
        }
    }

    /// Removes it, unless another one has taken its place.
    fn remove(&self, folder: &Folder) -> Result<()> {
        if !is_claim_in(folder.dir(), &self.file) {
            return Ok(());
        }
        match folder.dir().remove_file(LOCK) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            removed => removed.with_context(|| folder.cannot("take over", Path::new(LOCK))),
        }
    }
}

/// Whether the claim in a folder is this file.
fn is_claim_in(folder: &Dir, file: &File) -> bool {
    let there = folder.symlink_metadata(LOCK).ok();
    let held = file.metadata().ok();
    #[cfg(unix)]
    {
        use cap_std::fs::MetadataExt as _;
        let there = there.map(|there| (there.dev(), there.ino()));
        held.is_some_and(|held| there == Some(identity(&held)))
    }
    // Elsewhere a file that is open keeps its name and its folder.
    #[cfg(not(unix))]
    {
        held.is_some() && there.is_some()
    }
}

#[cfg(unix)]
fn identity(file: &std::fs::Metadata) -> (u64, u64) {
    use std::os::unix::fs::MetadataExt as _;
    (file.dev(), file.ino())
}

fn locked(folder: &Folder, holder: Option<Holder>) -> RunError {
    let folder = folder.path().to_owned();
    let holder = holder.map(Box::new);
    RunError::FolderLocked { folder, holder }
}

/// Whether a file system does without locks.
fn is_unsupported(error: &io::Error) -> bool {
    // ENOLCK of Linux: the server of the file system has none to give.
    error.kind() == io::ErrorKind::Unsupported
        || (cfg!(target_os = "linux") && error.raw_os_error() == Some(37))
}

/// The name of this machine; nothing where the system keeps it elsewhere, and all machines count as one.
fn host() -> String {
    let named = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let named = named.or_else(|| std::env::var("COMPUTERNAME").ok());
    named.unwrap_or_default().trim().to_owned()
}

#[cfg(test)]
mod tests;
