//! `mackrl resume`: an interrupted run goes on.

use std::io::{self, Write};

use mackrl::training::Trainer;

use crate::{
    args::ResumeArgs,
    commands::sc2,
    failure::printable,
    run_folder::{Resumption, RunFolder},
    signals::StopRequest,
    training_loop::{self, Reporting},
};

/// Continues a run at its latest checkpoint; from then on it is as if it had never stopped.
pub(crate) fn run(args: &ResumeArgs) -> anyhow::Result<()> {
    if RunFolder::is_finished(&args.run) {
        // Nothing is wrong: whoever starts runs again until they are finished gets what they want.
        let folder = args.run.display();
        let _ = writeln!(io::stderr(), "{folder} is finished: nothing is left to do");
        return Ok(());
    }
    let stop = StopRequest::listen()?;
    let threads = args.threads.count();
    let Resumption {
        mut folder,
        config,
        checkpoint,
        damaged,
    } = RunFolder::resume(&args.run, threads)?;
    for damage in damaged {
        // The run continues from an earlier checkpoint, whether anybody reads this or not.
        let _ = writeln!(
            io::stderr(),
            "warning: {}; an earlier one is used",
            printable(&damage)
        );
    }
    let world = sc2::world(&config)?;
    let trainer = match checkpoint {
        Some(checkpoint) => Trainer::resumed(&config, &world, threads, &checkpoint)?,
        None => Trainer::in_world(&config, &world, threads)?,
    };
    let mut training = Reporting::new(trainer, &config, &stop);
    let summary = training_loop::train_into(&mut folder, &mut training, &config, &stop)?;
    training_loop::print(&summary, args.json)
}
