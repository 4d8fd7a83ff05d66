//! The `mackrl` program.

mod plot;
mod reproduce;

use std::io::Write as _;

use clap::Parser;

use reproduce::{Meter, figure5};

#[derive(Parser)]
enum Command {
    #[command(subcommand)]
    Reproduce(Figure),
}

#[derive(clap::Subcommand)]
enum Figure {
    Figure5(figure5::Figure5Options),
}

fn main() -> anyhow::Result<()> {
    let Command::Reproduce(Figure::Figure5(options)) = Command::parse();
    let meter = Meter::new("runs");
    let report = figure5::run(&options, &|done, total| meter.report(done, total))?;
    let text = if options.json {
        serde_json::to_string_pretty(&report)? + "\n"
    } else {
        report.to_string()
    };
    std::io::stdout().write_all(text.as_bytes())?;
    Ok(())
}
