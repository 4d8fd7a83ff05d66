//! The `mackrl` program: train, evaluate, certify and reproduce.
//!
//! This crate holds no algorithm. `args` is what was typed, `commands` what it means, `reproduce` one command for each figure
//! of the paper, `plot` the drawing of its results, `replay` the looking into recorded episodes, `serve` runs in the browser;
//! runs themselves, on disk and side by side, are `mackrl_run`'s.
//! `progress` is what a person sees while waiting, `words` how a result reads, `signals` how a person stops waiting, `failure` the one place that turns errors into exit codes. Data go to stdout, everything else to stderr.

mod args;
mod commands;
mod failure;
mod isolation;
mod output;
mod plot;
mod progress;
mod replay;
mod reproduce;
#[cfg(feature = "serve")]
mod serve;
mod signals;
mod words;

use std::process::ExitCode;

use clap::Parser;
use mackrl::nn::InstructionSet;
use mackrl_run::config::Registry;
pub(crate) use mackrl_run::config::registry;

use crate::args::{Cli, Command};

/// The whole program, offering the worlds and algorithms of `registry`: parses the command line and gives the exit code.
///
/// A program with a world or an algorithm of its own has every command on it with one line:
///
/// ```no_run
/// use std::{process::ExitCode, sync::Arc};
///
/// use mackrl_env::sanity::{Remember, RememberSettings};
/// use mackrl_env::DeclaredKind;
/// use mackrl_run::config::Registry;
///
/// fn main() -> ExitCode {
///     let own = DeclaredKind::new("own", "say again what was shown", |settings: RememberSettings| {
///         Ok(Remember::new(settings))
///     });
///     mackrl_cli::run(Registry::built_in().with_world(Arc::new(own)))
/// }
/// ```
#[must_use]
pub fn run(registry: Registry) -> ExitCode {
    if registry.install().is_err() {
        return failure::report(Err(failure::Failure::Usage {
            message: "the program was started a second time in one process".to_owned(),
        }
        .into()));
    }
    if let Err(error) = InstructionSet::chosen() {
        return failure::report(Err(error.into()));
    }
    let outcome = match Cli::parse().command {
        Command::Train(args) => commands::train::run(&args),
        Command::Resume(args) => commands::resume::run(&args),
        Command::Evaluate(args) => commands::evaluate::run(&args),
        Command::Certify(args) => commands::certify::run(&args),
        Command::ExecuteAgent => commands::execute_agent::run(),
        Command::Sweep(args) => commands::sweep::run(&args),
        Command::Plot(args) => commands::plot::run(&args),
        Command::Report(args) => commands::report::run(&args),
        Command::Reproduce(args) => commands::reproduce::run(&args),
        Command::Play(args) => commands::play::run(&args),
        Command::Fidelity(args) => commands::fidelity::run(&args),
        Command::Replay(args) => commands::replay::run(&args),
        Command::Explain(args) => commands::explain::run(&args),
        Command::Serve(args) => commands::serve::run(&args),
        Command::Maps(args) => commands::maps::run(&args),
        Command::Diff(args) => commands::diff::run(&args),
        Command::Config(args) => commands::config::run(&args),
        Command::Bench(args) => commands::bench::run(&args),
        Command::Sc2(args) => commands::sc2::run(&args),
        Command::Completions(args) => commands::shell::completions(&args),
        Command::Man(args) => commands::shell::man(&args),
    };
    failure::report(outcome)
}
