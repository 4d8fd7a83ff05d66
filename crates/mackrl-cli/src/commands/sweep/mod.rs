//! `mackrl sweep`: many runs from one plan.

mod calibration;
mod slurm;

use std::path::PathBuf;

use mackrl_run::{
    run_folder::Holder,
    stop_request::StopRequest,
    sweep::{Entry, Outcome, Plan, Standing, State, standings},
};
use serde::Serialize;

use super::{
    resume::{self, make_all},
    train,
};
use crate::{args::SweepArgs, failure::Failure, output, signals};

/// An entry of the plan, by its number.
type Numbered<'a> = (usize, &'a Entry);

/// Makes what the plan asks for, or lists it.
pub(crate) fn run(args: &SweepArgs) -> anyhow::Result<()> {
    let plan = Plan::read(&args.plan, args.out.as_deref())?;
    let chosen = chosen(&plan, args)?;
    if args.list {
        return list(&chosen, args.json);
    }
    let stop = signals::listen()?;
    if args.leashed {
        signals::stop_when_stdin_ends(&stop);
    }
    if args.slurm {
        return slurm::print(&plan, &chosen, args, &stop);
    }
    if let Some(limit) = args.time_limit {
        signals::stop_after(&stop, limit);
    }
    match chosen[..] {
        [(index, entry)] if !args.has_processes() => one(index, entry, args, &stop),
        _ => all(&plan, &chosen, args, &stop),
    }
}

/// The entries that the command is about.
fn chosen<'a>(plan: &'a Plan, args: &SweepArgs) -> anyhow::Result<Vec<Numbered<'a>>> {
    let mut chosen: Vec<Numbered<'a>> = plan.entries.iter().enumerate().collect();
    if let Some(index) = args.index {
        let block = args.block.map_or(1, std::num::NonZeroUsize::get);
        let blocks = chosen.len().div_ceil(block);
        if index >= blocks {
            let of = match args.block {
                Some(block) => format!(", {blocks} blocks of {block}"),
                None => String::new(),
            };
            return Err(Failure::usage(format!(
                "--index {index}: the plan has {} runs{of}, expected 0 to {}",
                chosen.len(),
                blocks - 1
            ))
            .into());
        }
        chosen = (chosen.into_iter().skip(index * block))
            .take(block)
            .collect();
    }
    if args.retry.is_some() {
        let states = standings(chosen.iter().map(|(_, entry)| *entry));
        let both = chosen.into_iter().zip(states);
        chosen = both
            .filter_map(|(entry, standing)| match standing {
                Ok(standing) if standing.state != State::Failed => None,
                Ok(_) => Some(Ok(entry)),
                Err(error) => Some(Err(error)),
            })
            .collect::<Result<_, _>>()?;
    }
    Ok(chosen)
}

/// How an entry of the plan stands.
#[derive(Debug, Serialize)]
struct Listed<'a> {
    index: usize,
    name: &'a str,
    folder: String,
    state: State,
    /// Of a running one, the process that makes it.
    r#where: Option<Holder>,
    /// Of a failed one, why.
    failure: Option<String>,
    /// Of one that has begun and is not finished, its latest checkpoint.
    checkpoint: Option<PathBuf>,
    steps_env: u64,
    steps_env_total: u64,
    test_battle_won_mean: Option<f64>,
}

impl<'a> Listed<'a> {
    fn of((index, entry): Numbered<'a>, standing: Standing) -> Self {
        let latest = entry.latest();
        let is_begun = !matches!(standing.state, State::Waiting | State::Finished);
        Self {
            index,
            name: &entry.name,
            folder: entry.folder.display().to_string(),
            state: standing.state,
            r#where: standing.holder,
            failure: standing.failure,
            checkpoint: is_begun.then(|| entry.checkpoint()).flatten(),
            steps_env: latest.steps_env,
            steps_env_total: entry.config.run.steps_env,
            test_battle_won_mean: latest.battle_won_mean,
        }
    }

    fn row(&self) -> Vec<String> {
        let won = |share: f64| format!("{share:.3}");
        let mut row = vec![
            self.name.to_owned(),
            self.index.to_string(),
            self.state.name().to_owned(),
            format!("{}/{}", self.steps_env, self.steps_env_total),
            self.test_battle_won_mean
                .map_or_else(|| "–".to_owned(), won),
        ];
        let holder = self.r#where.as_ref().map(Holder::to_string);
        row.extend(holder.or_else(|| self.failure.clone()));
        row
    }
}

fn list(chosen: &[Numbered<'_>], json: bool) -> anyhow::Result<()> {
    let states = standings(chosen.iter().map(|(_, entry)| *entry));
    let both = chosen.iter().zip(states);
    let listed = both
        .map(|(entry, standing)| Ok(Listed::of(*entry, standing?)))
        .collect::<anyhow::Result<Vec<_>>>()?;
    if json {
        return output::print_json(&listed);
    }
    let heading = ["run", "index", "state", "steps", "won", "where, or why"].map(str::to_owned);
    let rows = std::iter::once(heading.to_vec()).chain(listed.iter().map(Listed::row));
    output::print(&output::table(&rows.collect::<Vec<_>>()))
}

/// Makes one run in this process.
fn one(index: usize, entry: &Entry, args: &SweepArgs, stop: &StopRequest) -> anyhow::Result<()> {
    // Refuses a folder with another run, before anything is written.
    entry.state()?;
    entry.prepare()?;
    let gone_on = resume::go_on(&entry.folder, args.threads.count(), stop);
    match gone_on.map_err(resume::or_made_elsewhere)? {
        Some(summary) => train::print(&summary, args.json),
        None if args.json => list(&[(index, entry)], true),
        None => Ok(()),
    }
}

/// Makes runs, each in a process of its own.
fn all(
    plan: &Plan,
    chosen: &[Numbered<'_>],
    args: &SweepArgs,
    stop: &StopRequest,
) -> anyhow::Result<()> {
    let entries: Vec<Entry> = chosen.iter().map(|(_, entry)| (*entry).clone()).collect();
    let outcome = make_all(&entries, args.jobs(), args.scratch.as_deref(), stop)?;
    expect_all(&outcome, entries.len())?;
    if args.json {
        return list(chosen, true);
    }
    output::print(&format!(
        "{}: {} of {} runs are finished\n",
        plan.out.display(),
        outcome.finished,
        entries.len()
    ))
}

/// Refuses an outcome in which some of all `runs` did not reach their end, with the reasons.
pub(crate) fn expect_all(outcome: &Outcome, runs: usize) -> anyhow::Result<()> {
    let told = |named: &[(String, String)]| -> String {
        let reasons = named
            .iter()
            .map(|(name, reason)| format!("{name}: {reason}"));
        reasons.collect::<Vec<_>>().join("; ")
    };
    let Outcome {
        failed, stopped, ..
    } = outcome;
    if !failed.is_empty() {
        let reasons = told(failed);
        let message = format!("{} of {runs} runs failed: {reasons}", failed.len());
        return Err(if outcome.failed_by_system == failed.len() {
            Failure::RunsWithoutSystem { message }.into()
        } else {
            Failure::BadData { message }.into()
        });
    }
    if !stopped.is_empty() {
        let reasons = told(stopped);
        let message = format!("{} of {runs} runs were stopped: {reasons}", stopped.len());
        return Err(Failure::RunsStopped { message }.into());
    }
    Ok(())
}
