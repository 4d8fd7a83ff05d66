//! `mackrl reproduce figure5`: the matrix game.
//!
//! Trains the three tabular learners at eleven probabilities of common knowledge, sets the result beside the published curve
//! and the exact optima, and judges every claim that the paper makes about the figure. A verdict follows from a rule that is
//! written beside the claim, not from the look of a curve, and it is printed whether or not it pleases.

mod chart;
mod claims;
mod findings;
mod options;
mod published;
mod report;
mod table;

use mackrl::tabular::{Learner, SweepSettings, TabularGame, optima, sweep};

pub(crate) use options::Figure5Options;
pub(crate) use report::Figure5Report;

use findings::Findings;
use report::Delegation;

use super::{Chart, make_folder, save};

/// Probabilities of common knowledge, as published.
fn points() -> Vec<f64> {
    (0..=10).map(|tenth| f64::from(tenth) / 10.0).collect()
}

/// Runs everything and writes `figure5.svg`, `figure5.png` and `figure5.json` into the folder that `options` names.
///
/// `progress` is told how many runs of how many are finished, from any thread. The files are the same bytes for any number of
/// threads.
///
/// # Errors
/// If a file cannot be written.
pub(crate) fn run(
    options: &Figure5Options,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> anyhow::Result<Figure5Report> {
    make_folder(&options.out)?;
    let report = compute(options, progress)?;
    let charts = [("figure5".to_owned(), report.chart())];
    save(&options.out, "figure5", &report, &charts)?;
    Ok(report)
}

impl Figure5Report {
    /// The figure.
    pub(crate) fn chart(&self) -> Chart {
        Chart::Lines(chart::chart(self))
    }
}

/// Runs everything and writes nothing.
fn compute(
    options: &Figure5Options,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> anyhow::Result<Figure5Report> {
    let points = points();
    let (payoffs, distribution) = (options.payoffs.into(), options.observation.into());
    let settings = SweepSettings {
        payoffs,
        distribution,
        points: points.clone(),
        runs: options.runs,
        seed: options.seed,
        threads: options.threads(),
    };
    let total = Learner::ALL.len() * points.len() * options.runs;
    let sweep = sweep(&settings, |done| progress(done, total))?;
    let optima = (points.iter())
        .map(|&p| Ok(optima(&TabularGame::new(payoffs, distribution, p)?)))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let findings = Findings {
        distribution,
        points: &points,
        sweep: &sweep,
        optima: &optima,
        published: published::published(distribution),
        delegation: Delegation::measured(&sweep, distribution, &points),
    };
    Ok(Figure5Report::new(options, findings))
}

#[cfg(test)]
mod tests;
