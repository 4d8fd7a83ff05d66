//! A run that is made on a disk of this machine, while its own folder, on a disk that many share, follows it.
//!
//! The shared folder is claimed for as long as that takes. It gets every checkpoint whole, by renaming, after the metrics that belong to it; so
//! at every moment it is a run that can go on anywhere. What a killed process left on this machine's disk is used if it is further than the
//! shared folder.

use std::{
    fs::{self, File},
    io,
    path::Path,
};

use cap_std::fs::OpenOptions;

use super::{
    CHECKPOINTS, CONFIG, KEPT, LOCK, RUN, WEIGHTS, checkpoints,
    claim::{Claim, Occupation},
    disk::{self, Disk, RealDisk},
};
use crate::{
    error::{Context, Result, RunError},
    folder::{Folder, Kind},
};

/// A run that is made on a disk of this machine.
#[derive(Debug)]
pub struct Mirror {
    home: Folder,
    scratch: Folder,
    claim: Claim,
    /// The checkpoints that the shared folder has.
    followed: Vec<u64>,
}

impl Mirror {
    /// Claims the run folder `home`, and makes `scratch` a run that is as far as it.
    ///
    /// # Errors
    /// [`RunError::FolderLocked`] if another process writes in one of them; otherwise what cannot be read or written.
    pub fn begin(home: &Path, scratch: &Path) -> Result<Self> {
        let home = Folder::open(home)?;
        let claim = Claim::acquire(&home, Some(scratch))?;
        fs::create_dir_all(scratch)
            .with_context(|| format!("cannot create {}", scratch.display()))?;
        if let Occupation::Held(holder) = Occupation::of(scratch) {
            let folder = scratch.to_owned();
            let holder = holder.map(Box::new);
            return Err(RunError::FolderLocked { folder, holder });
        }
        let mut scratch = Folder::open(scratch)?;
        if !is_further(&scratch, &home)? {
            let path = scratch.path().to_owned();
            let renewed = fs::remove_dir_all(&path).and_then(|()| fs::create_dir_all(&path));
            renewed.with_context(|| format!("cannot empty {}", path.display()))?;
            scratch = Folder::open(&path)?;
            copy_checkpoints(&home, &scratch)?;
            copy_files(&home, &scratch, |_| true)?;
        }
        Ok(Self {
            followed: checkpoints::numbers(&home)?,
            home,
            scratch,
            claim,
        })
    }

    /// Where the run is made.
    pub fn scratch(&self) -> &Path {
        self.scratch.path()
    }

    /// Gives the shared folder the checkpoints that it does not have yet; if there are none, it is not touched.
    ///
    /// # Errors
    /// What cannot be read or written; [`RunError::FolderReplaced`] if the shared folder is not what it was.
    pub fn follow(&mut self) -> Result<()> {
        if checkpoints::numbers(&self.scratch)? == self.followed {
            return Ok(());
        }
        self.expect_own()?;
        // The metrics first: a checkpoint counts them.
        copy_files(&self.scratch, &self.home, |name| {
            ![CONFIG, RUN, WEIGHTS].contains(&name)
        })?;
        copy_checkpoints(&self.scratch, &self.home)?;
        self.followed = checkpoints::numbers(&self.home)?;
        Ok(())
    }

    /// Gives the shared folder all that the run left, when no process makes it any more, and removes it here.
    ///
    /// # Errors
    /// As [`Self::follow`].
    pub fn finish(self) -> Result<()> {
        self.expect_own()?;
        copy_files(&self.scratch, &self.home, |name| {
            ![CONFIG, RUN].contains(&name)
        })?;
        copy_checkpoints(&self.scratch, &self.home)?;
        // What it says of the run holds only now.
        copy_files(&self.scratch, &self.home, |name| name == RUN)?;
        let path = self.scratch.path();
        fs::remove_dir_all(path).with_context(|| format!("cannot remove {}", path.display()))
    }

