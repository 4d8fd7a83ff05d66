//! `mackrl resume`: an interrupted run goes on.

use std::io::{self, Write};

use mackrl::training::Trainer;

use crate::{
    args::ResumeArgs,
    commands::sc2,
    provenance::CODE,
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
        earlier_code,
    } = RunFolder::resume(&args.run, threads)?;
    for damage in damaged {
        // The run continues from an earlier checkpoint, whether anybody reads this or not.
        let _ = writeln!(io::stderr(), "warning: {damage}; an earlier one is used");
    }
    if let Some(code) = earlier_code {
        let _ = writeln!(
            io::stderr(),
            "warning: the run was made by code {code} and goes on with {CODE}: it may not be what either of them makes alone"
        );
    }
    let mut trainer = Trainer::in_world(&config, &sc2::world(&config)?, threads)?;
    if let Some(checkpoint) = checkpoint {
        trainer.restore(&checkpoint)?;
    }
    let mut training = Reporting::new(trainer, &config);
    let summary = training_loop::train_into(&mut folder, &mut training, &config, &stop)?;
    training_loop::print(&summary, args.json)
}
