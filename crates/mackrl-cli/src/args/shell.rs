//! The commands that make this program at home in a shell.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

/// Print a script with which a shell completes commands and flags
///
/// Examples: mackrl completions bash > ~/.local/share/bash-completion/completions/mackrl;
/// mackrl completions zsh > ~/.zfunc/_mackrl; mackrl completions fish > ~/.config/fish/completions/mackrl.fish
#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// Shell to write for
    #[arg(value_name = "SHELL")]
    pub(crate) shell: Shell,
}

/// Print the manual page, or write those of all commands into a folder
///
/// Examples: mackrl man | man -l -; mackrl man ~/.local/share/man/man1
#[derive(Debug, Args)]
pub(crate) struct ManArgs {
    /// Folder for mackrl.1, mackrl-train.1 and so on; made if it is not there
    #[arg(value_name = "DIR")]
    pub(crate) folder: Option<PathBuf>,
}
