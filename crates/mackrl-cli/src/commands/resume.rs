//! `mackrl resume`: an interrupted run goes on.

use std::{
    io::{self, Write},
    num::NonZeroUsize,
    path::Path,
    process::Command,
};

use mackrl_run::{
    RunError,
    run_folder::{self, Extension},
    stop_request::StopRequest,
    sweep::{self, Entry, Making, Outcome},
    training_loop::{self, Summary},
};

use super::train::print;
use crate::{
    args::ResumeArgs,
    commands::{sc2, this_program},
    failure::{Failure, printable},
    progress::{RunProgress, SweepProgress},
    signals,
};

/// Continues a run at its latest checkpoint; from then on it is as if it had never stopped.
pub(crate) fn run(args: &ResumeArgs) -> anyhow::Result<()> {
    let stop = signals::listen()?;
    if args.leashed {
        signals::stop_when_stdin_ends(&stop);
    }
    if let Some(steps) = args.steps {
        extend(&args.run, steps)?;
    }
    let gone_on = go_on(&args.run, args.threads.count(), &stop);
    let gone_on = match gone_on {
        Err(error) if args.leashed => return Err(or_made_elsewhere(error)),
        gone_on => gone_on?,
    };
    match gone_on {
        Some(summary) => print(&summary, args.json),
        None => Ok(()),
    }
}

/// Plans the run at `path` for `steps` environment steps, and says where it goes on.
fn extend(path: &Path, steps: u64) -> Result<(), RunError> {
    let Some(Extension { planned, from }) = run_folder::extend(path, steps)? else {
        return Ok(());
    };
    let folder = printable(&path.display().to_string());
    let place = match from {
        0 => "begins again, since it has no checkpoint from before its end".to_owned(),
        from => format!("goes on from step {from}, its latest checkpoint before that end"),
    };
    let _ = writeln!(
        io::stderr(),
        "{folder} was planned for {planned} environment steps and is now for {steps}: it {place}"
    );
    Ok(())
}

/// Continues the run at `path` to its end; gives nothing if it is there already.
pub(super) fn go_on(
    path: &Path,
    threads: usize,
    stop: &StopRequest,
) -> Result<Option<Summary>, RunError> {
    let mut progress = RunProgress::new();
    let summary = training_loop::resume(path, sc2::world, threads, stop, &mut progress)?;
    if summary.is_none() {
        // Nothing is wrong: starting runs again until they are finished is one way to make them.
        let folder = printable(&path.display().to_string());
        let _ = writeln!(io::stderr(), "{folder} is finished: nothing is left to do");
    }
    Ok(summary)
}

/// The error of one run of many; that another process makes it is none.
pub(super) fn or_made_elsewhere(error: RunError) -> anyhow::Error {
    match error {
        error @ RunError::FolderLocked { .. } => Failure::MadeElsewhere {
            message: error.to_string(),
        }
        .into(),
        error => error.into(),
    }
}

/// Makes all runs that are not finished, `jobs` at a time, each in a process that resumes it, in `scratch` if that is given, and
/// shows how they stand.
pub(crate) fn make_all(
    entries: &[Entry],
    jobs: NonZeroUsize,
    scratch: Option<&Path>,
    stop: &StopRequest,
) -> anyhow::Result<Outcome> {
    let program = this_program()?;
    let process = |folder: &Path| {
        let mut command = Command::new(&program);
        command
            .args(["resume", "--threads", "1", "--leashed"])
            .arg(folder);
        command
    };
    let making = Making {
        jobs,
        process: &process,
        scratch,
    };
    let mut progress = SweepProgress::new();
    Ok(sweep::make_all(entries, &making, stop, &mut progress)?)
}
