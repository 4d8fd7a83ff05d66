//! Many runs side by side: a line for each run that is being made, and one for all.

use mackrl_run::{
    run_folder::LatestRow,
    sweep::{Entry, Observer, State},
};

use super::{Line, Lines, rate_and_rest};

/// The lines of a sweep.
#[derive(Debug)]
pub(crate) struct SweepProgress {
    lines: Lines,
    /// Environment steps of each run, by what was last seen of it.
    steps: Vec<u64>,
    /// Environment steps of all runs when the clock started.
    steps_at_start: u64,
    /// Runs that failed.
    failed: usize,
}

impl SweepProgress {
    /// Starts the clock.
    pub(crate) fn new() -> Self {
        Self {
            lines: Lines::new(),
            steps: Vec::new(),
            steps_at_start: 0,
            failed: 0,
        }
    }

    fn show(&mut self, entries: &[Entry], running: &[usize]) {
        let mut lines = Vec::with_capacity(running.len() + 1);
        for &run in running {
            let latest = entries[run].latest();
            self.steps[run] = latest.steps_env;
            lines.push(line(&entries[run], &latest));
        }
        lines.push(self.total(entries, running.len()));
        self.lines.show(&lines);
    }

    fn total(&self, entries: &[Entry], running: usize) -> Line {
        let length = |entry: &Entry| entry.config.run.steps_env;
        let finished = (entries.iter().zip(&self.steps))
            .filter(|(entry, steps)| **steps >= length(entry))
            .count();
        let total: u64 = entries.iter().map(length).sum();
        let done: u64 = (entries.iter().zip(&self.steps))
            .map(|(entry, steps)| length(entry).min(*steps))
            .sum();
        let new = done.saturating_sub(self.steps_at_start) as f64;
        let text = summary(&Totals {
            finished,
            runs: entries.len(),
            running,
            failed: self.failed,
            rate: new / self.lines.elapsed_s().max(1e-3),
            left: total - done,
        });
        (text, done as f64 / total.max(1) as f64)
    }
}

impl Observer for SweepProgress {
    fn begin(&mut self, entries: &[Entry]) {
        self.steps = entries.iter().map(steps).collect();
        self.steps_at_start = self.steps.iter().sum();
    }

    fn progress(&mut self, entries: &[Entry], running: &[usize], failed: usize) {
        self.failed = failed;
        if self.lines.is_due() {
            self.show(entries, running);
        }
    }

    fn note_finished(&mut self, entries: &[Entry], run: usize) {
        self.steps[run] = entries[run].config.run.steps_env;
    }

    fn end(&mut self, entries: &[Entry]) {
        if self.lines.shown.is_some() {
            self.show(entries, &[]);
        }
        self.lines.finish();
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
    text + &rate_and_rest(totals.rate, " steps", totals.left)
}

fn line(entry: &Entry, latest: &LatestRow) -> Line {
    let total = entry.config.run.steps_env;
    let done = latest.steps_env.min(total) as f64 / total as f64;
    let mut text = format!("  {}  {:.0} % of {total} steps", entry.name, 100.0 * done);
    if let Some(rate) = latest.steps_per_s {
        text += &format!(", {rate:.0}/s");
    }
    if let Some(won) = latest.battle_won_mean {
        text += &format!(", won {:.0} %", 100.0 * won);
    }
    (text, done)
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
        let expected = "  3m-mackrl-seed1  25 % of 1000000 steps, 20000/s, won 88 %";
        assert_eq!(line(&entry, &latest), (expected.to_owned(), 0.25));
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
