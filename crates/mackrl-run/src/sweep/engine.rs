//! Making runs side by side, each in a process of its own.
//!
//! A run's process is started on its folder, which is made with its configuration first; for the program that is `mackrl resume`, for
//! an own one whatever calls [`resume`](crate::training_loop::resume). The process holds, as its stdin, the read end of
//! a pipe whose write end this one holds and never uses: when this process ends, however that comes, the pipe breaks, and every
//! run writes a checkpoint and stops. So a sweep that is killed leaves no processes behind, without signals having to be
//! passed on.

use std::{
    collections::VecDeque,
    io::Read,
    num::NonZeroUsize,
    path::Path,
    process::{Child, ChildStderr, Command, Stdio},
    thread::{self, JoinHandle},
    time::Duration,
};

use super::{Entry, State};
use crate::{
    error::{Context, Result, RunError},
    stop_request::StopRequest,
};

/// Between two looks at the processes.
const PAUSE: Duration = Duration::from_millis(50);
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

/// What is left to do.
struct Work<'a> {
    entries: &'a [Entry],
    /// Runs to be taken up.
    queue: VecDeque<usize>,
    /// Runs that another process makes.
    elsewhere: Vec<usize>,
    attempts: Vec<usize>,
    outcome: Outcome,
}

/// A process that makes a run.
struct Worker {
    index: usize,
    child: Child,
    words: JoinHandle<String>,
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

/// Makes all runs that are not finished, `jobs` at a time.
///
/// `process` gives the command that goes on with the run in a folder: it has to stop, after a checkpoint and with exit code 75, when its
/// stdin ends, to end with exit code 0 when the run is finished, with 75 also if another process makes the run, and to say in a
/// last line of stderr that begins with `error: ` why it is not finished. A run that fails does not stop the others. Runs that
/// another process makes, such as another sweep with the same plan, are left to it, and taken up if it does not finish them.
///
/// # Errors
/// [`RunError::SweepInterrupted`] when asked to stop; [`RunError::OtherConfiguration`] if a folder holds another run, before any is
/// made.
pub fn make_all(
    entries: &[Entry],
    jobs: NonZeroUsize,
    process: &dyn Fn(&Path) -> Command,
    stop: &StopRequest,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let mut work = Work {
        entries,
        queue: VecDeque::new(),
        elsewhere: Vec::new(),
        attempts: vec![0; entries.len()],
        outcome: Outcome::default(),
    };
    for (index, entry) in entries.iter().enumerate() {
        match entry.state()? {
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
        while workers.len() < jobs.get()
            && let Some(index) = work.queue.pop_front()
        {
            match Worker::start(entries, index, process) {
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

    /// Asks how the runs stand that another process makes; those that it has left unfinished are taken up.
    fn look_elsewhere(&mut self, observer: &mut dyn Observer) {
        for index in std::mem::take(&mut self.elsewhere) {
            match self.entries[index].state() {
                Ok(State::Finished) => self.end(index, End::Finished, observer),
                Ok(State::Running) => self.elsewhere.push(index),
                _ => self.queue.push_back(index),
            }
        }
    }
}

/// Lets every process write its checkpoint, and tells how far the sweep has come.
fn interrupt(entries: &[Entry], workers: Vec<Worker>) -> Result<Outcome> {
    let ends: Vec<_> = workers.into_iter().map(Worker::let_go).collect();
    for mut end in ends {
        end.wait()
            .with_context(|| "cannot wait for a run to stop")?;
    }
    let states = entries.iter().map(Entry::state);
    let states = states.collect::<Result<Vec<_>>>()?;
    let finished = states.iter().filter(|state| **state == State::Finished);
    Err(RunError::SweepInterrupted {
        finished: finished.count(),
        runs: entries.len(),
    })
}

impl Worker {
    /// Starts a process, unless another one makes the run already.
    fn start(
        entries: &[Entry],
        index: usize,
        process: &dyn Fn(&Path) -> Command,
    ) -> Result<Option<Self>> {
        let entry = &entries[index];
        if !entry.prepare()? || entry.state()? == State::Running {
            return Ok(None);
        }
        let mut child = process(&entry.folder)
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
        }))
    }

    /// Whether the process is gone. One that cannot be asked counts as gone; asking how it ended tells why.
    fn has_ended(&self) -> bool {
        self.words.is_finished()
    }

    /// How the process ended.
    fn end(mut self) -> End {
        let status = match self.child.wait() {
            Ok(status) => status,
            Err(error) => {
                return End::Failed {
                    words: format!("cannot wait for its process: {error}"),
                    by_system: true,
                };
            }
        };
        if status.success() {
            return End::Finished;
        }
        let words = self.words.join().unwrap_or_default();
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

    /// Breaks the pipe that the process listens to.
    fn let_go(mut self) -> Child {
        drop(self.child.stdin.take());
        self.child
    }
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
