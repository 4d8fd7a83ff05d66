//! `mackrl reproduce protocol`: verdicts on Figures 6 and 7 from runs that a protocol planned.
//!
//! The plans say which runs there are, [`claims`] what is claimed of them and when it holds; both are committed before the runs.
//! Nothing is trained here: `mackrl sweep` makes the runs. What is missing is a verdict of its own.

mod chart;
mod claims;
mod delegation;
mod study;
#[cfg(test)]
mod tests;
mod text;

use std::path::{Path, PathBuf};

use clap::Args;
use mackrl::statistics::Interval;
use mackrl_run::{
    provenance::{Provenance, Versions},
    sweep::Plan,
};
use serde::Serialize;

use self::{
    claims::{ABLATIONS, CLAIMS, Judgement, Statement},
    delegation::Delegation,
    study::{Cell, LEARNERS, Levels, Quantity, Study},
};
use super::{ClaimSource, save, write};
use crate::failure::Failure;

/// Judge what the runs of a protocol show, and draw them again: results/protocol/README.md.
///
/// Reads every plan-*.toml in DIR, and of each of its runs what is kept in DIR/runs, or else the finished run folder that `mackrl sweep`
/// made, of which it then keeps what figures need in DIR/runs. Trains nothing: what is missing makes a claim "not tested".
///
/// Writes protocol.json, report.txt and the charts into DIR. Configurations are compared by a rule that favours no learner, and
/// claims judged for the one that it chooses.
///
/// Example: mackrl sweep results/protocol/plan-2s3z.toml; mackrl reproduce protocol results/protocol
#[derive(Debug, Clone, Args)]
pub(crate) struct ProtocolOptions {
    /// Folder of the plans; the results are written there
    #[arg(value_name = "DIR", default_value = "results/protocol")]
    pub(crate) folder: PathBuf,

    /// Folder with the run folders of a plan called plan-NAME.toml in NAME, in place of those that the plans name
    #[arg(long, value_name = "DIR")]
    pub(crate) runs: Option<PathBuf>,

    /// Take runs together that were computed by different versions of simulator or learning; the report names them
    #[arg(long, alias = "any-code")]
    pub(crate) mix: bool,

    /// Print the report as JSON instead of text
    #[arg(long)]
    pub(crate) json: bool,
}

/// The protocol's outcome.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct ProtocolReport {
    /// Where the runs come from: one entry for each experiment.
    provenance: Vec<Provenance>,
    /// The configuration that the rule chooses, once its runs are there.
    chosen: Option<String>,
    /// One for each learner under each configuration on each map.
    cells: Vec<CellReport>,
    /// For the chosen configuration first.
    verdicts: Vec<Judged>,
    /// When pairs delegate, in the runs of MACKRL on 2s3z under the chosen configuration.
    delegation: Option<Delegation>,
}

/// A cell in numbers.
#[derive(Debug, Clone, Serialize)]
struct CellReport {
    name: String,
    runs: usize,
    planned: usize,
    /// Interquartile means over runs, of each quantity that claims are about.
    averages: Vec<Average>,
    /// Runs that win less than half of their last tests.
    below_half: usize,
    levels: Levels,
    /// Seeds with the mean of each run's last tests.
    ends: Vec<(u64, f64)>,
}

#[derive(Debug, Clone, Serialize)]
struct Average {
    of: String,
    interquartile_mean: Interval,
}

/// The verdicts for one configuration.
#[derive(Debug, Clone, Serialize)]
struct Judged {
    configuration: String,
    claims: Vec<JudgedClaim>,
}

#[derive(Debug, Clone, Serialize)]
struct JudgedClaim {
    claim: String,
    source: ClaimSource,
    #[serde(flatten)]
    judgement: Judgement,
}

/// Reads the runs of all plans, judges and draws them.
///
/// # Errors
/// If there is no plan, a plan or a run cannot be read, or a file cannot be written; [`Failure::OtherVersions`].
pub(crate) fn run(options: &ProtocolOptions) -> anyhow::Result<ProtocolReport> {
    let study = Study::read(&options.folder, options.runs.as_deref())?;
    if !options.mix {
        check_versions(&study)?;
    }
    let report = ProtocolReport::new(&study);
    save(
        &options.folder,
        "protocol",
        &report,
        &chart::charts(&study, &report),
    )?;
    write(&options.folder, "report.txt", report.to_string().as_bytes())?;
    Ok(report)
}

