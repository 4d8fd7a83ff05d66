//! Making runs side by side, each in a process of its own.
//!
//! A run's process is started on its folder, which is made with its configuration first; for the program that is `mackrl resume`, for
//! an own one whatever calls [`resume`](crate::training_loop::resume). The process holds, as its stdin, the read end of
//! a pipe whose write end this one holds and never uses: when this process ends, however that comes, the pipe breaks, and every
//! run writes a checkpoint and stops. So a sweep that is killed leaves no processes behind, without signals having to be
//! passed on.
//!
//! With a disk of this machine for scratch the process makes the run there, and this one lets the run folder follow it (`run_folder/mirror.rs`).

use std::{
    collections::VecDeque,
    io::Read,
    num::NonZeroUsize,
    path::{Path, PathBuf},
    process::{Child, ChildStderr, Command, ExitStatus, Stdio},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use super::{Entry, State, standings};
use crate::{
    error::{Context, Result, RunError},
    provenance::sha256,
    run_folder::Mirror,
    stop_request::StopRequest,
};

/// Between two looks at the processes.
const PAUSE: Duration = Duration::from_millis(50);
/// Between two looks at what a run has left on the disk of this machine.
const MIRROR_PAUSE: Duration = Duration::from_secs(1);
/// Between two looks at runs that other processes make, which may lie on a disk that many share: the first, and the longest later.
const PAUSES_ELSEWHERE: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(30)];
/// How much of what a failing process says is kept, in bytes.
const LAST_WORDS: usize = 4_000;
/// Exit code of a process that did not come to the end of its run, and says that another may.
const INTERRUPTED: i32 = 75;
/// Exit code of a process that the operating system kept from going on.
const SYSTEM: i32 = 74;
/// How often a run is taken up again that was stopped from outside.
const ATTEMPTS_MAX: usize = 3;

/// How a sweep ended.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Runs that reached their end, now or earlier, here or in another process.
    pub finished: usize,
    /// Runs that failed: their names, and what they said.
    pub failed: Vec<(String, String)>,
    /// How many of these failed because the operating system could not do something, such as write to a full disk.
    pub failed_by_system: usize,
    /// Runs that were stopped from outside again and again: their names, and how. They can go on.
    pub stopped: Vec<(String, String)>,
}

/// How a process that made a run ended.
enum End {
    Finished,
    /// It was stopped from outside, or another process makes the run.
    Stopped(String),
    Failed {
        words: String,
        by_system: bool,
    },
}

/// How runs are made.
#[derive(Clone, Copy)]
pub struct Making<'a> {
    /// Runs at a time.
    pub jobs: NonZeroUsize,
    /// The command that goes on with the run in a folder.
    pub process: &'a dyn Fn(&Path) -> Command,
    /// A folder on a disk of this machine, in which the runs are made; their own folders get each checkpoint.
    pub scratch: Option<&'a Path>,
}

impl std::fmt::Debug for Making<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Making")
            .field("jobs", &self.jobs)
            .field("scratch", &self.scratch)
            .finish_non_exhaustive()
    }
}

/// What is left to do.
struct Work<'a> {
    entries: &'a [Entry],
    /// Runs to be taken up.
    queue: VecDeque<usize>,
    /// Runs that another process makes.
    elsewhere: Vec<usize>,
    /// When these are looked at next, and how long after that again.
    look: (Instant, Duration),
    attempts: Vec<usize>,
    outcome: Outcome,
}

/// A process that makes a run.
struct Worker {
    index: usize,
    child: Child,
    words: JoinHandle<String>,
    /// Where it makes it, if that is not the run's own folder, and when that is looked at next.
    mirror: Option<(Mirror, Instant)>,
}

/// What is told while a sweep goes on. The unit type listens to nothing.
pub trait Observer {
    /// These runs are to be made.
    fn begin(&mut self, _entries: &[Entry]) {}

    /// The runs with the numbers `running` are being made, and so many have failed; told some twenty times a second.
    fn progress(&mut self, _entries: &[Entry], _running: &[usize], _failed: usize) {}

    /// The run with this number has reached its end.
    fn note_finished(&mut self, _entries: &[Entry], _run: usize) {}

    /// No run is being made any more.
    fn end(&mut self, _entries: &[Entry]) {}
}

impl Observer for () {}