    fn expect_own(&self) -> Result<()> {
        if self.claim.is_held_at(self.home.path()) {
            return Ok(());
        }
        let folder = self.home.path().to_owned();
        Err(RunError::FolderReplaced { folder })
    }
}

/// Whether one folder holds the run of another, and a later checkpoint of it.
fn is_further(one: &Folder, other: &Folder) -> Result<bool> {
    let latest =
        |folder: &Folder| checkpoints::numbers(folder).map(|numbers| numbers.last().copied());
    let config = |folder: &Folder| folder.read(CONFIG, super::untrusted::TEXT_MAX);
    Ok(latest(one)? > latest(other)? && config(one)? == config(other)?)
}

/// Copies the files of a run with these names, and the weights that it keeps, each as a whole.
fn copy_files(from: &Folder, to: &Folder, is_wanted: impl Fn(&str) -> bool) -> Result<()> {
    let kept = Path::new(KEPT);
    if from.kind(kept)?.is_some() {
        disk::ensure_folder(&RealDisk, to, kept)?;
        copy_files_in(kept, from, to, |_| true)?;
    }
    copy_files_in(Path::new(""), from, to, is_wanted)
}

fn copy_files_in(
    inside: &Path,
    from: &Folder,
    to: &Folder,
    is_wanted: impl Fn(&str) -> bool,
) -> Result<()> {
    for (name, kind) in from.entries(inside)? {
        let ending = Path::new(&name).extension();
        let is_own = name != LOCK && ending.is_none_or(|ending| ending != disk::TEMPORARY);
        if is_own && kind == Kind::File && is_wanted(&name) {
            let name = inside.join(name);
            let temporary = disk::temporary(&name);
            if let Some(file) = from.file(&name)? {
                copy(file, to, &temporary)?;
                disk::rename(&RealDisk, to, &temporary, &name)?;
            }
        }
    }
    disk::sync_folder(&RealDisk, to, inside)
}

/// Gives one folder the checkpoints of the other, and no others.
fn copy_checkpoints(from: &Folder, to: &Folder) -> Result<()> {
    let parent = Path::new(CHECKPOINTS);
    let (wanted, there) = (checkpoints::numbers(from)?, checkpoints::numbers(to)?);
    if to.kind(parent)?.is_none() && !wanted.is_empty() {
        (RealDisk.create_folder(to, parent)).with_context(|| to.cannot("create", parent))?;
    }
    for number in wanted.iter().filter(|number| !there.contains(number)) {
        let place = checkpoints::place(*number);
        // Files that are open can be read to their end, even if the run removes this checkpoint meanwhile.
        let Some(files) = open_all(from, &place)? else {
            continue;
        };
        let temporary = disk::temporary(&place);
        if to.kind(&temporary)?.is_some() {
            (RealDisk.remove_folder(to, &temporary))
                .with_context(|| to.cannot("remove", &temporary))?;
        }
        (RealDisk.create_folder(to, &temporary))
            .with_context(|| to.cannot("create", &temporary))?;
        for (name, file) in files {
            copy(file, to, &temporary.join(name))?;
        }
        disk::rename(&RealDisk, to, &temporary, &place)?;
    }
    for number in there.iter().filter(|number| !wanted.contains(number)) {
        checkpoints::remove(&RealDisk, to, *number)?;
    }
    if wanted == there {
        return Ok(());
    }
    disk::sync_folder(&RealDisk, to, parent)
}

/// The files of a checkpoint; nothing, if it is there no more.
fn open_all(from: &Folder, place: &Path) -> Result<Option<Vec<(String, File)>>> {
    let mut files = Vec::new();
    for (name, _) in from.entries(place)? {
        match from.file(place.join(&name))? {
            Some(file) => files.push((name, file)),
            None => return Ok(None),
        }
    }
    Ok((!files.is_empty()).then_some(files))
}

