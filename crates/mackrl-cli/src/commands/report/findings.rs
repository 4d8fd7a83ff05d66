//! The statistics of a report.

use mackrl_run::provenance::Provenance;

use mackrl::statistics::{
    Aggregate, Bootstrap, Crossings, Interval, mean_and_standard_error, probability_of_improvement,
    student_factor,
};
use serde::Serialize;

use super::scores::{Cell, Scores};
use crate::args::ReportArgs;

/// Levels of a share that curves are asked about.
const LEVELS: [f64; 3] = [0.5, 0.7, 0.9];

/// Runs of each of two learners from which on they are compared.
pub(super) const RUNS_LEAST: usize = 5;

/// What the runs show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Findings {
    /// What was judged.
    pub(super) metric: String,
    /// How a run was scored, in words.
    pub(super) score: String,
    /// Share of resamples inside an interval.
    pub(super) confidence: f64,
    /// Resamples of each interval.
    pub(super) resamples: usize,
    /// Where the runs come from: one entry for each experiment.
    pub(super) provenance: Vec<Provenance>,
    /// Each algorithm on each map.
    pub(super) maps: Vec<MapFindings>,
    /// Each algorithm over all maps; empty if there is only one.
    pub(super) overall: Vec<Overall>,
}

/// What the runs on one map show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct MapFindings {
    pub(super) map: String,
    pub(super) algorithms: Vec<AlgorithmFindings>,
    pub(super) comparisons: Vec<Comparison>,
}

/// What the runs of an algorithm on a map show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct AlgorithmFindings {
    pub(super) algorithm: String,
    pub(super) runs: usize,
    pub(super) averages: Averages,
    /// Standard error of the mean.
    pub(super) standard_error: f64,
    /// The 95 % interval of the mean by Student's t, of more than one run.
    pub(super) student_interval: Option<[f64; 2]>,
    /// Environment steps until levels are first reached.
    pub(super) steps_to: Vec<Crossings>,
}

/// What the runs of an algorithm on all maps show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Overall {
    pub(super) algorithm: String,
    pub(super) averages: Averages,
    pub(super) comparisons: Vec<Comparison>,
}

/// Three averages with their intervals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Averages {
    pub(super) interquartile_mean: Interval,
    pub(super) median: Interval,
    pub(super) mean: Interval,
}

/// How often one algorithm is better than another.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Comparison {
    pub(super) first: String,
    pub(super) second: String,
    /// That a run of the first scores higher than a run of the second.
    pub(super) probability_of_improvement: Interval,
    /// Whether there are runs enough to say so.
    pub(super) tested: bool,
}

impl Findings {
    /// Computes everything.
    pub(super) fn new(
        scores: &Scores,
        metric: String,
        args: &ReportArgs,
        provenance: Vec<Provenance>,
    ) -> Self {
        let bootstrap = Bootstrap {
            resamples: usize::try_from(args.resamples).unwrap_or(usize::MAX),
            ..Bootstrap::default()
        };
        let score = args.at.map_or_else(
            || "mean of the last tenth of a run's tests".to_owned(),
            |steps| format!("a run's curve at {steps} environment steps"),
        );
        let several = scores.maps.len() > 1;
        Self {
            metric,
            score,
            confidence: bootstrap.confidence,
            resamples: bootstrap.resamples,
            provenance,
            maps: (scores.maps.iter())
                .map(|map| MapFindings::new(scores, map, bootstrap))
                .collect(),
            overall: if several {
                overall(scores, bootstrap)
            } else {
                Vec::new()
            },
        }
    }
}

impl MapFindings {
    fn new(scores: &Scores, map: &str, bootstrap: Bootstrap) -> Self {
        let cells: Vec<&Cell> = (scores.cells.iter())
            .filter(|cell| cell.map == map)
            .collect();
        let algorithm = |cell: &&Cell| AlgorithmFindings {
            algorithm: cell.algorithm.clone(),
            runs: cell.scores.len(),
            averages: Averages::of(std::slice::from_ref(&cell.scores), bootstrap),
            standard_error: mean_and_standard_error(&cell.scores).1,
            student_interval: student_interval(&cell.scores),
            steps_to: LEVELS
                .map(|level| Crossings::of(&cell.curves, level))
                .into(),
        };
        let mut comparisons = Vec::new();
        for (number, first) in cells.iter().enumerate() {
            for second in &cells[number + 1..] {
                let names = [&first.algorithm, &second.algorithm].map(|name| &**name);
                let both = [&first.scores, &second.scores].map(std::slice::from_ref);
                comparisons.push(Comparison::of(names, both, bootstrap));
            }
        }
        Self {
            map: map.to_owned(),
            algorithms: cells.iter().map(algorithm).collect(),
            comparisons,
        }
    }
}

/// Algorithms that were run on every map.
fn overall(scores: &Scores, bootstrap: Bootstrap) -> Vec<Overall> {
    let maps: Vec<&str> = scores.maps.iter().map(String::as_str).collect();
    let complete: Vec<(&str, Vec<Vec<f64>>)> = (scores.algorithms.iter())
        .filter_map(|algorithm| Some((&**algorithm, scores.on(algorithm, &maps)?)))
        .collect();
    let of = |(number, (algorithm, tasks)): (usize, &(&str, Vec<Vec<f64>>))| Overall {
        algorithm: (*algorithm).to_owned(),
        averages: Averages::of(tasks, bootstrap),
        comparisons: (complete[number + 1..].iter())
            .map(|(other, others)| Comparison::of([algorithm, other], [tasks, others], bootstrap))
            .collect(),
    };
    complete.iter().enumerate().map(of).collect()
}

/// The 95 % interval of the mean.
fn student_interval(scores: &[f64]) -> Option<[f64; 2]> {
    let (mean, error) = mean_and_standard_error(scores);
    let degrees = scores.len().checked_sub(1).filter(|&degrees| degrees > 0)?;
    let half = student_factor(degrees as f64) * error;
    Some([mean - half, mean + half])
}

impl Averages {
    fn of(tasks: &[Vec<f64>], bootstrap: Bootstrap) -> Self {
        let average = |aggregate: Aggregate| bootstrap.interval(tasks, |tasks| aggregate.of(tasks));
        Self {
            interquartile_mean: average(Aggregate::InterquartileMean),
            median: average(Aggregate::Median),
            mean: average(Aggregate::Mean),
        }
    }
}

impl Comparison {
    fn of(names: [&str; 2], [first, second]: [&[Vec<f64>]; 2], bootstrap: Bootstrap) -> Self {
        let both = [first, second].concat();
        let improvement = |strata: &[Vec<f64>]| {
            let (first, second) = strata.split_at(first.len());
            probability_of_improvement(first, second)
        };
        Self {
            first: names[0].to_owned(),
            second: names[1].to_owned(),
            probability_of_improvement: bootstrap.interval(&both, improvement),
            tested: both.iter().all(|runs| runs.len() >= RUNS_LEAST),
        }
    }
}
