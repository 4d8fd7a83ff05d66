//! `mackrl reproduce`: the figures of the paper and of this project.

use std::fmt::Display;

use serde::Serialize;

use crate::{
    args::{Figure, ReproduceArgs},
    output,
    progress::Meter,
    reproduce::{
        ablations, all, calibration,
        comparison::{Comparison, ComparisonOptions},
        figure4_neurips, figure5, figure6, figure7, ppo, protocol, zoo,
    },
    signals,
};

pub(crate) fn run(args: &ReproduceArgs) -> anyhow::Result<()> {
    let (figure, options, map) = match &args.figure {
        Figure::Figure5(options) => return figure5(options),
        Figure::Figure6(options) => (&figure6::FIGURE, &options.learning, None),
        Figure::Figure7(options) => (&figure7::FIGURE, &options.learning, None),
        Figure::Ablations(options) => (&ablations::FIGURE, &options.learning, Some(&*options.map)),
        Figure::Ppo(options) => return compare(&ppo::COMPARISON, &options.comparison),
        Figure::Neurips(options) => {
            return compare(&figure4_neurips::COMPARISON, &options.comparison);
        }
        Figure::Calibration(options) => {
            return compare(&calibration::COMPARISON, &options.comparison);
        }
        Figure::Zoo(options) => return print(&zoo::run(options)?, options.json),
        Figure::Protocol(options) => return print(&protocol::run(options)?, options.json),
        Figure::All(options) => return print(&all::run(options)?, options.learning.json),
    };
    print(&figure.run(options, map)?, options.json)
}

fn compare(comparison: &Comparison, options: &ComparisonOptions) -> anyhow::Result<()> {
    print(&comparison.run(options)?, options.json)
}

fn figure5(options: &figure5::Figure5Options) -> anyhow::Result<()> {
    let (meter, stop) = (Meter::new("runs"), signals::listen()?);
    let report = figure5::run(options, &|done, total| {
        signals::end_if_asked(&stop, "figure 5");
        meter.report(done, total);
    })?;
    print(&report, options.json)
}

/// Prints a report as it reads, or as data.
fn print(report: &(impl Serialize + Display), json: bool) -> anyhow::Result<()> {
    if json {
        output::print_json(report)
    } else {
        output::print(&report.to_string())
    }
}
