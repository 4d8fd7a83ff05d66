//! What a person sees while a run goes on: one line that is renewed on a terminal, and a plain line now and then elsewhere.

use std::{
    io::{self, IsTerminal, Write},
    time::{Duration, Instant},
};

use mackrl::nn::InstructionSet;

const TERMINAL_INTERVAL: Duration = Duration::from_millis(500);
const PLAIN_INTERVAL: Duration = Duration::from_secs(30);

/// How a run stands.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Standing {
    /// Environment steps played.
    pub(crate) steps_env: u64,
    /// Environment steps to play, > 0.
    pub(crate) steps_env_total: u64,
    /// Share of battles won in the latest greedy test, in [0, 1], if there was one.
    pub(crate) battle_won_mean: Option<f64>,
    /// Share of the chosen pairs that delegated, in [0, 1], if there are pairs.
    pub(crate) delegation_rate: Option<f64>,
}

/// The line on stderr.
#[derive(Debug)]
pub(crate) struct Progress {
    style: Style,
    start: Instant,
    /// Environment steps played when the clock started.
    steps_env_at_start: u64,
    shown: Option<Instant>,
    latest: Option<Standing>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Style {
    Terminal,
    Plain,
}

impl Progress {
    /// Starts the clock of a run that has played `steps_env` environment steps; the style is what stderr can show.
    pub(crate) fn new(steps_env: u64) -> Self {
        let style = if io::stderr().is_terminal() {
            Style::Terminal
        } else {
            Style::Plain
        };
        Self {
            style,
            steps_env_at_start: steps_env,
            start: Instant::now(),
            shown: None,
            latest: None,
        }
    }

    /// Shows how the run stands, if the last time was long enough ago.
    pub(crate) fn show(&mut self, standing: &Standing) {
        self.latest = Some(*standing);
        let now = Instant::now();
        if is_due(self.style, self.shown.unwrap_or(self.start), now) {
            self.shown = Some(now);
            self.write(standing);
        }
    }

    /// Shows how the run ended.
    pub(crate) fn finish(&mut self) {
        if let Some(standing) = self.latest.take() {
            self.write(&standing);
            if self.style == Style::Terminal {
                write_stderr("\n");
            }
        }
    }

    fn write(&self, standing: &Standing) {
        let line = line(standing, self.steps_env_at_start, self.start.elapsed());
        match self.style {
            // Back to the start of the line, and clear what is left of the previous one.
            Style::Terminal => write_stderr(&format!("\r{line}\x1b[K")),
            Style::Plain => write_stderr(&format!("{line}\n")),
        }
    }
}

/// Tells what a run computes with, before it begins.
pub(crate) fn announce(instructions: InstructionSet, threads: usize) {
    let s = if threads == 1 { "" } else { "s" };
    write_stderr(&format!(
        "computing with {instructions} on {threads} thread{s}\n"
    ));
}

fn is_due(style: Style, shown: Instant, now: Instant) -> bool {
    let interval = match style {
        Style::Terminal => TERMINAL_INTERVAL,
        Style::Plain => PLAIN_INTERVAL,
    };
    now.duration_since(shown) >= interval
}

/// A run must not end because nobody reads its progress.
fn write_stderr(text: &str) {
    let mut stderr = io::stderr().lock();
    let _ = stderr
        .write_all(text.as_bytes())
        .and_then(|()| stderr.flush());
}

/// Steps, rate, time left, win rate and delegation rate, in fewer than 80 columns.
fn line(standing: &Standing, steps_env_at_start: u64, elapsed: Duration) -> String {
    let Standing {
        steps_env,
        steps_env_total,
        ..
    } = *standing;
    let rate = (steps_env - steps_env_at_start) as f64 / elapsed.as_secs_f64().max(1e-3);
    let mut line = format!("{steps_env}/{steps_env_total} steps, {rate:.0}/s");
    if rate > 0.0 && steps_env < steps_env_total {
        let left_s = (steps_env_total - steps_env) as f64 / rate;
        line.push_str(&format!(", {} left", clock(left_s)));
    }
    for (name, share) in [
        ("won", standing.battle_won_mean),
        ("delegated", standing.delegation_rate),
    ] {
        if let Some(share) = share {
            line.push_str(&format!(", {name} {:.0} %", 100.0 * share));
        }
    }
    line
}

/// Hours, minutes and seconds.
pub(crate) fn clock(seconds: f64) -> String {
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
    fn a_line_tells_steps_rate_time_left_and_rates() {
        let standing = Standing {
            steps_env: 250_000,
            steps_env_total: 1_000_000,
            battle_won_mean: Some(0.875),
            delegation_rate: Some(0.34),
        };
        assert_eq!(
            line(&standing, 0, Duration::from_secs(10)),
            "250000/1000000 steps, 25000/s, 0:30 left, won 88 %, delegated 34 %"
        );
    }

    #[test]
    fn a_resumed_run_is_timed_from_where_it_went_on() {
        let standing = Standing {
            steps_env: 900_000,
            steps_env_total: 1_000_000,
            ..Standing::default()
        };
        assert_eq!(
            line(&standing, 800_000, Duration::from_secs(10)),
            "900000/1000000 steps, 10000/s, 0:10 left"
        );
    }

    #[test]
    fn the_last_line_has_no_time_left() {
        let standing = Standing {
            steps_env: 1010,
            steps_env_total: 1000,
            ..Standing::default()
        };
        assert_eq!(
            line(&standing, 0, Duration::from_secs(10)),
            "1010/1000 steps, 101/s"
        );
    }

    #[test]
    fn terminals_are_renewed_twice_a_second_and_files_twice_a_minute() {
        let shown = Instant::now();
        let after = |seconds: f64| shown + Duration::from_secs_f64(seconds);
        assert!(!is_due(Style::Terminal, shown, after(0.4)));
        assert!(is_due(Style::Terminal, shown, after(0.5)));
        assert!(!is_due(Style::Plain, shown, after(29.0)));
        assert!(is_due(Style::Plain, shown, after(30.0)));
    }

    #[test]
    fn long_times_have_hours() {
        assert_eq!(clock(3725.9), "1:02:05");
    }
}
