//! `mackrl bench`: how fast this machine is.

mod environment;
mod train;
mod update;

use crate::{
    args::{BenchArgs, BenchCommand},
    output,
};

pub(crate) fn run(args: &BenchArgs) -> anyhow::Result<()> {
    match &args.command {
        BenchCommand::Env(args) => environment::run(args),
        BenchCommand::Update(args) => update::run(args),
        BenchCommand::Train(args) => train::run(args),
    }
}

/// Prints rows of a name and a value.
fn print_rows(rows: &[(&str, String)]) -> anyhow::Result<()> {
    let rows: Vec<Vec<String>> = rows
        .iter()
        .map(|(name, value)| vec![(*name).to_owned(), value.clone()])
        .collect();
    output::print(&output::table(&rows))
}
