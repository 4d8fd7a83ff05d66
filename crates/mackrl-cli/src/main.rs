//! The program `mackrl`, with everything that is built in.

use std::process::ExitCode;

use mackrl_run::config::Registry;

fn main() -> ExitCode {
    mackrl_cli::run(Registry::built_in())
}
