//! The ablations as a chart: a panel for each variant, with MACKRL in all of them.

use super::{AblationReport, VariantReport};
use crate::plot::{Axis, Colour, Mark, Multiple, Series, SmallMultiples};

/// Panels side by side.
const COLUMNS: usize = 4;

/// The chart of `report`.
pub(super) fn chart(report: &AblationReport) -> SmallMultiples {
    let Some((mackrl, others)) = report.variants.split_first() else {
        unreachable!("a report begins with MACKRL");
    };
    let panel = |variant: &VariantReport| Multiple {
        title: variant.label.to_owned(),
        note: note(variant),
        series: vec![
            series(report, mackrl, "MACKRL", Colour::BLUE),
            series(report, variant, "what the panel names", Colour::VERMILLION),
        ],
    };
    SmallMultiples {
        title: format!("What MACKRL's parts are worth on {}", report.map),
        subtitle: format!(
            "Greedy tests during training; mean of {} seeds, band ± one standard error. The number: final win rate against MACKRL's",
            report.seeds
        ),
        x_axis: Axis {
            label: "Environment steps".into(),
            range: None,
        },
        y_axis: Axis {
            label: "Share of battles won".into(),
            range: Some([-0.02, 1.02]),
        },
        columns: COLUMNS,
        panels: others.iter().map(panel).collect(),
    }
}

fn note(variant: &VariantReport) -> String {
    variant.versus_mackrl.map_or_else(String::new, |versus| {
        let sign = if versus.difference < 0.0 { '−' } else { '+' };
        format!("{sign}{:.2} ± {:.2}", versus.difference.abs(), versus.error)
    })
}

fn series(report: &AblationReport, variant: &VariantReport, name: &str, colour: Colour) -> Series {
    Series {
        name: Some(name.to_owned()),
        colour,
        mark: Mark::Line,
        points: variant.curve.points(&report.steps),
    }
}
