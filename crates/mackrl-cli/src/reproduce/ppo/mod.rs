//! `mackrl reproduce ppo`: MACKRL-PPO beside MAPPO and IPPO, on many maps.
//!
//! Which runs there are says a plan, as `mackrl sweep` reads it, so the comparison is a file that can be read, changed and made on
//! a cluster. What the figure needs of a finished run is kept beside it in a small file; from these it is drawn again without any
//! training. It is drawn from what there is: the plan begins with the first seed of everything, and the table says of how many
//! runs each number is.

mod chart;
mod report;
mod runs;
mod table;

use std::{num::NonZeroUsize, path::PathBuf};

use clap::Args;
use mackrl_run::sweep::Plan;

use super::{make_folder, page, save};
use crate::{
    commands::{resume::make_all, sweep::expect_all},
    failure::Failure,
    signals,
};
pub(crate) use report::Report;

/// Name of its files.
const NAME: &str = "ppo";
/// The page beside them, in which the table stands between marks called after them.
const PAGE: &str = "README.md";

/// Compare MACKRL-PPO with MAPPO and IPPO on many maps: one table, curves, and claims with verdicts
///
/// Makes the runs of a plan as `mackrl sweep` does: finished ones are kept, unfinished ones go on, so the command can be stopped
/// and given again. What the comparison needs of each finished run is kept in the folder of the results, and the comparison is
/// drawn from that: --as-it-stands draws it again and makes no run.
///
/// Writes ppo.json, ppo.svg and ppo.png, and fills the table into README.md between `<!-- ppo: begin -->` and
/// `<!-- ppo: end -->`, if it is there. For each learner on each map: how many runs, the battles that they win at the end as
/// mean with standard error and as interquartile mean with a 95 % bootstrap interval, environment steps until 70 and 90 % are won
/// (median over runs, and how many runs get there), what the best weights win in battles that neither training nor tests have
/// seen, and minutes on one thread. Each claim is judged by a rule that stands beside it; one for which there are too few
/// runs is not judged.
///
/// Examples: mackrl reproduce ppo --jobs 2; mackrl reproduce ppo --as-it-stands
#[derive(Debug, Clone, Args)]
pub(crate) struct PpoOptions {
    /// Plan of the runs
    #[arg(long, value_name = "FILE", default_value = "results/ppo/plan.toml")]
    plan: PathBuf,

    /// Folder for the figure, its data, and what is kept of finished runs
    #[arg(long, value_name = "DIR", default_value = "results/ppo")]
    out: PathBuf,

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

/// Makes the runs that are not there, unless the comparison is to be drawn as it stands, and writes it.
///
/// # Errors
/// If the plan cannot be read, if no run is finished, if a run fails (after the comparison is written), or if a file cannot be
/// written.
pub(crate) fn run(options: &PpoOptions) -> anyhow::Result<Report> {
    let plan = Plan::read(&options.plan, options.runs.as_deref())?;
    make_folder(&options.out)?;
    let missing = runs::missing(&plan.entries, &options.out);
    let outcome = if options.as_it_stands {
        None
    } else {
        let processors = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        let jobs = options.jobs.unwrap_or_else(processors);
        Some(make_all(&missing, jobs, None, &signals::listen()?)?)
    };
    runs::keep_finished(&missing, &options.out)?;
    let cells = runs::cells(&plan.entries, &options.out);
    if cells.iter().all(|cell| cell.runs.is_empty()) {
        let message = format!("no run of {} is finished", options.plan.display());
        return Err(Failure::Usage { message }.into());
    }
    let report = Report::new(&cells);
    save(
        &options.out,
        NAME,
        &report,
        &[(NAME.to_owned(), report.chart())],
    )?;
    let readme = options.out.join(PAGE);
    if readme.exists() {
        page::fill(&readme, NAME, &report.markdown())?;
    }
    if let Some(outcome) = outcome {
        expect_all(&outcome, missing.len())?;
    }
    Ok(report)
}
