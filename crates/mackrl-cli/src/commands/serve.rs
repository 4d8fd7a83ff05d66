//! `mackrl serve`: runs in the browser.

use crate::{args::ServeRunsArgs, failure::Failure};

/// Serves the runs that were named until the program is stopped.
#[cfg(feature = "serve")]
pub(crate) fn run(args: &ServeRunsArgs) -> anyhow::Result<()> {
    check(args)?;
    crate::serve::serve(&args.folders, args.port)
}

/// Says that this program cannot.
#[cfg(not(feature = "serve"))]
pub(crate) fn run(args: &ServeRunsArgs) -> anyhow::Result<()> {
    check(args)?;
    let message = "this program was built without its web server (feature `serve`)";
    Err(Failure::usage(message).into())
}

/// Refuses what is no folder.
fn check(args: &ServeRunsArgs) -> Result<(), Failure> {
    match args.folders.iter().find(|folder| !folder.is_dir()) {
        None => Ok(()),
        Some(folder) => Err(Failure::usage(format!(
            "{} is no folder, expected runs or a folder of runs",
            folder.display()
        ))),
    }
}