/// Copies a file and waits until its content is safe.
fn copy(mut source: File, to: &Folder, place: &Path) -> Result<()> {
    let mut copy = || {
        let mut options = OpenOptions::new();
        let options = options.write(true).create(true).truncate(true);
        let mut target = to.open_with(place, options)?;
        io::copy(&mut source, &mut target)?;
        target.sync_all()
    };
    copy().with_context(|| to.cannot("write", place))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        config::Config,
        run_folder::{METRICS, Run, RunFolder, Status, WhichWeights, read_description},
        training::Trainer,
    };

    fn config() -> Config {
        let settings = [
            "algorithm.name=central-v",
            "algorithm.hidden=3",
            "algorithm.environments=2",
            "test.episodes=1",
        ];
        Config::with(&settings).unwrap()
    }

    /// Goes on with the run in a folder for so many updates, and says how far it is then.
    fn go_on(path: &Path, updates: u64) -> u64 {
        let resumption = RunFolder::resume(path, 1).unwrap();
        let (mut folder, config) = (resumption.folder, resumption.config);
        let mut trainer = Trainer::new(&config, 1).unwrap();
        if let Some(checkpoint) = &resumption.checkpoint {
            trainer.restore(checkpoint).unwrap();
        }
        for _ in 0..updates {
            trainer.update().unwrap();
            folder.append_metrics("{\"t_env\":1}").unwrap();
            let (number, checkpoint) = (trainer.iterations(), trainer.checkpoint());
            folder.write_checkpoint(number, &checkpoint).unwrap();
        }
        folder.set_status(Status::Interrupted).unwrap();
        trainer.iterations()
    }

    fn numbers(path: &Path) -> Vec<u64> {
        checkpoints::numbers(&Folder::open(path).unwrap()).unwrap()
    }

    #[test]
    fn the_shared_folder_follows_the_run_and_can_go_on_at_every_moment() {
        let parent = tempfile::tempdir().unwrap();
        let [home, scratch] = ["home", "disk/run"].map(|name| parent.path().join(name));
        RunFolder::prepare(&home, &config(), 1).unwrap();
        let mut mirror = Mirror::begin(&home, &scratch).unwrap();
        let held = RunFolder::resume(&home, 1).unwrap_err();
        assert!(matches!(held, RunError::FolderLocked { .. }), "{held}");
        go_on(&scratch, 2);
        mirror.follow().unwrap();
        assert_eq!(numbers(&home), numbers(&scratch));
        let file = |folder: &Path, name| fs::read(folder.join(name)).unwrap();
        assert_eq!(file(&home, METRICS), file(&scratch, METRICS));
        // As if this process had been killed: the disk of the machine is further than the shared folder.
        go_on(&scratch, 3);
        drop(mirror);
        let mirror = Mirror::begin(&home, &scratch).unwrap();
        assert_ne!(numbers(&home), numbers(&scratch));
        let expected = Run::open(&scratch, WhichWeights::Last).unwrap().weights;
        mirror.finish().unwrap();
        assert!(!scratch.exists());
        assert_eq!(
            Run::open(&home, WhichWeights::Last).unwrap().weights,
            expected
        );
        assert_eq!(go_on(&home, 1), 6, "nothing is lost");
    }

    #[test]
    fn what_another_run_left_on_the_disk_is_not_used() {
        let parent = tempfile::tempdir().unwrap();
        let [home, scratch] = ["home", "scratch"].map(|name| parent.path().join(name));
        RunFolder::prepare(&home, &config(), 1).unwrap();
        let mut other = config();
        other.run.seed = 9;
        RunFolder::prepare(&scratch, &other, 1).unwrap();
        go_on(&scratch, 2);
        let mut mirror = Mirror::begin(&home, &scratch).unwrap();
        assert_eq!(read_description(&scratch).unwrap().0, config());
        fs::remove_file(home.join(LOCK)).unwrap();
        go_on(&scratch, 1);
        let error = mirror.follow().unwrap_err();
        assert!(matches!(error, RunError::FolderReplaced { .. }), "{error}");
        assert_eq!(numbers(&home), [0; 0]);
    }
}
