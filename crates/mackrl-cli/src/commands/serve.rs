//! `mackrl serve`: runs in the browser.

use crate::{args::ServeRunsArgs, failure::Failure, serve};

/// Serves the runs until the program is stopped.
pub(crate) fn run(args: &ServeRunsArgs) -> anyhow::Result<()> {
    if let Some(folder) = args.folders.iter().find(|folder| !folder.is_dir()) {
        let message = format!(
            "{} is no folder, expected runs or a folder of runs",
            folder.display()
        );
        return Err(Failure::Usage { message }.into());
    }
    serve::serve(&args.folders, args.port)
}
