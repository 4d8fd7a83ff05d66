//! What the runs show: the numbers of each learner on each map, and the verdicts on what is claimed.

use mackrl::statistics::{
    Aggregate, Bootstrap, Crossings, Interval, mean, mean_and_standard_error,
};
use mackrl_run::{provenance::Provenance, recorded::TrainingRun, training};
use serde::Serialize;

use super::{
    Comparison, Recorded,
    claims::Score,
    runs::{Cell, Kept},
};
use crate::reproduce::Claim;

/// Shares of battles until which steps are counted.
const LEVELS: [f64; 2] = [0.7, 0.9];
/// Points that others recorded stand in the table where their steps are a multiple of this.
const TOLD_STEPS_ENV: u64 = 500_000;

/// The comparison.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Report {
    /// Where the runs come from: one entry for each experiment.
    pub(super) provenance: Vec<Provenance>,
    /// Runs that are finished, and all runs of the plan.
    pub(super) finished: usize,
    pub(super) planned: usize,
    /// Learners on maps, in the order of the plan.
    pub(super) rows: Vec<Row>,
    pub(super) claims: Vec<Claim>,
    /// What others recorded beside ours, if the comparison has such points.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) beside: Vec<Beside>,
}

/// A learner on a map.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Row {
    pub(super) map: String,
    pub(super) learner: String,
    pub(super) runs: usize,
    pub(super) planned: usize,
    /// Environment steps of a run.
    pub(super) steps_env: u64,
    /// What the runs show, if any is finished.
    pub(super) found: Option<Found>,
}

/// A point that others recorded of a learner on a map, and ours there.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Beside {
    pub(super) map: String,
    pub(super) learner: String,
    pub(super) steps_env: u64,
    pub(super) recorded: f64,
    /// Mean over runs and its standard error, if a run has come so far.
    pub(super) ours: Option<(f64, f64)>,
    pub(super) runs: usize,
}

/// What the runs of a learner on a map show.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Found {
    /// Share of battles won in the last tenth of a run's tests: mean over runs and its standard error.
    pub(super) won: f64,
    pub(super) won_error: f64,
    /// The interquartile mean of the same, with its interval.
    pub(super) iqm: Interval,
    /// When the levels were first reached.
    pub(super) steps_to: Vec<Crossings>,
    /// What the best weights of each run win in battles that neither training nor tests have seen, in the mean over runs.
    pub(super) best: Option<f64>,
    /// Minutes of a run on one thread, in the mean.
    pub(super) minutes: f64,
    /// Environment steps of the tests, and what was won there: mean over runs with standard error.
    pub(super) steps: Vec<u64>,
    pub(super) curve: Vec<(f64, f64)>,
}

impl Report {
    pub(super) fn new(comparison: &Comparison, cells: &[Cell]) -> Self {
        let runs = cells.iter().flat_map(|cell| &cell.runs);
        let runs: Vec<TrainingRun> = runs.map(|kept| kept.run.clone()).collect();
        let claims = comparison.judge(cells);
        let beside = |cell: &Cell| {
            let recorded = comparison.recorded_of(&cell.map, &cell.learner);
            let points = recorded.into_iter().flat_map(Recorded::points);
            let told = points.filter(|(steps, _)| steps.is_multiple_of(TOLD_STEPS_ENV));
            let told = told.map(|(steps, won)| Beside::new(cell, steps, won));
            told.collect::<Vec<_>>()
        };
        Self {
            provenance: TrainingRun::provenance_of(&runs),
            finished: runs.len(),
            planned: cells.iter().map(|cell| cell.planned).sum(),
            rows: cells.iter().map(Row::new).collect(),
            claims,
            beside: cells.iter().flat_map(beside).collect(),
        }
    }
}

impl Row {
    fn new(cell: &Cell) -> Self {
        Self {
            map: cell.map.clone(),
            learner: cell.learner.clone(),
            runs: cell.runs.len(),
            planned: cell.planned,
            steps_env: cell.steps_env,
            found: (!cell.runs.is_empty()).then(|| Found::new(cell)),
        }
    }
}

