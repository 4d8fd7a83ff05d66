//! One run that is being trained.

use mackrl::nn::InstructionSet;
use mackrl_run::{
    config::{Origin, Resolved},
    training_loop::{Observer, Standing},
};

use super::{Lines, rate_and_rest};
use crate::failure::printable;

/// The line of a run.
#[derive(Debug)]
pub(crate) struct RunProgress {
    lines: Lines,
    /// Environment steps played when the clock started.
    steps_env_at_start: u64,
    latest: Option<Standing>,
}

impl RunProgress {
    /// Starts the clock.
    pub(crate) fn new() -> Self {
        Self {
            lines: Lines::new(),
            steps_env_at_start: 0,
            latest: None,
        }
    }

    /// Tells what learns and why, what it is computed with, and which settings follow from the world, before a run begins.
    pub(crate) fn announce(
        &self,
        resolved: &Resolved,
        instructions: InstructionSet,
        threads: usize,
    ) {
        let config = resolved.config();
        let s = if threads == 1 { "" } else { "s" };
        let (algorithm, world) = (config.algorithm.name(), printable(config.env.map()));
        let why = match resolved.origin("algorithm.name") {
            Origin::Preset { name, .. } => format!("preset {name}"),
            other => printable(&other.to_string()),
        };
        let text = format!(
            "{algorithm} ({why}) on {world}, computing with {instructions} on {threads} thread{s}"
        );
        self.lines.note(&text);
        for key in config.keys() {
            if let (Origin::Automatic { why }, Some(value)) =
                (resolved.origin(&key), config.get(&key))
            {
                self.lines.note(&format!("{key} = {value}, as {why}"));
            }
        }
    }

    fn show(&mut self, standing: &Standing) {
        let text = line(standing, self.steps_env_at_start, self.lines.elapsed_s());
        let done = standing.steps_env as f64 / standing.steps_env_total.max(1) as f64;
        self.lines.show(&[(text, done)]);
    }
}

impl Observer for RunProgress {
    fn begin(&mut self, standing: &Standing) {
        self.steps_env_at_start = standing.steps_env;
        self.lines = Lines::new();
    }

    fn progress(&mut self, standing: &Standing) {
        self.latest = Some(*standing);
        if self.lines.is_due() {
            self.show(standing);
        }
    }

    fn warn(&mut self, message: &str) {
        self.lines.note(&format!("warning: {}", printable(message)));
    }

    fn end(&mut self) {
        if let Some(standing) = self.latest.take() {
            self.show(&standing);
        }
        self.lines.finish();
    }
}

/// Steps, rate, time left, win rate and delegation rate, in fewer than 80 columns.
fn line(standing: &Standing, steps_env_at_start: u64, elapsed_s: f64) -> String {
    let Standing {
        steps_env,
        steps_env_total,
        ..
    } = *standing;
    let rate = (steps_env - steps_env_at_start) as f64 / elapsed_s.max(1e-3);
    let left = steps_env_total.saturating_sub(steps_env);
    let mut line = format!("{steps_env}/{steps_env_total} steps");
    line.push_str(&rate_and_rest(rate, "", left));
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
            line(&standing, 0, 10.0),
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
            line(&standing, 800_000, 10.0),
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
        assert_eq!(line(&standing, 0, 10.0), "1010/1000 steps, 101/s");
    }
}
