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
/// Exit code of a run that was asked to stop.
const INTERRUPTED: i32 = 75;

/// How a sweep ended.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Runs that reached their end, now or earlier.
    pub finished: usize,
    /// Runs that failed: their names, and what they said.
    pub failed: Vec<(String, String)>,
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
/// stdin ends, to end with exit code 0 when the run is finished, and to say in a last line of stderr that begins with `error: `
/// why it is not. A run that fails does not stop the others.
///
/// # Errors
/// [`RunError::SweepInterrupted`] when asked to stop; [`RunError::OtherConfiguration`] if a folder holds another run, before any is
/// made; otherwise what kept processes from being started.
pub fn make_all(
    entries: &[Entry],
    jobs: NonZeroUsize,
    process: &dyn Fn(&Path) -> Command,
    stop: &StopRequest,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let mut queue = VecDeque::new();
    let mut outcome = Outcome::default();
    for (index, entry) in entries.iter().enumerate() {
        match entry.state()? {
            State::Finished => outcome.finished += 1,
            _ => queue.push_back(index),
        }
    }
    observer.begin(entries);
    let mut workers: Vec<Worker> = Vec::new();
    while !queue.is_empty() || !workers.is_empty() {
        if stop.is_made() {
            observer.end(entries);
            return interrupt(entries, workers);
        }
        while workers.len() < jobs.get()
            && let Some(index) = queue.pop_front()
        {
            workers.push(Worker::start(entries, index, process)?);
        }
        let (ended, going) = workers.into_iter().partition(Worker::has_ended);
        workers = going;
        for worker in ended {
            let index = worker.index;
            match worker.end()? {
                Ok(()) => {
                    outcome.finished += 1;
                    observer.note_finished(entries, index);
                }
                Err(words) => outcome.failed.push((entries[index].name.clone(), words)),
            }
        }
        let running: Vec<usize> = workers.iter().map(|worker| worker.index).collect();
        observer.progress(entries, &running, outcome.failed.len());
        if !workers.is_empty() {
            thread::sleep(PAUSE);
        }
    }
    observer.end(entries);
    Ok(outcome)
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
    fn start(entries: &[Entry], index: usize, process: &dyn Fn(&Path) -> Command) -> Result<Self> {
        let entry = &entries[index];
        entry.prepare()?;
        let mut child = process(&entry.folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start a process for {}", entry.name))?;
        let stderr = child.stderr.take();
        Ok(Self {
            index,
            child,
            words: thread::spawn(move || stderr.map_or_else(String::new, last_words)),
        })
    }

    /// Whether the process is gone. One that cannot be asked counts as gone; asking how it ended tells why.
    fn has_ended(&self) -> bool {
        self.words.is_finished()
    }

    /// How the process ended: well, or with these words.
    fn end(mut self) -> Result<Result<(), String>> {
        let status = self.child.wait().with_context(|| "cannot wait for a run")?;
        if status.success() {
            return Ok(Ok(()));
        }
        let words = self.words.join().unwrap_or_default();
        let told = words.lines().rfind(|line| line.starts_with("error: "));
        let reason = match (status.code(), told) {
            (Some(INTERRUPTED), _) => "it was stopped by a signal of its own".to_owned(),
            (_, Some(line)) => line.trim_start_matches("error: ").to_owned(),
            (_, None) => format!("its process ended with {status}"),
        };
        Ok(Err(reason))
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
