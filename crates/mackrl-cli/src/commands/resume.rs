//! `mackrl resume`: an interrupted run goes on.

use std::{
    io::{self, Write},
    path::Path,
};

use mackrl_run::training::Trainer;

use crate::{
    args::ResumeArgs,
    commands::sc2,
    failure::printable,
    provenance::CODE,
    run_folder::{Resumption, RunFolder},
    signals::StopRequest,
    training_loop::{self, Reporting, Summary},
};

/// Continues a run at its latest checkpoint; from then on it is as if it had never stopped.
pub(crate) fn run(args: &ResumeArgs) -> anyhow::Result<()> {
    let stop = StopRequest::listen()?;
    if args.leashed {
        stop.make_when_stdin_ends();
    }
    match go_on(&args.run, args.threads.count(), &stop)? {
        Some(summary) => training_loop::print(&summary, args.json),
        None => Ok(()),
    }
}

/// Continues the run at `path` to its end; gives nothing if it is there already.
///
/// # Errors
/// [`crate::failure::Failure::Interrupted`] when asked to stop; otherwise what went wrong.
pub(crate) fn go_on(
    path: &Path,
    threads: usize,
    stop: &StopRequest,
) -> anyhow::Result<Option<Summary>> {
    if RunFolder::is_finished(path) {
        // Nothing is wrong: whoever starts runs again until they are finished gets what they want.
        let folder = path.display();
        let _ = writeln!(io::stderr(), "{folder} is finished: nothing is left to do");
        return Ok(None);
    }
    let Resumption {
        mut folder,
        config,
        checkpoint,
        damaged,
        earlier_code,
    } = RunFolder::resume(path, threads)?;
    for damage in damaged {
        // The run continues from an earlier checkpoint, whether anybody reads this or not.
        let _ = writeln!(
            io::stderr(),
            "warning: {}; an earlier one is used",
            printable(&damage)
        );
    }
    if let Some(code) = earlier_code {
        let _ = writeln!(
            io::stderr(),
            "warning: the run was made by code {} and goes on with {CODE}: it may not be what either of them makes alone",
            printable(&code)
        );
    }
    let world = sc2::world(&config)?;
    let trainer = match checkpoint {
        Some(checkpoint) => Trainer::resumed(&config, &world, threads, &checkpoint)?,
        None => Trainer::in_world(&config, &world, threads)?,
    };
    let mut training = Reporting::new(trainer, &config, stop);
    training_loop::train_into(&mut folder, &mut training, &config, stop).map(Some)
}