impl Beside {
    fn new(cell: &Cell, steps_env: u64, recorded: f64) -> Self {
        let ours = Score::At(steps_env).of_all(cell);
        Self {
            map: cell.map.clone(),
            learner: cell.learner.clone(),
            steps_env,
            recorded,
            ours: (!ours.is_empty()).then(|| mean_and_standard_error(&ours)),
            runs: ours.len(),
        }
    }
}

impl Found {
    fn new(cell: &Cell) -> Self {
        let last = Score::End.of_all(cell);
        let (won, won_error) = mean_and_standard_error(&last);
        let tests = cell.runs.iter().map(|kept| kept.run.battle_won.len()).min();
        let due = |test: usize| (test as u64 * cell.interval).min(cell.steps_env);
        let steps: Vec<u64> = (0..tests.unwrap_or(0)).map(due).collect();
        let at = |test: usize| -> Vec<f64> {
            let runs = cell.runs.iter();
            runs.map(|kept| kept.run.battle_won[test]).collect()
        };
        let curve_of = |kept: &Kept| -> Vec<[f64; 2]> {
            let won = kept.run.battle_won.iter();
            steps
                .iter()
                .zip(won)
                .map(|(&step, &won)| [step as f64, won])
                .collect()
        };
        let curves: Vec<Vec<[f64; 2]>> = cell.runs.iter().map(curve_of).collect();
        let best = |kept: &Kept| {
            kept.beside
                .teams
                .as_ref()?
                .best
                .as_ref()
                .map(|score: &training::Score| score.mean)
        };
        let best: Option<Vec<f64>> = cell.runs.iter().map(best).collect();
        let minutes = cell.runs.iter().map(|kept| kept.beside.wall_s / 60.0);
        Self {
            won,
            won_error,
            iqm: Bootstrap::default().interval(std::slice::from_ref(&last), |tasks| {
                Aggregate::InterquartileMean.of(tasks)
            }),
            steps_to: LEVELS.map(|level| Crossings::of(&curves, level)).into(),
            best: best.map(|shares| mean(&shares)),
            minutes: mean(&minutes.collect::<Vec<_>>()),
            curve: (0..steps.len())
                .map(|test| mean_and_standard_error(&at(test)))
                .collect(),
            steps,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::runs::tests::{cell, cell_of},
        *,
    };

    const COMPARISON: Comparison = Comparison {
        name: "test",
        plans: &[],
        title: "",
        subtitle: "",
        recorded: &[Recorded {
            map: "3m",
            learner: "mappo",
            millions: &[0.1, 0.5, 1.0],
            won: &[0.1, 0.2, 0.3],
        }],
        claims: &[],
    };

    #[test]
    fn a_row_has_the_numbers_of_its_runs() {
        let cells = [cell("3m", "mappo", &[0.8, 1.0]), cell("3m", "ippo", &[])];
        let report = Report::new(&COMPARISON, &cells);
        assert_eq!((report.finished, report.planned), (2, 10));
        let found = report.rows[0].found.as_ref().unwrap();
        assert!((found.won - 0.9).abs() < 1e-12 && (found.won_error - 0.1).abs() < 1e-12);
        assert_eq!(found.steps, [0, 100, 200]);
        assert_eq!(found.steps_to[0].reached, 2);
        assert_eq!(found.steps_to[1].reached, 1);
        assert_eq!((found.minutes, found.best), (1.5, None));
        assert!(report.rows[1].found.is_none());
    }

    #[test]
    fn recorded_points_stand_beside_ours_where_a_run_has_come_so_far() {
        let won = vec![0.25; 5001];
        let cells = [cell_of("3m", "mappo", vec![won.clone(), won])];
        let report = Report::new(&COMPARISON, &cells);
        let told = report.beside.iter();
        let told: Vec<_> = told
            .map(|one| (one.steps_env, one.recorded, one.ours))
            .collect();
        assert_eq!(
            told,
            [(500_000, 0.2, Some((0.25, 0.0))), (1_000_000, 0.3, None)]
        );
        assert!(
            Report::new(&COMPARISON, &[cell("8m", "mappo", &[1.0])])
                .beside
                .is_empty()
        );
    }
}
