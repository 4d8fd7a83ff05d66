//! One map of Figure 6 as a chart.

use super::Panel;
use crate::{
    plot::{Axis, Colour, Corner, LineChart, Mark, Point, Series},
    reproduce::learning::{Curve, Learner},
};

/// The chart of `panel`, with a test at each of `steps`.
pub(super) fn chart(panel: &Panel, steps: &[u64]) -> LineChart {
    let learned = |learner: Learner, colour, curve: &Curve| Series {
        name: Some(format!("{} ({})", learner.name(), curve.runs)),
        colour,
        mark: Mark::Line,
        points: curve.points(steps),
    };
    let last = steps.last().copied().unwrap_or(0);
    let rings = |name: Option<&str>, colour, values: &[f64]| Series {
        name: name.map(str::to_owned),
        colour,
        mark: Mark::Rings,
        points: published(&panel.published.steps, values, last),
    };
    let (mackrl, central_v) = (Colour::BLUE, Colour::VERMILLION);
    LineChart {
        title: format!("Battles won on {}", panel.map),
        subtitle: "Greedy tests during training, our simulator; mean over seeds, band ± one standard error".into(),
        x_axis: Axis { label: "Environment steps".into(), range: None },
        y_axis: Axis { label: "Share of battles won".into(), range: Some([-0.02, 1.02]) },
        series: vec![
            learned(Learner::CentralV, central_v, &panel.central_v),
            learned(Learner::Mackrl, mackrl, &panel.mackrl),
            rings(None, central_v, &panel.published.central_v),
            rings(None, mackrl, &panel.published.mackrl),
            rings(Some("published 2018, StarCraft II"), Colour::GREY, &[]),
        ],
        legend: emptiest_corner(panel),
    }
}

/// Curves that end high leave room below, others above where they begin.
fn emptiest_corner(panel: &Panel) -> Corner {
    let ends = [&panel.mackrl, &panel.central_v].map(|curve| curve.mean.last().copied());
    if ends.into_iter().flatten().all(|end| end > 0.5) {
        Corner::LowerRight
    } else {
        Corner::UpperLeft
    }
}

/// Published points up to the last step that is shown.
fn published(steps: &[u64], values: &[f64], last: u64) -> Vec<Point> {
    (steps.iter().zip(values))
        .filter(|&(&step, _)| step <= last)
        .map(|(&step, &y)| Point::exact(step as f64, y))
        .collect()
}
