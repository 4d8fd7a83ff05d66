//! `mackrl sweep`: many runs from one plan.

use mackrl_run::{
    stop_request::StopRequest,
    sweep::{Entry, Outcome, Plan, State},
};
use serde::Serialize;

use super::{
    resume::{self, make_all},
    train,
};
use crate::{args::SweepArgs, failure::Failure, output, signals};

/// Makes what the plan asks for, or lists it.
pub(crate) fn run(args: &SweepArgs) -> anyhow::Result<()> {
    let plan = Plan::read(&args.plan, args.out.as_deref())?;
    if args.list {
        return list(&plan, args.json);
    }
    let stop = signals::listen()?;
    if let Some(limit) = args.time_limit {
        signals::stop_after(&stop, limit);
    }
    match args.index {
        Some(index) => one(&plan, index, args, &stop),
        None => all(&plan, args, &stop),
    }
}

/// How an entry of the plan stands.
#[derive(Debug, Serialize)]
struct Listed<'a> {
    index: usize,
    name: &'a str,
    folder: String,
    state: State,
    steps_env: u64,
    steps_env_total: u64,
    test_battle_won_mean: Option<f64>,
}

impl<'a> Listed<'a> {
    fn of((index, entry): (usize, &'a Entry)) -> anyhow::Result<Self> {
        let latest = entry.latest();
        Ok(Self {
            index,
            name: &entry.name,
            folder: entry.folder.display().to_string(),
            state: entry.state()?,
            steps_env: latest.steps_env,
            steps_env_total: entry.config.run.steps_env,
            test_battle_won_mean: latest.battle_won_mean,
        })
    }

    fn row(&self) -> Vec<String> {
        let won = |share: f64| format!("{share:.3}");
        vec![
            self.name.to_owned(),
            self.index.to_string(),
            self.state.name().to_owned(),
            format!("{}/{}", self.steps_env, self.steps_env_total),
            self.test_battle_won_mean
                .map_or_else(|| "–".to_owned(), won),
        ]
    }
}

fn list(plan: &Plan, json: bool) -> anyhow::Result<()> {
    let entries = plan.entries.iter().enumerate();
    let listed = entries
        .map(Listed::of)
        .collect::<anyhow::Result<Vec<_>>>()?;
    if json {
        return output::print_json(&listed);
    }
    let heading = ["run", "index", "state", "steps", "won"].map(str::to_owned);
    let rows = std::iter::once(heading.to_vec()).chain(listed.iter().map(Listed::row));
    output::print(&output::table(&rows.collect::<Vec<_>>()))
}

/// Makes one run in this process.
fn one(plan: &Plan, index: usize, args: &SweepArgs, stop: &StopRequest) -> anyhow::Result<()> {
    let entry = plan.entries.get(index).ok_or_else(|| Failure::Usage {
        message: format!(
            "--index {index}: the plan has {} runs, expected 0 to {}",
            plan.entries.len(),
            plan.entries.len() - 1
        ),
    })?;
    // Refuses a folder with another run, before anything is written.
    entry.state()?;
    entry.prepare()?;
    let gone_on = resume::go_on(&entry.folder, args.threads.count(), stop);
    match gone_on.map_err(resume::or_made_elsewhere)? {
        Some(summary) => train::print(&summary, args.json),
        None if args.json => output::print_json(&Listed::of((index, entry))?),
        None => Ok(()),
    }
}

/// Makes all runs, each in a process of its own.
fn all(plan: &Plan, args: &SweepArgs, stop: &StopRequest) -> anyhow::Result<()> {
    let outcome = make_all(&plan.entries, args.jobs(), stop)?;
    expect_all(&outcome, plan.entries.len())?;
    if args.json {
        return list(plan, true);
    }
    output::print(&format!(
        "{}: {} of {} runs are finished\n",
        plan.out.display(),
        outcome.finished,
        plan.entries.len()
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
