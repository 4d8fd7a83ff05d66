//! How far a long computation has come, on standard error.

use std::{
    io::{IsTerminal as _, Write as _, stderr},
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

/// Short computations show nothing.
const PATIENCE: Duration = Duration::from_secs(2);
/// Between two lines on a terminal, where each replaces the one before.
const TERMINAL_PAUSE: Duration = Duration::from_millis(200);
/// Between two lines in a log.
const LOG_PAUSE: Duration = Duration::from_secs(10);

/// Says how much is done, how fast it goes and how long the rest will take.
#[derive(Debug)]
pub(crate) struct Meter {
    unit: &'static str,
    start: Instant,
    last: Mutex<Option<Instant>>,
    terminal: bool,
}

impl Meter {
    /// Starts the clock; `unit` is what is counted, in the plural.
    #[must_use]
    pub(crate) fn new(unit: &'static str) -> Self {
        Self {
            unit,
            start: Instant::now(),
            last: Mutex::new(None),
            terminal: stderr().is_terminal(),
        }
    }

    /// Hears that `done` of `total` are finished, from any thread.
    pub(crate) fn report(&self, done: usize, total: usize) {
        let elapsed = self.start.elapsed();
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let pause = if self.terminal {
            TERMINAL_PAUSE
        } else {
            LOG_PAUSE
        };
        let finished = done == total;
        let due = last.map_or(elapsed > PATIENCE, |last| {
            finished || last.elapsed() > pause
        });
        if !due {
            return;
        }
        *last = Some(Instant::now());
        let line = describe(done, total, self.unit, elapsed);
        let (before, after) = match (self.terminal, finished) {
            (true, false) => ("\r\x1b[K", ""),
            (true, true) => ("\r\x1b[K", "\n"),
            (false, _) => ("", "\n"),
        };
        // Nothing is lost if nobody can read it.
        let _ = write!(stderr(), "{before}{line}{after}");
    }
}

fn describe(done: usize, total: usize, unit: &str, elapsed: Duration) -> String {
    let rate = done as f64 / elapsed.as_secs_f64();
    let left = (total - done) as f64 / rate;
    format!("{done} of {total} {unit}, {rate:.0} a second, {left:.0} s left")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_share_rate_and_time_left() {
        let line = describe(300, 900, "runs", Duration::from_secs(3));
        assert_eq!(line, "300 of 900 runs, 100 a second, 6 s left");
    }
}
