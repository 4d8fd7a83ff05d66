//! Two runs played again side by side, to the update and the game step in which they part.
//!
//! Runs keep few checkpoints and no episodes, but a run is a function of its configuration: what they played can be had again. The
//! rows of metrics that come up on the way are compared with the recorded ones, so that records which do not belong to their
//! configuration do not pass for a difference of the runs.

use mackrl_run::{
    run_folder::{Recorded, Row, timeless},
    training::{Difference, Trainer},
};
use serde::Serialize;
use serde_json::Value;

use super::{Differing, files::in_words, runs::first_in_rows};
use crate::progress::Meter;

/// What playing two runs again showed.
#[derive(Debug, Serialize)]
pub(super) struct Replay {
    /// Environment steps that each of them was played for.
    steps_env: [u64; 2],
    /// The first parameter in which the learners differ.
    pub(super) learning: Option<Parting>,
    /// The first game step that differs.
    pub(super) game: Option<Parting>,
    /// For each run, the first recorded row that is not what its configuration gives.
    pub(super) not_reproduced: [Option<RowDifference>; 2],
    /// Why a run could not be played to the end.
    stopped: Option<String>,
}

/// Where two runs part.
#[derive(Debug, Serialize)]
pub(super) struct Parting {
    /// Updates before the one in which they part; 0 is the first update, or the time before it.
    update: u64,
    #[serde(flatten)]
    difference: Difference,
}

/// A row of metrics that differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct RowDifference {
    /// Its number, from 1, which is its line.
    pub(super) row: usize,
    /// Environment steps at that row.
    pub(super) t_env: Value,
    #[serde(flatten)]
    pub(super) value: Differing,
}

/// Plays both runs until a game step differs, or until the row with index `last_row` has been reached by both.
pub(super) fn replay(
    runs: [&Recorded; 2],
    last_row: usize,
    threads: usize,
) -> anyhow::Result<Replay> {
    let [a, b] = runs;
    let mut trainers = [
        Trainer::new(&a.config, threads)?,
        Trainer::new(&b.config, threads)?,
    ];
    let mut rows: [Vec<Row>; 2] = Default::default();
    let mut replay = Replay {
        steps_env: [0; 2],
        learning: None,
        game: None,
        not_reproduced: [None, None],
        stopped: None,
    };
    let meter = Meter::new("thousand steps");
    let total = row_steps(a, last_row).max(row_steps(b, last_row));
    let mut update = 0;
    replay.note_learning(&trainers, update);
    while !trainers.iter().all(Trainer::finished) {
        for (trainer, rows) in trainers.iter_mut().zip(&mut rows) {
            match trainer.next_batch() {
                Ok(new) => rows.extend(new.iter().map(as_recorded)),
                Err(error) => replay.stopped = Some(error.to_string()),
            }
        }
        replay.steps_env = [0, 1].map(|i| trainers[i].steps_env());
        let [one, other] = &mut trainers;
        let difference = one.compare_batches(other);
        replay.game = difference.map(|difference| Parting { update, difference });
        replay.note_learning(&trainers, update);
        update += 1;
        let reached = rows.iter().all(|rows| rows.len() > last_row);
        if replay.game.is_some() || replay.stopped.is_some() || reached {
            break;
        }
        let thousands = |steps: u64| usize::try_from(steps / 1_000).unwrap_or(usize::MAX);
        meter.report(
            thousands(replay.steps_env[0]).min(thousands(total)),
            thousands(total),
        );
    }
    replay.not_reproduced = [0, 1].map(|i| {
        let played = rows[i].len();
        first_in_rows(&runs[i].rows[..played.min(runs[i].rows.len())], &rows[i])
    });
    Ok(replay)
}

impl Replay {
    fn note_learning(&mut self, [a, b]: &[Trainer; 2], update: u64) {
        if self.learning.is_none() {
            let difference = a.compare_parameters(b);
            self.learning = difference.map(|difference| Parting { update, difference });
        }
    }

    pub(super) fn lines(&self) -> Vec<(&'static str, String)> {
        let [a, b] = self.steps_env;
        let none = || format!("no difference in {a} and {b} environment steps, played again");
        let parting = |parting: &Option<Parting>| {
            parting
                .as_ref()
                .map_or_else(none, |Parting { update, difference }| {
                    format!("in update {update}, {}", in_words(difference))
                })
        };
        let record = |found: &Option<RowDifference>| {
            found.as_ref().map_or_else(
                || "are what its configuration gives, as far as it was played again".to_owned(),
                |found| {
                    format!(
                        "are not what its configuration gives here: {} (recorded, played again); they were changed, \
                         or made by other code or on another machine",
                        found.words()
                    )
                },
            )
        };
        let mut lines = vec![
            ("learning", parting(&self.learning)),
            ("game", parting(&self.game)),
            ("records of a", record(&self.not_reproduced[0])),
            ("records of b", record(&self.not_reproduced[1])),
        ];
        if let Some(stopped) = &self.stopped {
            lines.push(("stopped", stopped.clone()));
        }
        lines
    }
}

impl RowDifference {
    /// "row R (T environment steps), NAME: A, B"
    pub(super) fn words(&self) -> String {
        let Self { row, t_env, value } = self;
        format!("row {row} ({t_env} environment steps), {}", value.words())
    }
}

/// A row as it would be read from the metrics of a run.
fn as_recorded(row: &mackrl_run::training::MetricRow) -> Row {
    match serde_json::to_value(row) {
        Ok(Value::Object(row)) => timeless(row),
        _ => Row::new(),
    }
}

/// Environment steps at a row, or at the last one.
fn row_steps(run: &Recorded, row: usize) -> u64 {
    let row = run.rows.get(row).or(run.rows.last());
    let steps = row.and_then(|row| row.get("t_env")?.as_u64());
    steps.unwrap_or(run.config.run.steps_env)
}