/// The plans in a folder, in the order of their names; `runs` takes the place of the folders that they name.
fn plans(folder: &Path, runs: Option<&Path>) -> anyhow::Result<Vec<Plan>> {
    let mut paths: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with("plan-") && name.ends_with(".toml") {
            paths.push(path);
        }
    }
    paths.sort();
    if paths.is_empty() {
        return Err(Failure::usage(format!(
            "there is no plan-*.toml in {}, expected the folder of a protocol, such as results/protocol",
            folder.display()
        ))
        .into());
    }
    let plan = |path: &PathBuf| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let own = stem.strip_prefix("plan-").unwrap_or(&stem);
        let out = runs.map(|runs| runs.join(own));
        Ok(Plan::read(path, out.as_deref())?)
    };
    paths.iter().map(plan).collect()
}

fn check_versions(study: &Study) -> Result<(), Failure> {
    let mut versions: Vec<Versions> = study.runs().map(|run| run.provenance().versions).collect();
    versions.sort_unstable();
    versions.dedup();
    match *versions {
        [one, other, ..] => Err(Failure::OtherVersions { one, other }),
        _ => Ok(()),
    }
}

impl ProtocolReport {
    fn new(study: &Study) -> Self {
        let chosen = study.chosen();
        let mut configurations = study.configurations();
        configurations.sort_by_key(|configuration| chosen.as_ref() != Some(configuration));
        let claims = if study.is_of_ablations() {
            ABLATIONS
        } else {
            CLAIMS
        };
        let judged = |configuration: &String| Judged {
            configuration: configuration.clone(),
            claims: (claims.iter())
                .map(|statement| JudgedClaim {
                    claim: statement.claim.to_owned(),
                    source: statement.source,
                    judgement: statement.judge(study, configuration),
                })
                .collect(),
        };
        let mut verdicts: Vec<Judged> = configurations.iter().map(judged).collect();
        verdicts.extend(best_of_each(study, claims));
        let mackrl = (chosen.as_deref())
            .and_then(|configuration| study.cell("2s3z", ["mackrl", configuration, ""]));
        Self {
            provenance: Provenance::merged(study.runs().map(|run| run.provenance())),
            cells: study.cells.iter().map(CellReport::new).collect(),
            verdicts,
            delegation: mackrl.and_then(Delegation::of),
            chosen,
        }
    }
}

/// The verdicts on each learner under the configuration that is best for it, if there is a choice and all runs are there.
fn best_of_each(study: &Study, claims: &[Statement]) -> Option<Judged> {
    let of = |learner: &str| Some(format!("{learner} {}", study.best(learner)?.configuration));
    let names: Option<Vec<String>> = LEARNERS.into_iter().map(of).collect();
    let judged = |statement: &Statement| {
        Some(JudgedClaim {
            claim: statement.claim.to_owned(),
            source: statement.source,
            judgement: statement.judge_best(study)?,
        })
    };
    (study.configurations().len() > 1).then_some(())?;
    Some(Judged {
        configuration: format!(
            "each learner's best configuration, {}",
            names?.join(" and ")
        ),
        claims: claims.iter().filter_map(judged).collect(),
    })
}

impl CellReport {
    fn new(cell: &Cell) -> Self {
        let average = |&quantity: &Quantity| {
            let sample = cell.sample(quantity)?;
            Some(Average {
                of: quantity.to_string(),
                interquartile_mean: study::interquartile(&sample),
            })
        };
        let ends = cell.of_runs(Quantity::End);
        Self {
            name: cell.name(),
            runs: cell.runs.len(),
            planned: cell.planned,
            averages: Quantity::REPORTED.iter().filter_map(average).collect(),
            below_half: ends.iter().filter(|(_, end)| *end < 0.5).count(),
            levels: cell.levels(),
            ends,
        }
    }
}
