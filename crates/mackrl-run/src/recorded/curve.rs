//! The curves of a run, read from its metrics.

use std::collections::BTreeSet;

use mackrl::statistics::mean;
use serde_json::Value;

use super::RecordedRun;
use crate::{
    config::nearest,
    error::{Result, RunError},
    run_folder::{METRICS, Row, StoredRun},
};

/// Share of the tests at the end of a run whose mean is the run's score.
const FINAL_SHARE: f64 = 0.1;

/// What a curve is drawn over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Environment steps, summed over the parallel environments.
    Steps,
    /// Seconds of training and testing, pauses left out: what sys/sps says, added up.
    WallClock,
}

/// One metric of one run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measurements {
    /// Environment steps so far.
    pub steps: Vec<f64>,
    /// Seconds so far.
    pub wall_s: Vec<f64>,
    /// The metric.
    pub values: Vec<f64>,
}

impl Measurements {
    /// Reads the `metric` of a run.
    ///
    /// # Errors
    /// If the metrics cannot be read; [`RunError::MissingMetric`] if no row has the metric.
    pub fn read(run: &RecordedRun, metric: &str) -> Result<Self> {
        if let Some(kept) = &run.kept {
            return kept.measurements(metric, &run.config).ok_or_else(|| {
                let message = format!("{} keeps no metric `{metric}`", run.path.display());
                RunError::MissingMetric { message }
            });
        }
        let mut reading = Reading::default();
        StoredRun::open(&run.path)?.rows(|row| reading.note(row, metric))?;
        let path = run.path.join(METRICS);
        let name = path.display();
        let Reading { found, seen, .. } = reading;
        if found.values.is_empty() {
            let suggestion = nearest(metric, seen.iter().map(String::as_str));
            let suggestion =
                suggestion.map_or_else(String::new, |name| format!(", did you mean `{name}`?"));
            let message = format!("{name} has no metric `{metric}`{suggestion}");
            return Err(RunError::MissingMetric { message });
        }
        Ok(found)
    }

    /// The curve: (x, y) in ascending order of x.
    pub fn over(&self, axis: Axis) -> Vec<[f64; 2]> {
        let places = match axis {
            Axis::Steps => &self.steps,
            Axis::WallClock => &self.wall_s,
        };
        let points = places.iter().zip(&self.values);
        points.map(|(&x, &y)| [x, y]).collect()
    }
}

/// Metrics that have been read so far.
#[derive(Debug, Default)]
struct Reading {
    found: Measurements,
    seen: BTreeSet<String>,
    steps: f64,
    wall_s: f64,
}

impl Reading {
    fn note(&mut self, row: Row, metric: &str) {
        let number = |name: &str| row.get(name).and_then(Value::as_f64);
        let steps = number("t_env").unwrap_or(self.steps);
        if let Some(rate) = number("sys/sps").filter(|rate| *rate > 0.0) {
            self.wall_s += (steps - self.steps) / rate;
        }
        self.steps = steps;
        if let Some(value) = number(metric) {
            self.found.steps.push(steps);
            self.found.wall_s.push(self.wall_s);
            self.found.values.push(value);
        }
        self.seen.extend(row.into_iter().map(|(name, _)| name));
    }
}

/// The mean of the last tenth of a run's tests, at least one of them: one test of few episodes says little.
pub fn final_mean(values: &[f64]) -> f64 {
    mean(&values[values.len() - share_of(values.len(), FINAL_SHARE)..])
}

/// A share of `count`, rounded up: at least one if there is one.
pub fn share_of(count: usize, share: f64) -> usize {
    (1..=count)
        .find(|&part| part as f64 >= share * count as f64)
        .unwrap_or(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_is_at_least_one_test() {
        assert_eq!(
            [0, 1, 5, 10, 11, 101].map(|count| share_of(count, 0.1)),
            [0, 1, 1, 1, 2, 11]
        );
        assert_eq!(final_mean(&[0.0, 0.0, 1.0]), 1.0);
    }

    #[test]
    fn seconds_are_steps_over_rates_and_tests_without_steps_take_none() {
        let mut reading = Reading::default();
        for row in [
            r#"{"t_env": 0, "won": 0.5}"#,
            r#"{"t_env": 100, "sys/sps": 50}"#,
            r#"{"t_env": 400, "sys/sps": 100, "won": 0.75}"#,
        ] {
            reading.note(serde_json::from_str(row).unwrap(), "won");
        }
        assert_eq!(
            reading.found,
            Measurements {
                steps: vec![0.0, 400.0],
                wall_s: vec![0.0, 5.0],
                values: vec![0.5, 0.75]
            }
        );
        assert_eq!(reading.found.over(Axis::WallClock)[1], [5.0, 0.75]);
    }
}
