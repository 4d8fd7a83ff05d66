//! The ablations as a chart: a curve for each variant.

use super::AblationReport;
use crate::plot::{Axis, Colour, Corner, LineChart, Mark, Point, Series};

/// The chart of `report`. Only MACKRL has a band: nine of them would hide each other, and the table has every error.
pub(super) fn chart(report: &AblationReport) -> LineChart {
    let range = Some([-0.02, 1.02]);
    let series: Vec<Series> = (report.variants.iter().zip(Colour::LINES))
        .enumerate()
        .map(|(number, (variant, colour))| {
            let tests = (variant.curve.mean.iter().zip(&variant.curve.sem)).zip(&report.steps);
            let point = |((&mean, &error), &step): ((&f64, &f64), &u64)| match number {
                0 => Point::with_error(step as f64, mean, error),
                _ => Point::exact(step as f64, mean),
            };
            Series {
                name: Some(format!("{} ({})", variant.label, variant.curve.runs)),
                colour,
                mark: Mark::Line,
                points: tests.map(point).collect(),
            }
        })
        .collect();
    LineChart {
        title: format!("What MACKRL's parts are worth on {}", report.map),
        subtitle:
            "Greedy tests during training; mean over seeds, band of MACKRL ± one standard error"
                .into(),
        x_axis: Axis {
            label: "Environment steps".into(),
            range: None,
        },
        y_axis: Axis {
            label: "Share of battles won".into(),
            range,
        },
        legend: Corner::emptiest(&series, range),
        series,
    }
}
