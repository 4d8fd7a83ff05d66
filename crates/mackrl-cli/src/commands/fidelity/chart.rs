//! Lengths of episodes as a chart.

use mackrl_skirmish::fidelity::QUANTILES;

use super::LengthRow;
use crate::plot::{Axis, Colour, Mark, Multiple, Point, Series, SmallMultiples};

/// One panel a map: the share of episodes that are over, ours as a line and the game's quantiles as rings.
pub(super) fn lengths(rows: &[LengthRow]) -> SmallMultiples {
    SmallMultiples {
        title: "Episodes of random play that are over".into(),
        subtitle: "The real game: its 10, 25, 50, 75 and 90 % quantiles".into(),
        x_axis: Axis {
            label: "Steps".into(),
            range: Some([15.0, 95.0]),
        },
        y_axis: Axis {
            label: "Share of episodes".into(),
            range: Some([-0.02, 1.02]),
        },
        columns: 2,
        panels: rows.iter().map(panel).collect(),
    }
}

fn panel(row: &LengthRow) -> Multiple {
    let real = row.real.iter().zip(QUANTILES);
    Multiple {
        title: row.map.clone(),
        note: format!("{} episodes of the real game", row.real_episodes),
        series: vec![
            Series {
                name: Some("simulator".into()),
                colour: Colour::BLUE,
                mark: Mark::Line,
                points: points(row),
            },
            Series {
                name: Some("StarCraft II".into()),
                colour: Colour::VERMILLION,
                mark: Mark::Rings,
                points: real.map(|(x, y)| Point::exact(*x, y)).collect(),
            },
        ],
    }
}

/// The last share of each length: a line over a thousand episodes needs no more.
fn points(row: &LengthRow) -> Vec<Point> {
    let mut points: Vec<Point> = Vec::new();
    for &[length, share] in &row.shares {
        if points.last().is_some_and(|last| last.x == length) {
            points.pop();
        }
        points.push(Point::exact(length, share));
    }
    points
}
