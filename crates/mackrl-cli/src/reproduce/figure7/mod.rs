//! `mackrl reproduce figure7`: how often pairs delegate, by how many enemies they commonly know, during training on `2s3z`.
//!
//! Uses the MACKRL runs of Figure 6; those that are finished in the folder are not repeated. As in the paper, only pairs with
//! some common knowledge count, of the partitions that were chosen.

mod chart;
mod claims;
mod table;

use std::fs;

use anyhow::Context as _;
use clap::Args;
use mackrl::statistics::mean_and_standard_error;
use mackrl_run::{provenance::Provenance, recorded::TrainingRun};
use serde::Serialize;

use super::{
    Claim,
    learning::{Job, Learner, LearningOptions, train_all},
    write,
};
use crate::plot::LineChart;

/// Enemies on the map.
const ENEMIES: usize = 5;
/// When the paper looked, in steps of its 2.5 million; here the same shares of training. What it shows at 400 steps can only be
/// the first batch.
const PUBLISHED_STEPS: [u64; 4] = [0, 500_000, 1_200_000, 1_600_000];
/// Length of the paper's training in steps.
const PUBLISHED_LENGTH: f64 = 2_500_000.0;
/// Delegation rates of the published figure, read from its vector graphics, for 0 to 5 enemies at each moment.
const PUBLISHED: [[f64; ENEMIES + 1]; 4] = [
    [0.046, 0.047, 0.034, 0.032, 0.031, 0.023],
    [0.093, 0.391, 0.149, 0.030, 0.003, 0.002],
    [0.158, 0.680, 0.176, 0.033, 0.000, 0.001],
    [0.137, 0.636, 0.932, 0.229, 0.002, 0.001],
];

/// Reproduce Figure 7: how often pairs delegate, by how many enemies they commonly know, on 2s3z.
///
/// Trains MACKRL as figure6 does, and looks at four moments of training. Runs that figure6 has finished in
/// the same folder are used as they are.
///
/// Writes figure7.svg, figure7.png and figure7.json, prints the rates beside the published ones, and judges what the paper says.
///
/// Example: mackrl reproduce figure7 --seeds 10 --steps 2500000 --out runs/learning
#[derive(Debug, Clone, Args)]
pub(crate) struct Figure7Options {
    #[command(flatten)]
    pub(crate) learning: LearningOptions,
}

/// Figure 7 in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Figure7Report {
    /// Repeats these numbers.
    pub(crate) command: String,
    /// Where the runs come from: one entry for each experiment.
    pub(crate) provenance: Vec<Provenance>,
    /// Seeds.
    pub(crate) seeds: u64,
    /// Four moments of training.
    pub(crate) moments: Vec<Moment>,
    /// Verdicts.
    pub(crate) claims: Vec<Claim>,
}

/// Delegation during one interval of training, or during the first batch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Moment {
    /// Environment steps at the interval's end; 0 for the first batch, which an untrained team played.
    pub(crate) steps: u64,
    /// By the number of commonly known enemies, from 0.
    pub(crate) rates: Vec<Rate>,
    /// The published rates at this share of training.
    pub(crate) published: [f64; ENEMIES + 1],
}

/// A delegation rate over seeds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Rate {
    /// Mean over the seeds in which such pairs occurred; `None` if there are fewer than two.
    pub(crate) mean: Option<f64>,
    /// Its standard error.
    pub(crate) sem: Option<f64>,
    /// Seeds in which such pairs occurred.
    pub(crate) seeds: usize,
}

/// Makes all runs that are not there and writes the figure into the folder that `options` names.
///
/// # Errors
/// If a run fails or a file cannot be written.
pub(crate) fn run(options: &Figure7Options) -> anyhow::Result<Figure7Report> {
    let options = options.learning.resolved();
    fs::create_dir_all(&options.out)
        .with_context(|| format!("creating the folder {}", options.out.display()))?;
    let job = |seed| Job::of_learner("2s3z", Learner::Mackrl, seed);
    let jobs: Vec<Job> = (1..=options.seeds).map(job).collect();
    let runs = train_all(&jobs, &options)?;
    let report = report(&options, &runs);
    let chart = report.chart();
    let json = serde_json::to_string_pretty(&report)? + "\n";
    write(&options.out, "figure7.json", json.as_bytes())?;
    write(&options.out, "figure7.svg", chart.to_svg().as_bytes())?;
    write(&options.out, "figure7.png", &chart.to_png()?)?;
    Ok(report)
}

impl Moment {
    /// When that was, in words.
    fn when(&self) -> String {
        match self.steps {
            0 => "in the first batch".to_owned(),
            steps => format!("after {} k steps", steps / 1_000),
        }
    }
}

impl Figure7Report {
    /// The figure.
    pub(crate) fn chart(&self) -> LineChart {
        chart::chart(self)
    }
}

fn report(options: &LearningOptions, runs: &[TrainingRun]) -> Figure7Report {
    let moments: Vec<Moment> = (PUBLISHED_STEPS.into_iter().zip(PUBLISHED))
        .map(|(step, published)| {
            let share = step as f64 / PUBLISHED_LENGTH;
            let interval = interval_at(share, options);
            let rate = |enemies| rate(runs, interval, enemies);
            Moment {
                steps: (interval as u64 * options.interval).min(options.steps),
                rates: (0..=ENEMIES).map(rate).collect(),
                published,
            }
        })
        .collect();
    Figure7Report {
        command: options.command("figure7"),
        provenance: TrainingRun::provenance_of(runs),
        seeds: options.seeds,
        claims: claims::claims(&moments),
        moments,
    }
}

/// The number of the test that ends the interval in which a share of training is reached; 0 stands for the first batch.
fn interval_at(share: f64, options: &LearningOptions) -> usize {
    let tests = usize::try_from(options.steps / options.interval)
        .unwrap_or(usize::MAX)
        .max(1);
    let reached =
        |test: &usize| *test as f64 * options.interval as f64 >= share * options.steps as f64;
    (0..=tests).find(reached).unwrap_or(tests)
}

fn rate(runs: &[TrainingRun], interval: usize, enemies: usize) -> Rate {
    let of_run = |run: &TrainingRun| *run.delegation.get(interval)?.get(enemies)?;
    let rates: Vec<f64> = runs.iter().filter_map(of_run).collect();
    let statistics = (rates.len() > 1).then(|| mean_and_standard_error(&rates));
    Rate {
        mean: statistics.map(|(mean, _)| mean),
        sem: statistics.map(|(_, error)| error),
        seeds: rates.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_the_same_shares_of_a_shorter_training() {
        let options = |steps, interval| LearningOptions {
            steps,
            interval,
            ..LearningOptions::default()
        };
        let long = options(2_500_000, 25_000);
        assert_eq!(
            [0.0, 0.2, 0.48, 0.64].map(|share| interval_at(share, &long)),
            [0, 20, 48, 64]
        );
        assert_eq!(interval_at(0.64, &options(1_000, 1_000)), 1);
    }
}
