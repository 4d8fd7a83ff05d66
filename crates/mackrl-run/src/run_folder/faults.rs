//! A disk on which chosen operations fail, and the proof that no failure costs a checkpoint.

use std::{
    cell::Cell,
    fs::File,
    io::{self, Write},
    path::Path,
    rc::Rc,
};

use crate::training::Trainer;

use super::*;

/// How often an operation fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Duration {
    Once,
    ForEver,
}

/// Fails from the operation with number `first` on, counted from 0.
#[derive(Debug, Clone)]
struct FaultyDisk {
    first: usize,
    duration: Duration,
    kind: io::ErrorKind,
    operations: Rc<Cell<usize>>,
}

impl FaultyDisk {
    /// On which nothing fails.
    fn sound() -> Self {
        Self {
            first: usize::MAX,
            duration: Duration::Once,
            kind: io::ErrorKind::Other,
            operations: Rc::default(),
        }
    }

    fn check(&self) -> io::Result<()> {
        let number = self.operations.replace(self.operations.get() + 1);
        let fails = match self.duration {
            Duration::Once => number == self.first,
            Duration::ForEver => number >= self.first,
        };
        if fails { Err(self.kind.into()) } else { Ok(()) }
    }
}

impl Disk for FaultyDisk {
    fn create_folder(&self, within: &Folder, path: &Path) -> io::Result<()> {
        self.check()?;
        RealDisk.create_folder(within, path)
    }

    fn create(&self, within: &Folder, path: &Path) -> io::Result<File> {
        self.check()?;
        RealDisk.create(within, path)
    }

    /// A write that fails has written half.
    fn write(&self, file: &mut File, content: &[u8]) -> io::Result<()> {
        let checked = self.check();
        if checked.is_err() {
            file.write_all(&content[..content.len() / 2])?;
        }
        checked?;
        RealDisk.write(file, content)
    }

    /// Takes no time: no power is lost here.
    fn sync(&self, _: &File) -> io::Result<()> {
        self.check()
    }

    fn rename(&self, within: &Folder, from: &Path, to: &Path) -> io::Result<()> {
        self.check()?;
        RealDisk.rename(within, from, to)
    }

    fn link(&self, within: &Folder, from: &Path, to: &Path) -> io::Result<()> {
        self.check()?;
        RealDisk.link(within, from, to)
    }

    fn remove_folder(&self, within: &Folder, path: &Path) -> io::Result<()> {
        self.check()?;
        RealDisk.remove_folder(within, path)
    }
}

fn config() -> Config {
    let settings = [
        "algorithm.name=central-v",
        "algorithm.hidden=3",
        "algorithm.environments=2",
        "test.episodes=1",
        "run.checkpoints_kept=1",
    ];
    Config::with(&settings).expect("settings that there are")
}

/// Three checkpoints of one run.
fn checkpoints_of_a_run() -> [Checkpoint; 3] {
    let mut trainer = Trainer::new(&config(), 1).unwrap();
    [(); 3].map(|()| {
        trainer.update().unwrap();
        trainer.checkpoint()
    })
}

/// A run with two checkpoints on a sound disk, of which one was kept, whose third checkpoint meets `disk`.
fn third_checkpoint_on(
    disk: &FaultyDisk,
    path: &Path,
    checkpoints: &[Checkpoint; 3],
) -> Result<()> {
    let mut folder = RunFolder::create(path, &config(), 1).unwrap();
    folder.disk = Box::new(FaultyDisk::sound());
    for (number, checkpoint) in (1..).zip(&checkpoints[..2]) {
        folder.append_metrics("{\"t_env\":1}").unwrap();
        folder.write_checkpoint(number, checkpoint).unwrap();
    }
    folder.disk = Box::new(disk.clone());
    folder.append_metrics("{\"t_env\":2}")?;
    folder.write_weights(WhichWeights::Best, b"best")?;
    folder.write_weights(WhichWeights::Step(2), b"kept")?;
    folder.write_checkpoint(3, &checkpoints[2])?;
    folder.write_weights(WhichWeights::Last, b"weights")?;
    folder.set_status(Status::Finished)
}

#[test]
fn no_failing_operation_costs_a_checkpoint() {
    let checkpoints = checkpoints_of_a_run();
    let mut cases = 0;
    for kind in [io::ErrorKind::StorageFull, io::ErrorKind::Other] {
        for duration in [Duration::Once, Duration::ForEver] {
            for first in 0.. {
                let parent = tempfile::tempdir().unwrap();
                let path = parent.path().join("run");
                let disk = FaultyDisk {
                    first,
                    duration,
                    kind,
                    operations: Rc::default(),
                };
                let Err(error) = third_checkpoint_on(&disk, &path, &checkpoints) else {
                    assert_eq!(disk.operations.get(), first, "all operations were tried");
                    assert!(first > 20, "operations of a checkpoint: {first}");
                    break;
                };
                cases += 1;
                assert_is_told(&error, &path);
                if duration == Duration::Once {
                    assert_room_is_given_back(&path);
                }
                assert_continues(&path, &checkpoints);
            }
        }
    }
    println!("{cases} failing operations");
    assert!(cases > 80, "{cases} cases");
}

/// The message names the path, and leads to exit code 74 by its cause.
fn assert_is_told(error: &RunError, path: &Path) {
    let message = error.chain();
    assert!(message.contains(&*path.to_string_lossy()), "{message}");
    assert!(matches!(error, RunError::System { .. }), "{message}");
    assert!(
        !message.contains("write") || message.contains(" bytes)"),
        "{message}"
    );
}

/// What could not be completed takes no room on a full disk, unless removing a checkpoint was what failed.
fn assert_room_is_given_back(path: &Path) {
    let entries = fs::read_dir(path.join(CHECKPOINTS)).unwrap();
    let names: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
    let unfinished = names.iter().find(|name| *name == "000000000003.tmp");
    assert_eq!(unfinished, None, "{names:?}");
}

/// The run stands at its second or at its third checkpoint, whole, and goes on to its end.
fn assert_continues(path: &Path, checkpoints: &[Checkpoint; 3]) {
    let Resumption {
        mut folder,
        checkpoint,
        damaged,
        ..
    } = RunFolder::resume(path, 1).unwrap();
    assert_eq!(damaged, [""; 0]);
    folder.disk = Box::new(FaultyDisk::sound());
    let metrics = || fs::read_to_string(path.join(METRICS)).unwrap();
    let before = "{\"t_env\":1}\n{\"t_env\":1}\n";
    let after = format!("{before}{{\"t_env\":2}}\n");
    if checkpoint.as_ref() == Some(&checkpoints[1]) {
        assert_eq!(metrics(), before);
        folder.append_metrics("{\"t_env\":2}").unwrap();
    } else {
        assert!(checkpoint.as_ref() == Some(&checkpoints[2]), "a mixture");
    }
    folder.write_checkpoint(3, &checkpoints[2]).unwrap();
    assert_eq!(metrics(), after);
    folder
        .write_weights(WhichWeights::Last, b"weights")
        .unwrap();
    folder.set_status(Status::Finished).unwrap();
    drop(folder);
    let left: Vec<_> = fs::read_dir(path.join("checkpoints"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(left, ["000000000003"], "one checkpoint is kept");
}
