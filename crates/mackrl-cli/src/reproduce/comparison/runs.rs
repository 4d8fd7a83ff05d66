//! The runs of plans, by map and learner, and what is kept of those that are finished.

use std::{fs, path::Path};

use anyhow::Context as _;
use mackrl_run::{
    bounded,
    recorded::{KEPT, Measurements, RecordedRun, TrainingRun},
    sweep::{Entry, State},
    training::Teams,
};
use serde::{Deserialize, Serialize};

use crate::reproduce::write;

/// Longest file that is read, in bytes.
const LENGTH_MAX: usize = 1 << 26;
/// In every row of metrics that a test gives.
const TESTED: &str = "test_return_mean";

/// The runs of a learner on a map.
#[derive(Debug, Clone)]
pub(super) struct Cell {
    pub(super) map: String,
    /// What learns, and the names of varied settings.
    pub(super) learner: String,
    /// Runs that the plan has.
    pub(super) planned: usize,
    /// Environment steps of each.
    pub(super) steps_env: u64,
    /// Those between two tests.
    pub(super) interval: u64,
    /// Those that are finished.
    pub(super) runs: Vec<Kept>,
}

/// What is kept of a run.
#[derive(Debug, Clone)]
pub(super) struct Kept {
    pub(super) run: TrainingRun,
    pub(super) beside: Beside,
}

/// What stands in its file beside the curves that every figure needs.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Beside {
    /// Seconds that training and tests took, on one thread.
    pub(super) wall_s: f64,
    /// How its last and its best weights play.
    pub(super) teams: Option<Teams>,
}

/// The file as it is written.
#[derive(Serialize)]
struct Written<'a> {
    #[serde(flatten)]
    run: &'a TrainingRun,
    #[serde(flatten)]
    beside: &'a Beside,
}

/// The runs of which nothing is kept yet, in the order of the plan.
pub(super) fn missing(entries: &[Entry], out: &Path) -> Vec<Entry> {
    let is_missing = |entry: &&Entry| load(entry, out).is_none();
    entries.iter().filter(is_missing).cloned().collect()
}

/// What is kept of the run, if that is a run with this configuration; settings that did not exist then count as their built-in values.
fn load(entry: &Entry, out: &Path) -> Option<Kept> {
    let path = out.join(KEPT).join(file_name(entry));
    let run = TrainingRun::load(&path).ok()?;
    let is_same = run.config().is_ok_and(|config| config == entry.config);
    let bytes = bounded::read(&path, LENGTH_MAX).ok()?;
    let beside = serde_json::from_slice(&bytes).ok()?;
    is_same.then_some(Kept { run, beside })
}

/// Keeps what the comparison needs of those of these runs that are finished.
pub(super) fn keep_finished(entries: &[Entry], out: &Path) -> anyhow::Result<()> {
    let folder = out.join(KEPT);
    for entry in entries {
        if entry.state()? != State::Finished {
            continue;
        }
        fs::create_dir_all(&folder).with_context(|| format!("creating {}", folder.display()))?;
        let run = TrainingRun::of_folder(&entry.folder)?;
        let recorded = RecordedRun::open(entry.folder.clone())?;
        let wall_s = Measurements::read(&recorded, TESTED)?.wall_s;
        let beside = Beside {
            wall_s: wall_s.last().copied().unwrap_or_default(),
            teams: recorded.teams,
        };
        let written = Written {
            run: &run,
            beside: &beside,
        };
        let json = serde_json::to_string(&written)? + "\n";
        write(&folder, &file_name(entry), json.as_bytes())?;
    }
    Ok(())
}

fn file_name(entry: &Entry) -> String {
    format!("{}.json", entry.name)
}

/// All cells of some plans, in the order in which they first speak of them, with the runs that are kept.
pub(super) fn cells(entries: &[Entry], out: &Path) -> Vec<Cell> {
    let mut cells: Vec<Cell> = Vec::new();
    for entry in entries {
        let (map, learner) = (entry.config.env.map(), learner(entry));
        let same = |cell: &Cell| cell.map == map && cell.learner == learner;
        let place = cells.iter().position(same).unwrap_or_else(|| {
            cells.push(Cell {
                map: map.to_owned(),
                learner: learner.clone(),
                planned: 0,
                steps_env: entry.config.run.steps_env,
                interval: entry.config.test.interval_steps_env,
                runs: Vec::new(),
            });
            cells.len() - 1
        });
        cells[place].planned += 1;
        cells[place].runs.extend(load(entry, out));
    }
    cells
}

/// The name of a run without map and seed; a variant that is called as what learns in it is that learner.
fn learner(entry: &Entry) -> String {
    let seed = format!("-seed{}", entry.config.run.seed);
    let name = entry.name.strip_suffix(&seed).unwrap_or(&entry.name);
    let algorithm = entry.config.algorithm.name();
    let start = name.find(algorithm).unwrap_or(0);
    match name[start..].strip_prefix(algorithm) {
        Some(variant) if variant.strip_prefix('-') == Some(algorithm) => algorithm.to_owned(),
        _ => name[start..].to_owned(),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use mackrl_run::config::Config;

    use super::*;

    /// A learner on a map, with a run for each list of shares of battles won in tests after every 100 steps.
    pub(in super::super) fn cell_of(map: &str, learner: &str, won: Vec<Vec<f64>>) -> Cell {
        let tests = won.iter().map(Vec::len).max().unwrap_or(0) as u64;
        let kept = |won| Kept {
            run: TrainingRun::new(&Config::default(), won, Vec::new()),
            beside: Beside {
                wall_s: 90.0,
                teams: None,
            },
        };
        Cell {
            map: map.to_owned(),
            learner: learner.to_owned(),
            planned: 5,
            steps_env: 100 * tests.saturating_sub(1),
            interval: 100,
            runs: won.into_iter().map(kept).collect(),
        }
    }

    /// The same, with three tests of which the last has these shares.
    pub(in super::super) fn cell(map: &str, learner: &str, ends: &[f64]) -> Cell {
        let won = ends.iter().map(|&end| vec![0.0, end / 2.0, end]);
        cell_of(map, learner, won.collect())
    }
}
