//! `mackrl reproduce`: the figures of the paper.

use std::fmt::Display;

use serde::Serialize;

use crate::{
    args::{Figure, ReproduceArgs},
    output,
    reproduce::{Meter, figure5, figure6, figure7},
};

pub(crate) fn run(args: &ReproduceArgs) -> anyhow::Result<()> {
    match &args.figure {
        Figure::Figure5(options) => figure5(options),
        Figure::Figure6(options) => figure6(options),
        Figure::Figure7(options) => figure7(options),
    }
}

fn figure5(options: &figure5::Figure5Options) -> anyhow::Result<()> {
    let meter = Meter::new("runs");
    let report = figure5::run(options, &|done, total| meter.report(done, total))?;
    print(&report, options.json)
}

fn figure6(options: &figure6::Figure6Options) -> anyhow::Result<()> {
    let meter = Meter::new("thousand steps");
    let report = figure6::run(options, &|done, total| meter.report(done, total))?;
    print(&report, options.learning.json)
}

fn figure7(options: &figure7::Figure7Options) -> anyhow::Result<()> {
    let meter = Meter::new("thousand steps");
    let report = figure7::run(options, &|done, total| meter.report(done, total))?;
    print(&report, options.learning.json)
}

/// Prints a report as it reads, or as data.
fn print(report: &(impl Serialize + Display), json: bool) -> anyhow::Result<()> {
    if json {
        output::print_json(report)
    } else {
        output::print(&report.to_string())
    }
}
