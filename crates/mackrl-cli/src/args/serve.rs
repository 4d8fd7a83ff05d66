//! The command that shows runs in the browser.

use std::path::PathBuf;

use clap::Args;

/// Show runs in the browser, on this machine alone, updating as they go
///
/// Prints the address, with a token without which nothing is given out. The page draws all metrics, seeds of one setting as mean
/// and band, lists the settings that differ, and links replays. Runs are found at any depth, and those that `mackrl reproduce`
/// recorded as well. Only 127.0.0.1 is listened on, and run folders are only read. Ctrl-C ends it.
///
/// Example: mackrl serve runs
#[derive(Debug, Args)]
pub(crate) struct ServeRunsArgs {
    /// Run folders, or folders of run folders
    #[arg(value_name = "DIR", required = true)]
    pub(crate) folders: Vec<PathBuf>,

    /// Port to listen on; 0 takes any that is free
    #[arg(long, value_name = "PORT", default_value = "8731")]
    pub(crate) port: u16,
}
