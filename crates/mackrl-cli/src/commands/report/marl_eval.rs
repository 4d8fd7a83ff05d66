//! Runs in the JSON format of marl-eval (Gorsane and others, "Towards a Standardised Performance Evaluation Protocol for
//! Cooperative MARL", 2022): environment, task, algorithm, run, step.
//!
//! marl-eval wants rectangular data, so every run is cut to the tests, and every algorithm to the number of runs, that all have. A
//! test's number is its mean over episodes, a list of one. `absolute_metrics` are what the best weights won in episodes that neither
//! training nor tests have seen, if the run says so; what it does not say is that of the last test.

use std::collections::BTreeMap;

use mackrl_run::recorded::{Grouping, Measurements, RecordedRun};

use anyhow::Context;
use serde_json::{Value, json};

use crate::failure::Failure;

/// What tests are exported: our name and theirs.
const METRICS: [(&str, &str); 3] = [
    ("test_battle_won_mean", "win_rate"),
    ("test_return_mean", "return"),
    ("test_ep_length_mean", "episode_length"),
];
/// The environment's name, as marl-eval groups tasks.
const ENVIRONMENT: &str = "SMAC";

/// The tests of a run: steps, seconds, and a number for each metric.
struct Tests {
    seed: u64,
    /// Environment steps between two tests.
    interval: u64,
    columns: Vec<Measurements>,
    /// Share of battles that the best weights won in the end.
    absolute_won: Option<f64>,
}

/// All runs as one document.
///
/// # Errors
/// If a run cannot be read, or the name of a series has a comma, which marl-eval takes for a separator.
pub(super) fn experiments(grouping: &Grouping) -> anyhow::Result<Value> {
    let mut runs: BTreeMap<&str, BTreeMap<&str, Vec<Tests>>> = BTreeMap::new();
    for series in &grouping.series {
        if series.name.contains(',') {
            let message = format!(
                "marl-eval takes no commas in names, and found `{}`",
                series.name
            );
            return Err(Failure::Usage { message }.into());
        }
        let tests = series
            .runs
            .iter()
            .map(Tests::read)
            .collect::<anyhow::Result<Vec<_>>>()?;
        runs.entry(&series.map)
            .or_default()
            .insert(&series.name, tests);
    }
    let all = || runs.values().flat_map(BTreeMap::values);
    let repetitions = all().map(Vec::len).min().unwrap_or(0);
    let length = all().flatten().map(Tests::count).min().unwrap_or(0);
    let tasks: BTreeMap<&str, BTreeMap<&str, BTreeMap<String, Value>>> = (runs.iter())
        .map(|(&map, algorithms)| {
            let algorithms = algorithms.iter().map(|(&name, runs)| {
                let runs = runs.iter().take(repetitions);
                (
                    name,
                    runs.map(|run| (run.name(), run.steps(length))).collect(),
                )
            });
            (map, algorithms.collect())
        })
        .collect();
    Ok(json!({ ENVIRONMENT: tasks }))
}

/// The absolute metric of a run that recorded it.
fn absolute_won(run: &RecordedRun) -> Option<f64> {
    let teams = run.teams.as_ref()?;
    let best = teams.best.filter(|_| teams.measure == "battle_won")?;
    Some(best.mean)
}

impl Tests {
    fn read(run: &RecordedRun) -> anyhow::Result<Self> {
        let columns = METRICS
            .iter()
            .map(|(ours, _)| Measurements::read(run, ours))
            .collect::<mackrl_run::Result<Vec<_>>>()
            .with_context(|| format!("cannot export {}", run.path.display()))?;
        Ok(Self {
            seed: run.config.run.seed,
            interval: run.config.test.interval_steps_env,
            columns,
            absolute_won: absolute_won(run),
        })
    }

    fn name(&self) -> String {
        format!("seed_{}", self.seed)
    }

    fn seconds(&self, test: usize) -> Value {
        json!(self.columns[0].wall_s[test])
    }

    fn count(&self) -> usize {
        let counts = self.columns.iter().map(|column| column.values.len());
        counts.min().unwrap_or(0)
    }

    /// The first `length` tests, and the last of them once more.
    fn steps(&self, length: usize) -> Value {
        let metrics = |test: usize| {
            METRICS
                .iter()
                .zip(&self.columns)
                .map(move |((_, theirs), column)| {
                    ((*theirs).to_owned(), json!([column.values[test]]))
                })
        };
        let step = |test: usize| {
            let mut step: serde_json::Map<String, Value> = metrics(test).collect();
            // Where the test was due, which is the same for all runs.
            let due = test as u64 * self.interval;
            step.insert("step_count".to_owned(), json!(due));
            step.insert("elapsed_time".to_owned(), self.seconds(test));
            (format!("step_{test}"), Value::Object(step))
        };
        let mut steps: serde_json::Map<String, Value> = (0..length).map(step).collect();
        if let Some(last) = length.checked_sub(1) {
            let mut absolute: serde_json::Map<String, Value> = metrics(last).collect();
            if let (Some(won), [(_, theirs), ..]) = (self.absolute_won, METRICS) {
                absolute.insert(theirs.to_owned(), json!([won]));
            }
            // marl-eval takes it for a metric, and wants the same metrics everywhere.
            absolute.insert("elapsed_time".to_owned(), self.seconds(last));
            steps.insert("absolute_metrics".to_owned(), Value::Object(absolute));
        }
        Value::Object(steps)
    }
}
