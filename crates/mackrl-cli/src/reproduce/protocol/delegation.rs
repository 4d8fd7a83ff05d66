//! Figure 7: how often pairs delegate, by how many enemies they commonly know.

use mackrl::statistics::mean;
use mackrl_run::recorded::{ByEnemies, TrainingRun};
use serde::Serialize;

use super::study::Cell;
use crate::reproduce::{figure7, learning::Curves};

/// When pairs delegate, in training and in greedy tests.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Delegation {
    pub(super) training: Vec<Moment>,
    pub(super) tests: Vec<Moment>,
}

/// At one moment: in the interval before it, or in its test.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Moment {
    /// Environment steps; 0 for the first batch, or the untrained team's test.
    pub(super) steps: u64,
    /// Of each run, by seed: shares that delegate, by the number of commonly known enemies.
    pub(super) runs: Vec<(u64, Vec<Option<f64>>)>,
    /// Mean over the runs in which that occurred.
    pub(super) mean: Vec<Option<f64>>,
    /// Share of the cases that have so many enemies, mean over runs.
    pub(super) cases: Vec<Option<f64>>,
    pub(super) published: &'static [f64],
}

impl Delegation {
    /// Of the runs of a cell; nothing if there are none.
    pub(super) fn of(cell: &Cell) -> Option<Self> {
        let Curves::Moments(published) = figure7::FIGURE.curves else {
            return None;
        };
        let moments = |rates: fn(&TrainingRun) -> [&ByEnemies; 2]| -> Vec<Moment> {
            let moment = |(steps, published): &'static (u64, [f64; 6])| {
                let test = usize::try_from(steps / cell.interval).unwrap_or(usize::MAX);
                Moment::new(cell, (*steps, test), published, rates)
            };
            published.iter().map(moment).collect()
        };
        (!cell.runs.is_empty()).then(|| Self {
            training: moments(|run| [&run.delegation, &run.cases]),
            tests: moments(|run| [&run.test_delegation, &run.test_cases]),
        })
    }
}

impl Moment {
    fn new(
        cell: &Cell,
        (steps, test): (u64, usize),
        published: &'static [f64; 6],
        rates: fn(&TrainingRun) -> [&ByEnemies; 2],
    ) -> Self {
        let row = |shares: &ByEnemies| -> Vec<Option<f64>> {
            let row = shares.get(test);
            (0..published.len())
                .map(|enemies| row.and_then(|row| *row.get(enemies)?))
                .collect()
        };
        let of = |which: usize| -> Vec<(u64, Vec<Option<f64>>)> {
            let runs = cell.runs.iter();
            runs.map(|(&seed, run)| (seed, row(rates(run)[which])))
                .collect()
        };
        let (runs, cases) = (of(0), of(1));
        Self {
            steps,
            mean: means(&runs, published.len()),
            cases: means(&cases, published.len()),
            runs,
            published,
        }
    }
}

/// Over the runs in which it occurred, by the number of enemies.
fn means(runs: &[(u64, Vec<Option<f64>>)], enemies: usize) -> Vec<Option<f64>> {
    let of = |enemies: usize| {
        let rates: Vec<f64> = runs
            .iter()
            .filter_map(|(_, rates)| rates[enemies])
            .collect();
        (!rates.is_empty()).then(|| mean(&rates))
    };
    (0..enemies).map(of).collect()
}