/// Makes all runs that are not finished.
///
/// The command that goes on with the run in a folder has to stop, after a checkpoint and with exit code 75, when its
/// stdin ends, to end with exit code 0 when the run is finished, with 75 also if another process makes the run, and to say in a
/// last line of stderr that begins with `error: ` why it is not finished. A run that fails does not stop the others. Runs that
/// another process makes, such as another sweep with the same plan, are left to it, and taken up if it does not finish them.
///
/// # Errors
/// [`RunError::SweepInterrupted`] when asked to stop; [`RunError::OtherConfiguration`] if a folder holds another run, before any is
/// made.
pub fn make_all(
    entries: &[Entry],
    making: &Making<'_>,
    stop: &StopRequest,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let mut work = Work {
        entries,
        queue: VecDeque::new(),
        elsewhere: Vec::new(),
        look: (Instant::now(), PAUSES_ELSEWHERE[0]),
        attempts: vec![0; entries.len()],
        outcome: Outcome::default(),
    };
    for (index, standing) in standings(entries).into_iter().enumerate() {
        match standing?.state {
            State::Finished => work.outcome.finished += 1,
            _ => work.queue.push_back(index),
        }
    }
    observer.begin(entries);
    let mut workers: Vec<Worker> = Vec::new();
    while !work.queue.is_empty() || !workers.is_empty() || !work.elsewhere.is_empty() {
        if stop.is_made() {
            observer.end(entries);
            return interrupt(entries, workers);
        }
        while workers.len() < making.jobs.get()
            && let Some(index) = work.queue.pop_front()
        {
            match Worker::start(&entries[index], index, making) {
                Ok(Some(worker)) => workers.push(worker),
                Ok(None) => work.elsewhere.push(index),
                Err(error) => work.end(
                    index,
                    End::Failed {
                        words: error.chain(),
                        by_system: matches!(error.root(), RunError::System { .. }),
                    },
                    observer,
                ),
            }
        }
        let (ended, going) = workers.into_iter().partition(Worker::has_ended);
        workers = going;
        for worker in ended {
            let index = worker.index;
            work.end(index, worker.end(), observer);
        }
        work.look_elsewhere(observer);
        workers.iter_mut().for_each(Worker::follow);
        let running: Vec<usize> = workers.iter().map(|worker| worker.index).collect();
        observer.progress(entries, &running, work.outcome.failed.len());
        if !workers.is_empty() || !work.elsewhere.is_empty() {
            thread::sleep(PAUSE);
        }
    }
    observer.end(entries);
    Ok(work.outcome)
}

impl Work<'_> {
    /// Notes how a process ended.
    fn end(&mut self, index: usize, end: End, observer: &mut dyn Observer) {
        match end {
            End::Finished => {
                self.outcome.finished += 1;
                observer.note_finished(self.entries, index);
            }
            End::Stopped(how) => match self.entries[index].state() {
                Ok(State::Finished) => self.end(index, End::Finished, observer),
                Ok(State::Running) => self.elsewhere.push(index),
                _ => {
                    self.attempts[index] += 1;
                    if self.attempts[index] < ATTEMPTS_MAX {
                        self.queue.push_back(index);
                    } else {
                        let name = self.entries[index].name.clone();
                        self.outcome.stopped.push((name, how));
                    }
                }
            },
            End::Failed { words, by_system } => {
                self.outcome.failed_by_system += usize::from(by_system);
                let name = self.entries[index].name.clone();
                self.outcome.failed.push((name, words));
            }
        }
    }

    /// Asks how the runs stand that another process makes; those that it has left unfinished are taken up. As long as nothing changes, it
    /// asks less and less often.
    fn look_elsewhere(&mut self, observer: &mut dyn Observer) {
        let (due, pause) = self.look;
        if self.elsewhere.is_empty() || Instant::now() < due {
            return;
        }
        let asked = std::mem::take(&mut self.elsewhere);
        let there = standings(asked.iter().map(|&index| &self.entries[index]));
        for (&index, standing) in asked.iter().zip(there) {
            match standing.map(|standing| standing.state) {
                Ok(State::Finished) => self.end(index, End::Finished, observer),
                Ok(State::Running) => self.elsewhere.push(index),
                _ => self.queue.push_back(index),
            }
        }
        let [first, longest] = PAUSES_ELSEWHERE;
        let pause = if self.elsewhere == asked {
            (2 * pause).min(longest)
        } else {
            first
        };
        self.look = (Instant::now() + pause, pause);
    }
}

