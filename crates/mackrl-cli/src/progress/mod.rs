//! What a person sees while something long goes on: lines that are renewed on a terminal, and plain lines now and then elsewhere.

mod meter;
mod run;
mod sweep;

use std::{
    io::{self, IsTerminal, Write},
    time::{Duration, Instant},
};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use crate::failure::printable;

pub(crate) use meter::Meter;
pub(crate) use run::RunProgress;
pub(crate) use sweep::SweepProgress;

const TERMINAL_INTERVAL: Duration = Duration::from_millis(500);
const PLAIN_INTERVAL: Duration = Duration::from_secs(30);
/// Parts of a bar.
const PARTS: u64 = 1000;

/// A line, and how much of what it tells about is done, in [0, 1].
type Line = (String, f64);

/// Lines on stderr: in place, with bars, on a terminal; one below the other elsewhere.
#[derive(Debug)]
struct Lines {
    terminal: Option<MultiProgress>,
    bars: Vec<ProgressBar>,
    start: Instant,
    shown: Option<Instant>,
}

impl Lines {
    /// Starts the clock; the style is what stderr can show.
    fn new() -> Self {
        Self {
            terminal: io::stderr().is_terminal().then(MultiProgress::new),
            bars: Vec::new(),
            start: Instant::now(),
            shown: None,
        }
    }

    /// Seconds since the clock was started.
    fn elapsed_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Whether the last time that something was shown was long enough ago.
    fn is_due(&self) -> bool {
        let interval = match self.terminal {
            Some(_) => TERMINAL_INTERVAL,
            None => PLAIN_INTERVAL,
        };
        self.shown.unwrap_or(self.start).elapsed() >= interval
    }

    /// Shows these lines, on a terminal in place of earlier ones.
    fn show(&mut self, lines: &[Line]) {
        self.shown = Some(Instant::now());
        let Some(terminal) = &self.terminal else {
            return lines.iter().for_each(|(text, _)| write(text));
        };
        while self.bars.len() < lines.len() {
            self.bars.push(terminal.add(bar()));
        }
        for superfluous in self.bars.drain(lines.len()..) {
            superfluous.finish_and_clear();
            terminal.remove(&superfluous);
        }
        for (bar, (text, done)) in self.bars.iter().zip(lines) {
            bar.set_message(text.clone());
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a part of a bar"
            )]
            bar.set_position((done.clamp(0.0, 1.0) * PARTS as f64) as u64);
        }
    }

    /// Writes a line above those that are renewed.
    fn note(&self, text: &str) {
        match &self.terminal {
            Some(terminal) => terminal.suspend(|| write(text)),
            None => write(text),
        }
    }

    /// Leaves the latest lines as they are.
    fn finish(&mut self) {
        self.bars.drain(..).for_each(|bar| bar.abandon());
    }
}

fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar}");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(PARTS).with_style(style)
}

/// Writes a line to stderr. A run must not end because stderr cannot be written.
fn write(text: &str) {
    let _ = writeln!(io::stderr(), "{}", printable(text));
}

/// Rate, and the time that the rest takes: ", 25000/s, 0:30 left"; nothing without a rate.
fn rate_and_rest(rate: f64, unit: &str, left: u64) -> String {
    match (rate > 0.0, left > 0) {
        (false, _) => String::new(),
        (true, false) => format!(", {rate:.0}{unit}/s"),
        (true, true) => format!(", {rate:.0}{unit}/s, {} left", clock(left as f64 / rate)),
    }
}

/// Hours, minutes and seconds.
fn clock(seconds: f64) -> String {
    let whole = Duration::from_secs_f64(seconds.clamp(0.0, 1e9)).as_secs();
    let (hours, minutes, seconds) = (whole / 3600, whole / 60 % 60, whole % 60);
    if hours > 0 {
        format!("{hours}:{minutes:02}:{seconds:02}")
    } else {
        format!("{minutes}:{seconds:02}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_times_have_hours() {
        assert_eq!(clock(3725.9), "1:02:05");
        assert_eq!(clock(65.0), "1:05");
    }

    #[test]
    fn nothing_is_said_of_the_rest_when_nothing_is_left() {
        assert_eq!(rate_and_rest(0.0, "", 5), "");
        assert_eq!(rate_and_rest(101.0, "", 0), ", 101/s");
        assert_eq!(
            rate_and_rest(20.0, " steps", 300),
            ", 20 steps/s, 0:15 left"
        );
    }
}
