//! The curves: a panel for each map.

use super::{
    Comparison, Recorded,
    report::{Report, Row},
};
use crate::{
    plot::{Axis, Colour, Mark, Multiple, Point, Series, SmallMultiples},
    reproduce::Chart,
};

/// One for each learner, in the order of the plan; further ones begin anew.
const COLOURS: [Colour; 5] = [
    Colour::BLUE,
    Colour::VERMILLION,
    Colour::GREEN,
    Colour::SKY,
    Colour::GREY,
];
/// Panels side by side.
const COLUMNS: usize = 4;

impl Report {
    /// Curves as small multiples.
    pub(super) fn chart(&self, comparison: &Comparison) -> Chart {
        let mut learners: Vec<&str> = Vec::new();
        let mut maps: Vec<&str> = Vec::new();
        for row in &self.rows {
            for (known, name) in [(&mut learners, &row.learner), (&mut maps, &row.map)] {
                if !known.contains(&&**name) {
                    known.push(name);
                }
            }
        }
        let panel = |map: &&str| {
            let own = |learner: &&str| {
                let mut rows = self.rows.iter();
                rows.find(|row| row.map == **map && row.learner == **learner)
            };
            let numbered = learners.iter().zip(COLOURS.iter().cycle());
            let ours = numbered.clone().map(|(learner, &colour)| Series {
                name: Some((*learner).to_owned()),
                colour,
                mark: Mark::Line,
                points: own(learner).map(points).unwrap_or_default(),
            });
            let recorded = numbered.filter_map(|(learner, &colour)| {
                Some(Series {
                    name: None,
                    colour,
                    mark: Mark::Rings,
                    points: rings(comparison.recorded_of(map, learner)?),
                })
            });
            Multiple {
                title: (*map).to_owned(),
                note: note(self.rows.iter().filter(|row| row.map == **map)),
                series: ours.chain(recorded).collect(),
            }
        };
        let axis = |label: &str, range| Axis {
            label: label.to_owned(),
            range,
        };
        Chart::Multiples(SmallMultiples {
            title: comparison.title.to_owned(),
            subtitle: comparison.subtitle.to_owned(),
            x_axis: axis("Environment steps", None),
            y_axis: axis("Share of battles won", Some([-0.02, 1.02])),
            columns: COLUMNS.min(maps.len()),
            panels: maps.iter().map(panel).collect(),
        })
    }
}

fn points(row: &Row) -> Vec<Point> {
    let Some(found) = &row.found else {
        return Vec::new();
    };
    let curve = found.steps.iter().zip(&found.curve);
    curve
        .map(|(&step, &(mean, error))| Point::with_error(step as f64, mean, error))
        .collect()
}

/// What others recorded.
fn rings(recorded: &Recorded) -> Vec<Point> {
    let points = recorded.points();
    points
        .map(|(step, won)| Point::exact(step as f64, won))
        .collect()
}

/// "5 runs of each", or from how many to how many.
fn note<'a>(rows: impl Iterator<Item = &'a Row> + Clone) -> String {
    let runs = rows.map(|row| row.runs);
    let (least, most) = (runs.clone().min(), runs.max());
    match (least.unwrap_or(0), most.unwrap_or(0)) {
        (1, 1) => "1 run of each".to_owned(),
        (least, most) if least == most => format!("{most} runs of each"),
        (least, most) => format!("{least} to {most} runs"),
    }
}