/// Lets every process write its checkpoint, and tells how far the sweep has come.
fn interrupt(entries: &[Entry], mut workers: Vec<Worker>) -> Result<Outcome> {
    workers.iter_mut().for_each(Worker::let_go);
    for worker in workers {
        let (_, kept) = worker.complete();
        kept.with_context(|| "a run was stopped")?;
    }
    let states = standings(entries).into_iter();
    let states = states.collect::<Result<Vec<_>>>()?;
    let finished = (states.iter()).filter(|standing| standing.state == State::Finished);
    Err(RunError::SweepInterrupted {
        finished: finished.count(),
        runs: entries.len(),
    })
}

impl Worker {
    /// Starts a process, unless another one makes the run already.
    fn start(entry: &Entry, index: usize, making: &Making<'_>) -> Result<Option<Self>> {
        if !entry.prepare()? || entry.state()? == State::Running {
            return Ok(None);
        }
        let mirror = match making.scratch {
            None => None,
            Some(scratch) => match Mirror::begin(&entry.folder, &scratch.join(apart(entry))) {
                Err(RunError::FolderLocked { .. }) => return Ok(None),
                mirror => Some((mirror?, Instant::now() + MIRROR_PAUSE)),
            },
        };
        let folder =
            (mirror.as_ref()).map_or(entry.folder.as_path(), |(mirror, _)| mirror.scratch());
        let mut child = (making.process)(folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start a process for {}", entry.name))?;
        let stderr = child.stderr.take();
        Ok(Some(Self {
            index,
            child,
            words: thread::spawn(move || stderr.map_or_else(String::new, last_words)),
            mirror,
        }))
    }

    /// Whether the process is gone. One that cannot be asked counts as gone; asking how it ended tells why.
    fn has_ended(&self) -> bool {
        self.words.is_finished()
    }

    /// Lets the run's own folder have what is new.
    fn follow(&mut self) {
        let Some((mirror, due)) = &mut self.mirror else {
            return;
        };
        if Instant::now() < *due {
            return;
        }
        let followed = mirror.follow();
        *due = Instant::now() + MIRROR_PAUSE;
        // Anything else may be over in a while, and is told at the end if it is not.
        if let Err(RunError::FolderReplaced { .. }) = followed {
            self.let_go();
        }
    }

    /// Breaks the pipe that the process listens to.
    fn let_go(&mut self) {
        drop(self.child.stdin.take());
    }

    /// Waits for the process: how it ended and what it said last, and whether the run's own folder has all that it left.
    fn complete(mut self) -> ((std::io::Result<ExitStatus>, String), Result<()>) {
        let status = self.child.wait();
        let words = self.words.join().unwrap_or_default();
        let kept = match self.mirror {
            Some((mirror, _)) => mirror.finish(),
            None => Ok(()),
        };
        ((status, words), kept)
    }

    /// How the process ended.
    fn end(self) -> End {
        let ((status, words), kept) = self.complete();
        let status = match status {
            Ok(status) => status,
            Err(error) => {
                return End::Failed {
                    words: format!("cannot wait for its process: {error}"),
                    by_system: true,
                };
            }
        };
        if let Err(error) = kept {
            return End::Failed {
                words: error.chain(),
                by_system: matches!(
                    error.root(),
                    RunError::System { .. } | RunError::FolderReplaced { .. }
                ),
            };
        }
        if status.success() {
            return End::Finished;
        }
        let told = words.lines().rfind(|line| line.starts_with("error: "));
        let words = match told {
            Some(line) => line.trim_start_matches("error: ").to_owned(),
            None => format!("its process ended with {status}"),
        };
        match status.code() {
            // No code: a signal ended it.
            Some(INTERRUPTED) | None => End::Stopped(words),
            code => End::Failed {
                words,
                by_system: code == Some(SYSTEM),
            },
        }
    }
}

/// The name of a run's folder on a disk that all runs of this machine share.
fn apart(entry: &Entry) -> PathBuf {
    let path = std::path::absolute(&entry.folder).unwrap_or_else(|_| entry.folder.clone());
    let hash = sha256(path.as_os_str().as_encoded_bytes());
    format!("{}-{}", entry.name, &hash[..8]).into()
}

/// Reads to the end, which comes when the process ends, and keeps what was said last.
fn last_words(mut stderr: ChildStderr) -> String {
    let mut kept = Vec::new();
    let mut buffer = [0; 1024];
    // What cannot be read is not known, and the exit code tells the rest.
    while let Ok(length @ 1..) = stderr.read(&mut buffer) {
        kept.extend_from_slice(&buffer[..length]);
        let superfluous = kept.len().saturating_sub(LAST_WORDS);
        kept.drain(..superfluous);
    }
    String::from_utf8_lossy(&kept).into_owned()
}
