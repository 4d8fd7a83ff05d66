//! What a person sees while a sweep goes on: a line for each run that is being made, and one for all.

use std::{
    io::{self, IsTerminal, Write},
    time::{Duration, Instant},
};

use super::{Entry, State};
use crate::{progress::clock, run_folder::LatestRow};

/// Between two pictures on a terminal, where each replaces the one before.
const TERMINAL_INTERVAL: Duration = Duration::from_millis(500);
/// Between two pictures in a log.
const PLAIN_INTERVAL: Duration = Duration::from_secs(30);

/// The lines on stderr.
#[derive(Debug)]
pub(super) struct Display<'a> {
    entries: &'a [Entry],
    terminal: bool,
    start: Instant,
    shown: Option<Instant>,
    /// Environment steps of each run, by what was last seen of it.
    steps: Vec<u64>,
    /// Environment steps of all runs when the clock started.
    steps_at_start: u64,
    /// Runs that failed.
    failed: usize,
    /// Lines of the latest picture, which the next one replaces.
    lines: usize,
}

impl<'a> Display<'a> {
    /// Starts the clock.
    pub(super) fn new(entries: &'a [Entry]) -> Self {
        let steps: Vec<u64> = entries.iter().map(steps).collect();
        Self {
            entries,
            terminal: io::stderr().is_terminal(),
            start: Instant::now(),
            shown: None,
            steps_at_start: steps.iter().sum(),
            steps,
            failed: 0,
            lines: 0,
        }
    }

    /// Shows how the runs stand, if the last time was long enough ago; `running` are those that are being made.
    pub(super) fn show(&mut self, running: &[usize], failed: usize) {
        let interval = if self.terminal {
            TERMINAL_INTERVAL
        } else {
            PLAIN_INTERVAL
        };
        let last = self.shown.unwrap_or(self.start);
        if last.elapsed() < interval {
            return;
        }
        self.shown = Some(Instant::now());
        self.failed = failed;
        self.draw(running);
    }

    /// Hears that a run has reached its end.
    pub(super) fn note_finished(&mut self, run: usize) {
        self.steps[run] = self.entries[run].config.run.steps_env;
    }

    /// Leaves the latest picture as it is, and writes below it from now on.
    pub(super) fn finish(mut self) {
        if self.shown.is_some() {
            self.draw(&[]);
        }
    }

    fn draw(&mut self, running: &[usize]) {
        let mut text = String::new();
        if self.terminal && self.lines > 0 {
            // Up to the first line of the latest picture, and clear from there.
            text += &format!("\x1b[{}A\x1b[J", self.lines);
        }
        let latest: Vec<LatestRow> = (running.iter())
            .map(|&run| self.entries[run].latest())
            .collect();
        for (&run, latest) in running.iter().zip(&latest) {
            text += &line(&self.entries[run], latest);
            text.push('\n');
        }
        for (&run, latest) in running.iter().zip(&latest) {
            self.steps[run] = latest.steps_env;
        }
        text += &self.total(running.len());
        text.push('\n');
        self.lines = running.len() + 1;
        // A sweep must not end because nobody reads its progress.
        let mut stderr = io::stderr().lock();
        let _ = stderr
            .write_all(text.as_bytes())
            .and_then(|()| stderr.flush());
    }

    fn total(&self, running: usize) -> String {
        let length = |entry: &Entry| entry.config.run.steps_env;
        let finished = (self.entries.iter().zip(&self.steps))
            .filter(|(entry, steps)| **steps >= length(entry))
            .count();
        let total: u64 = self.entries.iter().map(length).sum();
        let done: u64 = (self.entries.iter().zip(&self.steps))
            .map(|(entry, steps)| length(entry).min(*steps))
            .sum();
        let rate = done.saturating_sub(self.steps_at_start.min(done)) as f64
            / self.start.elapsed().as_secs_f64().max(1e-3);
        summary(&Totals {
            finished,
            runs: self.entries.len(),
            running,
            failed: self.failed,
            rate,
            left: total - done,
        })
    }
}

/// The line for all runs, in numbers.
struct Totals {
    finished: usize,
    runs: usize,
    running: usize,
    failed: usize,
    /// Environment steps a second.
    rate: f64,
    /// Environment steps that are left.
    left: u64,
}

fn summary(totals: &Totals) -> String {
    let mut text = format!(
        "{} of {} runs finished, {} running",
        totals.finished, totals.runs, totals.running
    );
    if totals.failed > 0 {
        text += &format!(", {} failed", totals.failed);
    }
    if totals.rate > 0.0 {
        text += &format!(", {:.0} steps/s", totals.rate);
        if totals.left > 0 {
            text += &format!(", {} left", clock(totals.left as f64 / totals.rate));
        }
    }
    text
}

fn line(entry: &Entry, latest: &LatestRow) -> String {
    let total = entry.config.run.steps_env;
    let share = 100.0 * latest.steps_env.min(total) as f64 / total as f64;
    let mut text = format!("  {}  {share:.0} % of {total} steps", entry.name);
    if let Some(rate) = latest.steps_per_s {
        text += &format!(", {rate:.0}/s");
    }
    if let Some(won) = latest.battle_won_mean {
        text += &format!(", won {:.0} %", 100.0 * won);
    }
    text
}

/// Environment steps that a run has behind it.
fn steps(entry: &Entry) -> u64 {
    match entry.state() {
        Ok(State::Finished) => entry.config.run.steps_env,
        Ok(State::Waiting) | Err(_) => 0,
        Ok(_) => entry.latest().steps_env,
    }
}

#[cfg(test)]
mod tests {
    use mackrl_run::config::Config;

    use super::*;

    #[test]
    fn a_line_tells_how_a_run_stands() {
        let entry = Entry {
            name: "3m-mackrl-seed1".to_owned(),
            folder: "x".into(),
            config: Config::default(),
        };
        let latest = LatestRow {
            steps_env: 250_000,
            steps_per_s: Some(20_000.4),
            battle_won_mean: Some(0.875),
        };
        assert_eq!(
            line(&entry, &latest),
            "  3m-mackrl-seed1  25 % of 1000000 steps, 20000/s, won 88 %"
        );
    }

    #[test]
    fn the_last_line_tells_how_all_stand() {
        let totals = Totals {
            finished: 3,
            runs: 40,
            running: 2,
            failed: 1,
            rate: 50_000.0,
            left: 6_000_000,
        };
        assert_eq!(
            summary(&totals),
            "3 of 40 runs finished, 2 running, 1 failed, 50000 steps/s, 2:00 left"
        );
    }
}
