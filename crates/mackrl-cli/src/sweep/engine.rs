//! Making runs side by side, each in a process of its own.
//!
//! A run's process is `mackrl resume` on its folder, which is made with its configuration first. The process holds the read end of
//! a pipe whose write end this one holds and never uses: when this process ends, however that comes, the pipe breaks, and every
//! run writes a checkpoint and stops. So a sweep that is killed leaves no processes behind, without signals having to be
//! passed on.

use std::{
    collections::VecDeque,
    io::Read,
    num::NonZeroUsize,
    process::{Child, ChildStderr, Command, Stdio},
    thread::{self, JoinHandle},
    time::Duration,
};

use anyhow::Context;

use super::{Entry, State, display::Display};
use crate::{failure::Failure, signals::StopRequest};

/// Between two looks at the processes.
const PAUSE: Duration = Duration::from_millis(50);
/// How much of what a failing process says is kept, in bytes.
const LAST_WORDS: usize = 4_000;
/// Exit code of a run that was asked to stop.
const INTERRUPTED: i32 = 75;

/// How a sweep ended.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Outcome {
    /// Runs that reached their end, now or earlier.
    pub(crate) finished: usize,
    /// Runs that failed: their names, and what they said.
    pub(crate) failed: Vec<(String, String)>,
}

/// A process that makes a run.
struct Worker {
    index: usize,
    child: Child,
    words: JoinHandle<String>,
}

/// Makes all runs that are not finished, `jobs` at a time, and shows how they stand on stderr.
///
/// A run that fails does not stop the others.
///
/// # Errors
/// [`Failure::SweepInterrupted`] when asked to stop; [`Failure::OtherConfiguration`] if a folder holds another run, before any is
/// made; otherwise what kept processes from being started.
pub(crate) fn make_all(
    entries: &[Entry],
    jobs: NonZeroUsize,
    stop: &StopRequest,
) -> anyhow::Result<Outcome> {
    let mut queue = VecDeque::new();
    let mut outcome = Outcome::default();
    for (index, entry) in entries.iter().enumerate() {
        match entry.state()? {
            State::Finished => outcome.finished += 1,
            _ => queue.push_back(index),
        }
    }
    let mut display = Display::new(entries);
    let mut workers: Vec<Worker> = Vec::new();
    while !queue.is_empty() || !workers.is_empty() {
        if stop.is_made() {
            return interrupt(entries, workers, display);
        }
        while workers.len() < jobs.get()
            && let Some(index) = queue.pop_front()
        {
            workers.push(Worker::start(entries, index)?);
        }
        let (ended, going) = workers.into_iter().partition(Worker::has_ended);
        workers = going;
        for worker in ended {
            let index = worker.index;
            match worker.end()? {
                Ok(()) => {
                    outcome.finished += 1;
                    display.note_finished(index);
                }
                Err(words) => outcome.failed.push((entries[index].name.clone(), words)),
            }
        }
        let running: Vec<usize> = workers.iter().map(|worker| worker.index).collect();
        display.show(&running, outcome.failed.len());
        if !workers.is_empty() {
            thread::sleep(PAUSE);
        }
    }
    display.finish();
    Ok(outcome)
}

/// Lets every process write its checkpoint, and tells how far the sweep has come.
fn interrupt(
    entries: &[Entry],
    workers: Vec<Worker>,
    display: Display<'_>,
) -> anyhow::Result<Outcome> {
    display.finish();
    let ends: Vec<_> = workers.into_iter().map(Worker::let_go).collect();
    for mut end in ends {
        end.wait().context("cannot wait for a run to stop")?;
    }
    let states = entries.iter().map(Entry::state);
    let states = states.collect::<anyhow::Result<Vec<_>>>()?;
    let finished = states.iter().filter(|state| **state == State::Finished);
    Err(Failure::SweepInterrupted {
        finished: finished.count(),
        runs: entries.len(),
    }
    .into())
}

impl Worker {
    fn start(entries: &[Entry], index: usize) -> anyhow::Result<Self> {
        let entry = &entries[index];
        entry.prepare()?;
        let program = std::env::current_exe().context("cannot find this program's file")?;
        let mut child = Command::new(program)
            .args(["resume", "--threads", "1", "--leashed"])
            .arg(&entry.folder)
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
    fn end(mut self) -> anyhow::Result<Result<(), String>> {
        let status = self.child.wait().context("cannot wait for a run")?;
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
