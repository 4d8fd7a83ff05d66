//! How far a long computation has come.

use std::sync::{Mutex, PoisonError};

use super::{Lines, clock};

/// Says how much is done, how fast it goes and how long the rest will take; short computations show nothing.
#[derive(Debug)]
pub(crate) struct Meter {
    unit: &'static str,
    lines: Mutex<Lines>,
}

impl Meter {
    /// Starts the clock; `unit` is what is counted, in the plural.
    #[must_use]
    pub(crate) fn new(unit: &'static str) -> Self {
        Self {
            unit,
            lines: Mutex::new(Lines::new()),
        }
    }

    /// Notes that `done` of `total` are finished, from any thread.
    pub(crate) fn report(&self, done: usize, total: usize) {
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        let is_last = done == total && lines.shown.is_some();
        if is_last || lines.is_due() {
            let line = describe(done, total, self.unit, lines.elapsed_s());
            lines.show(&[(line, done as f64 / total.max(1) as f64)]);
        }
        if is_last {
            lines.finish();
        }
    }
}

fn describe(done: usize, total: usize, unit: &str, elapsed_s: f64) -> String {
    let rate = done as f64 / elapsed_s.max(1e-3);
    let left = clock((total - done) as f64 / rate);
    format!("{done} of {total} {unit}, {rate:.0} a second, {left} left")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_share_rate_and_time_left() {
        let line = describe(300, 900, "runs", 3.0);
        assert_eq!(line, "300 of 900 runs, 100 a second, 0:06 left");
    }
}
