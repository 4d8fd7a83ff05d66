//! `mackrl reproduce`: the figures of the paper.

use crate::{
    args::{Figure, ReproduceArgs},
    output,
    reproduce::{Meter, figure5, figure6},
};

pub(crate) fn run(args: &ReproduceArgs) -> anyhow::Result<()> {
    match &args.figure {
        Figure::Figure5(options) => figure5(options),
        Figure::Figure6(options) => figure6(options),
    }
}

fn figure5(options: &figure5::Figure5Options) -> anyhow::Result<()> {
    let meter = Meter::new("runs");
    let report = figure5::run(options, &|done, total| meter.report(done, total))?;
    if options.json {
        output::print_json(&report)
    } else {
        output::print(&report.to_string())
    }
}

fn figure6(options: &figure6::Figure6Options) -> anyhow::Result<()> {
    let meter = Meter::new("thousand steps");
    let report = figure6::run(options, &|done, total| meter.report(done, total))?;
    if options.learning.json {
        output::print_json(&report)
    } else {
        output::print(&report.to_string())
    }
}
