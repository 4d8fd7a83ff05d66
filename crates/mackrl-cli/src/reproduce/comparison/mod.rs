//! Learners beside each other on many maps, as data.
//!
//! A [`Comparison`] says which plans have its runs, what others recorded, and what is claimed. Plans are read as `mackrl sweep` reads
//! them, so a comparison is files that can be read, changed and made on a cluster. What is needed of a finished run is kept beside
//! the results in a small file; from these a comparison is drawn again without any training. It is drawn from what there is, and its
//! table says of how many runs each number is.

mod chart;
mod claims;
mod report;
mod runs;
mod table;

use std::{
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

use clap::Args;
use mackrl_run::sweep::{Entry, Plan};

use self::runs::Cell;
use super::{Claim, make_folder, page, save};
use crate::{
    commands::{resume::make_all, sweep::expect_all},
    failure::Failure,
    signals,
};
pub(crate) use claims::{Maps, Rule, Score, Statement};
pub(crate) use report::Report;

/// The page beside the results, in which the table stands between marks called after the comparison.
const PAGE: &str = "README.md";

/// A comparison of learners.
#[derive(Debug)]
pub(crate) struct Comparison {
    /// Its command, with which the names of its files begin.
    pub(crate) name: &'static str,
    /// Plans of its runs, unless others are asked for.
    pub(crate) plans: &'static [&'static str],
    /// Above its chart.
    pub(crate) title: &'static str,
    /// Below the title.
    pub(crate) subtitle: &'static str,
    /// What others recorded.
    pub(crate) recorded: &'static [Recorded],
    /// What is claimed.
    pub(crate) claims: &'static [Statement],
}

/// What others recorded of a learner on a map.
#[derive(Debug)]
pub(crate) struct Recorded {
    pub(crate) map: &'static str,
    pub(crate) learner: &'static str,
    /// Millions of environment steps, ascending.
    pub(crate) millions: &'static [f64],
    /// Share of battles won after each.
    pub(crate) won: &'static [f64],
}

/// What all comparisons take.
#[derive(Debug, Clone, Args)]
pub(crate) struct ComparisonOptions {
    /// Plan of the runs, in place of the comparison's own; repeatable
    #[arg(long, value_name = "FILE")]
    plan: Vec<PathBuf>,

    /// Folder for the figure, its data, and what is kept of finished runs [default: that of the plan]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Folder of the run folders [default: the plan's `out`]
    #[arg(long, value_name = "DIR")]
    runs: Option<PathBuf>,

    /// Draw what is finished, and make no run
    #[arg(long)]
    as_it_stands: bool,

    /// Runs side by side, each on one thread; changes no result [default: one for each processor]
    #[arg(long, value_name = "K", value_parser = crate::args::side_by_side, conflicts_with = "as_it_stands")]
    jobs: Option<NonZeroUsize>,

    /// Print JSON instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}

impl Comparison {
    /// Makes the runs that are not there, unless the comparison is to be drawn as it stands, and writes it.
    ///
    /// # Errors
    /// If a plan cannot be read, if there is nothing to show, if a run fails (after the comparison is written), or if a file cannot be
    /// written.
    pub(crate) fn run(&self, options: &ComparisonOptions) -> anyhow::Result<Report> {
        let own = || self.plans.iter().map(PathBuf::from).collect();
        let plans = match &options.plan[..] {
            [] => own(),
            plans => plans.to_vec(),
        };
        let mut entries: Vec<Entry> = Vec::new();
        for plan in &plans {
            entries.extend(Plan::read(plan, options.runs.as_deref())?.entries);
        }
        let beside = plans.first().and_then(|plan| plan.parent());
        let out = options.out.as_deref().or(beside).unwrap_or(Path::new("."));
        make_folder(out)?;
        let missing = runs::missing(&entries, out);
        let outcome = if options.as_it_stands {
            None
        } else {
            let processors = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
            let jobs = options.jobs.unwrap_or_else(processors);
            Some(make_all(&missing, jobs, None, &signals::listen()?)?)
        };
        runs::keep_finished(&missing, out)?;
        let cells = runs::cells(&entries, out);
        // What others recorded is worth a table without any run.
        if self.recorded.is_empty() && cells.iter().all(|cell| cell.runs.is_empty()) {
            let plans: Vec<String> = plans
                .iter()
                .map(|plan| plan.display().to_string())
                .collect();
            let message = format!("no run of {} is finished", plans.join(" and "));
            return Err(Failure::Usage { message }.into());
        }
        let report = Report::new(self, &cells);
        let charts = [(self.name.to_owned(), report.chart(self))];
        save(out, self.name, &report, &charts)?;
        let readme = out.join(PAGE);
        if readme.exists() {
            page::fill(&readme, self.name, &report.markdown())?;
        }
        if let Some(outcome) = outcome {
            expect_all(&outcome, missing.len())?;
        }
        Ok(report)
    }

    /// The verdicts.
    fn judge(&self, cells: &[Cell]) -> Vec<Claim> {
        let claims = self.claims.iter();
        claims.map(|statement| statement.judge(cells)).collect()
    }

    /// What others recorded of a learner on a map.
    fn recorded_of(&self, map: &str, learner: &str) -> Option<&Recorded> {
        let mut recorded = self.recorded.iter();
        recorded.find(|recorded| recorded.map == map && recorded.learner == learner)
    }
}

impl Recorded {
    /// Environment steps, and the share of battles won there.
    fn points(&self) -> impl Iterator<Item = (u64, f64)> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few millions"
        )]
        let steps = self
            .millions
            .iter()
            .map(|millions| (millions * 1e6).round() as u64);
        steps.zip(self.won.iter().copied())
    }
}
