//! `mackrl reproduce figure6`: win rates of MACKRL and Central-V during training, on `3m` and `2s3z`.
//!
//! Both learners have the same settings, those of a preset; nothing is tuned for either. Each claim of the paper is judged by a
//! rule that is written beside it, and the published curve stands beside ours. Our game is a simulation of the paper's, so
//! what carries over is the order of the learners, not the height of a curve.

mod chart;
mod claims;
mod published;
mod table;

use std::fs;

use anyhow::Context as _;
use clap::Args;
use mackrl_run::{provenance::Provenance, recorded::TrainingRun};
use serde::Serialize;

use super::{
    Claim,
    learning::{Curve, Job, Learner, LearningOptions, train_all},
    write,
};
use crate::plot::LineChart;
use published::Published;

/// Maps of the figure.
const MAPS: [&str; 2] = ["3m", "2s3z"];
/// Learners of the figure.
const LEARNERS: [Learner; 2] = [Learner::Mackrl, Learner::CentralV];

/// Reproduce Figure 6: win rates of MACKRL and Central-V during training, on 3m and 2s3z.
///
/// Trains both learners with one preset, many seeds each, with a greedy test after every interval. A run that is finished in
/// the folder is not repeated, so the command can be stopped and given again.
///
/// Writes figure6-3m and figure6-2s3z as .svg and .png, and figure6.json, prints the curves beside the published ones, and
/// judges every claim of the paper: holds or does not, with the numbers.
///
/// Example: mackrl reproduce figure6 --seeds 10 --steps 2500000 --out runs/learning
#[derive(Debug, Clone, Args)]
pub(crate) struct Figure6Options {
    #[command(flatten)]
    pub(crate) learning: LearningOptions,
}

/// Figure 6 in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Figure6Report {
    /// Repeats these numbers.
    pub(crate) command: String,
    /// Where the runs come from: one entry for each experiment.
    pub(crate) provenance: Vec<Provenance>,
    /// Seeds of each learner on each map.
    pub(crate) seeds: u64,
    /// Environment steps at each test.
    pub(crate) steps: Vec<u64>,
    /// A panel per map.
    pub(crate) panels: Vec<Panel>,
    /// Verdicts.
    pub(crate) claims: Vec<Claim>,
}

/// One map of the figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Panel {
    /// The map's name.
    pub(crate) map: &'static str,
    /// Share of battles won in greedy tests.
    pub(crate) mackrl: Curve,
    /// Share of battles won in greedy tests.
    pub(crate) central_v: Curve,
    /// The published curves.
    pub(crate) published: Published,
}

/// The runs of one map.
struct MapRuns<'a> {
    mackrl: &'a [TrainingRun],
    central_v: &'a [TrainingRun],
}

/// Makes all runs and writes the figure into the folder that `options` names.
///
/// # Errors
/// If a run fails or a file cannot be written.
pub(crate) fn run(options: &Figure6Options) -> anyhow::Result<Figure6Report> {
    let options = options.learning.resolved();
    // A folder that cannot be written should be found out before the work, not after it.
    fs::create_dir_all(&options.out)
        .with_context(|| format!("creating the folder {}", options.out.display()))?;
    let jobs = jobs(&options);
    let runs = train_all(&jobs, &options)?;
    let report = report(&options, &runs);
    let json = serde_json::to_string_pretty(&report)? + "\n";
    write(&options.out, "figure6.json", json.as_bytes())?;
    for (panel, chart) in report.panels.iter().zip(report.charts()) {
        let name = |ending| format!("figure6-{}.{ending}", panel.map);
        write(&options.out, &name("svg"), chart.to_svg().as_bytes())?;
        write(&options.out, &name("png"), &chart.to_png()?)?;
    }
    Ok(report)
}

/// Maps, then learners, then seeds: the order in which [`report`] takes the runs apart.
fn jobs(options: &LearningOptions) -> Vec<Job> {
    let mut jobs = Vec::new();
    for map in MAPS {
        for learner in LEARNERS {
            jobs.extend((1..=options.seeds).map(|seed| Job::of_learner(map, learner, seed)));
        }
    }
    jobs
}

fn report(options: &LearningOptions, runs: &[TrainingRun]) -> Figure6Report {
    let by_learner: Vec<&[TrainingRun]> = runs.chunks(runs.len() / 4).collect();
    let maps = by_learner.chunks(2).map(|pair| MapRuns {
        mackrl: pair[0],
        central_v: pair[1],
    });
    let maps: Vec<MapRuns<'_>> = maps.collect();
    let panel = |(map, runs): (&'static str, &MapRuns<'_>)| Panel {
        map,
        mackrl: curve(runs.mackrl),
        central_v: curve(runs.central_v),
        published: published::published(map),
    };
    let panels: Vec<Panel> = MAPS.into_iter().zip(&maps).map(panel).collect();
    let tests = panels
        .iter()
        .map(|panel| panel.mackrl.mean.len())
        .max()
        .unwrap_or(0);
    Figure6Report {
        command: options.command("figure6"),
        provenance: TrainingRun::provenance_of(runs),
        seeds: options.seeds,
        steps: options.steps_of(tests),
        claims: claims::claims(&maps[0], &maps[1]),
        panels,
    }
}

impl Figure6Report {
    /// A chart for each map.
    pub(crate) fn charts(&self) -> Vec<LineChart> {
        let panels = self.panels.iter();
        panels
            .map(|panel| chart::chart(panel, &self.steps))
            .collect()
    }
}

fn curve(runs: &[TrainingRun]) -> Curve {
    Curve::of(
        &runs
            .iter()
            .map(|run| run.battle_won.as_slice())
            .collect::<Vec<_>>(),
    )
}
