//! Figure 7 as a chart.

use super::{Figure7Report, Moment};
use crate::plot::{Axis, Colour, Corner, LineChart, Mark, Point, Series};

/// One colour a moment, from light to dark.
const COLOURS: [Colour; 4] = [Colour::SKY, Colour::GREEN, Colour::BLUE, Colour::VERMILLION];

/// The chart of `report`.
pub(super) fn chart(report: &Figure7Report) -> LineChart {
    let series = report
        .moments
        .iter()
        .zip(COLOURS)
        .map(|(moment, colour)| Series {
            name: Some(moment.when()),
            colour,
            mark: Mark::Line,
            points: points(moment),
        });
    LineChart {
        title: "Delegation by commonly known enemies, 2s3z".into(),
        subtitle: format!(
            "Chosen pairs with common knowledge; mean of {} seeds, band ± one standard error",
            report.seeds
        ),
        x_axis: Axis {
            label: "Enemies in the pair's common knowledge".into(),
            range: Some([-0.1, 5.1]),
        },
        y_axis: Axis {
            label: "Share of pairs that delegate".into(),
            range: Some([-0.02, 1.02]),
        },
        series: series.collect(),
        legend: Corner::UpperRight,
    }
}

fn points(moment: &Moment) -> Vec<Point> {
    let rates = moment.rates.iter().enumerate();
    rates
        .filter_map(|(enemies, rate)| {
            Some(Point::with_error(enemies as f64, rate.mean?, rate.sem?))
        })
        .collect()
}
