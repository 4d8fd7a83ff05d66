//! How long a run takes and how much memory, measured by a little of it.

use std::{fs, time::Duration, time::Instant};

use mackrl_run::{config::Config, stop_request::StopRequest, training::Trainer};

use crate::commands::sc2;

/// What a run needs, on one core of this machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Needs {
    /// Seconds from beginning to end.
    pub(super) run_s: f64,
    /// The most memory that this process had so far, in bytes, where the system tells.
    pub(super) memory: Option<u64>,
}

/// Trains for a while, for one update at least, and foretells the whole run; nothing, if asked to stop.
///
/// # Errors
/// If the run cannot begin, or fails that early.
pub(super) fn measure(
    config: &Config,
    budget: Duration,
    stop: &StopRequest,
) -> anyhow::Result<Option<Needs>> {
    let begun = Instant::now();
    let mut trainer = Trainer::in_world(config, &sc2::world(config)?, 1)?;
    let setup_s = begun.elapsed().as_secs_f64();
    let (mut learning_s, mut test_s) = (0.0, 0.0_f64);
    while !trainer.finished() && (begun.elapsed() < budget || trainer.steps_env() == 0) {
        if stop.is_made() {
            return Ok(None);
        }
        let (before, began) = (trainer.steps_env(), Instant::now());
        trainer.update()?;
        let took_s = began.elapsed().as_secs_f64();
        if trainer.steps_env() > before {
            learning_s += took_s;
        } else {
            test_s = test_s.max(took_s);
        }
    }
    let (steps, played) = (config.run.steps_env as f64, trainer.steps_env() as f64);
    // One before the first batch, and one after the last.
    let tests = steps / config.test.interval_steps_env as f64 + 2.0;
    Ok(Some(Needs {
        run_s: setup_s + learning_s * steps / played.max(1.0) + tests * test_s,
        memory: peak_memory(),
    }))
}

/// The most memory that this process had so far, in bytes; Linux tells.
fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_foretold_from_a_part_of_it() {
        let settings = |steps: u64| {
            let own = [
                "algorithm.name=central-v".to_owned(),
                "algorithm.hidden=3".to_owned(),
                "test.episodes=2".to_owned(),
                format!("run.steps_env={steps}"),
            ];
            Config::with(&own.each_ref().map(String::as_str)).unwrap()
        };
        let stop = StopRequest::default();
        let needs = |steps| {
            measure(&settings(steps), Duration::from_millis(500), &stop)
                .unwrap()
                .unwrap()
        };
        let (short, long) = (needs(100), needs(100_000_000));
        assert!(short.run_s < 100.0, "{short:?}");
        assert!(long.run_s > 100.0 * short.run_s, "{short:?} {long:?}");
        if cfg!(target_os = "linux") {
            assert!(long.memory > Some(1 << 20), "{long:?}");
        }
        stop.make();
        assert_eq!(
            measure(&settings(100), Duration::ZERO, &stop).unwrap(),
            None
        );
    }
}
