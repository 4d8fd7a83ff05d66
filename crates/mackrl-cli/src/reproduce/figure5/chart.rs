//! Figure 5 as a chart.

use mackrl::tabular::Curve;
use mackrl_env::matrix_game::{ObservationDistribution, Payoffs};

use super::report::{Figure5Report, Quantity};
use crate::plot::{Axis, Colour, LineChart, Mark, Point, Series};

/// The chart of `report`.
pub(super) fn chart(report: &Figure5Report) -> LineChart {
    let payoffs = match report.payoffs {
        Payoffs::Coded => "Payoffs of the published code",
        Payoffs::Printed => "Payoffs as printed",
    };
    let observation = match report.observation {
        ObservationDistribution::Y2018 => "observations as in 2018",
        ObservationDistribution::NeurIps2019 => "observations as at NeurIPS 2019",
    };
    let quantity = match report.quantity {
        Quantity::Train => "Expected return",
        Quantity::Test => "Expected return of the greedy policy",
    };
    LineChart {
        title: "Matrix game: return by probability of common knowledge".into(),
        subtitle: format!(
            "{payoffs}, {observation}; mean of {} runs, band ± one standard error",
            report.runs
        ),
        x_axis: Axis {
            label: "P(common knowledge)".into(),
            range: Some([-0.02, 1.02]),
        },
        y_axis: Axis {
            label: quantity.into(),
            range: Some([0.4, 1.02]),
        },
        series: all_series(report),
    }
}

fn all_series(report: &Figure5Report) -> Vec<Series> {
    let (points, curves, published) = (&report.points, &report.curves, &report.published);
    let bound = |name: &str, colour, values: &[f64]| Series {
        name: Some(name.into()),
        colour,
        mark: Mark::Dashes,
        points: exact(points, values),
    };
    let learned = |name: &str, colour, curve: &Curve| Series {
        name: Some(format!("{name} ({})", report.runs)),
        colour,
        mark: Mark::Line,
        points: measured(points, curve),
    };
    let rings = |name: Option<String>, colour, values: &[f64]| Series {
        name,
        colour,
        mark: Mark::Rings,
        points: exact(&published.points, values),
    };
    let (mackrl, iac, jal) = (Colour::BLUE, Colour::VERMILLION, Colour::GREEN);
    vec![
        learned("MACKRL", mackrl, &curves.mackrl),
        learned("IAC", iac, &curves.iac),
        learned("JAL", jal, &curves.jal),
        rings(None, jal, &published.jal),
        rings(None, iac, &published.iac),
        rings(None, mackrl, &published.mackrl),
        rings(
            Some(format!("published {}", published.label)),
            Colour::GREY,
            &[],
        ),
        bound(
            "optimum, MACKRL and IAC",
            Colour::BLACK,
            &report.optimum.mackrl,
        ),
        bound("optimum, JAL", Colour::GREY, &report.optimum.jal),
    ]
}

fn exact(points: &[f64], values: &[f64]) -> Vec<Point> {
    (points.iter().zip(values))
        .map(|(&x, &y)| Point::exact(x, y))
        .collect()
}

fn measured(points: &[f64], curve: &Curve) -> Vec<Point> {
    (points.iter().zip(curve.mean.iter().zip(&curve.sem)))
        .map(|(&x, (&y, &error))| Point::with_error(x, y, error))
        .collect()
}
