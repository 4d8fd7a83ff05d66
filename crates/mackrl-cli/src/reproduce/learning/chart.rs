//! The charts of a figure.

use super::{
    Body, Curve, Report,
    report::{Moment, Panel, Rate, Variant},
};
use crate::{
    plot::{Axis, Colour, LineChart, Mark, Multiple, Point, Series, SmallMultiples},
    reproduce::Chart,
};

/// The colours of MACKRL and of what it is compared with.
const BOTH: [Colour; 2] = [Colour::BLUE, Colour::VERMILLION];
/// Panels side by side.
const COLUMNS: usize = 4;

impl Report {
    /// The charts, each with the name of its files.
    pub(crate) fn charts(&self) -> Vec<(String, Chart)> {
        let name = self.figure.name;
        match &self.body {
            Body::Panels(panels) => {
                let chart = |panel: &Panel| {
                    let series = win_rates(panel, &self.steps);
                    (
                        format!("{name}-{}", panel.map),
                        self.lines(&panel.map, series),
                    )
                };
                panels.iter().map(chart).collect()
            }
            Body::Moments(moments) => vec![(name.to_owned(), self.moments(moments))],
            Body::Variants(variants) => vec![(name.to_owned(), self.multiples(variants))],
        }
    }

    /// A text of the figure with what it leaves open.
    pub(super) fn text(&self, text: &str, map: &str) -> String {
        text.replace("{map}", map)
            .replace("{seeds}", &self.seeds.to_string())
    }

    fn axes(&self, x_range: Option<[f64; 2]>) -> [Axis; 2] {
        let [x, y] = self.figure.axes.map(str::to_owned);
        [(x, x_range), (y, Some([-0.02, 1.02]))].map(|(label, range)| Axis { label, range })
    }

    fn lines(&self, map: &str, series: Vec<Series>) -> Chart {
        let [x_axis, y_axis] = self.axes(None);
        Chart::Lines(LineChart {
            title: self.text(self.figure.title, map),
            subtitle: self.text(self.figure.subtitle, map),
            x_axis,
            y_axis,
            series,
        })
    }

    /// A panel for each moment, with what was published for it.
    fn moments(&self, moments: &[Moment]) -> Chart {
        let panel = |moment: &Moment| Multiple {
            title: moment.when(),
            note: moment.when_published(),
            series: rates(moment),
        };
        let enemies = moments.first().map_or(0, |moment| moment.rates.len() - 1);
        let [x_axis, y_axis] = self.axes(Some([-0.1, enemies as f64 + 0.1]));
        Chart::Multiples(SmallMultiples {
            title: self.text(self.figure.title, ""),
            subtitle: self.text(self.figure.subtitle, ""),
            x_axis,
            y_axis,
            columns: COLUMNS,
            panels: moments.iter().map(panel).collect(),
        })
    }

    /// A panel for each variant, with MACKRL in all of them.
    fn multiples(&self, variants: &[Variant]) -> Chart {
        let Some((mackrl, others)) = variants.split_first() else {
            unreachable!("a report begins with MACKRL");
        };
        let series = |variant: &Variant, name: &str, colour| {
            line(name.to_owned(), colour, variant.curve.points(&self.steps))
        };
        let panel = |variant: &Variant| Multiple {
            title: variant.arm.label.to_owned(),
            note: note(variant),
            series: vec![
                series(mackrl, "MACKRL", BOTH[0]),
                series(variant, "what the panel names", BOTH[1]),
            ],
        };
        let map = self.map.as_deref().unwrap_or_default();
        let [x_axis, y_axis] = self.axes(None);
        Chart::Multiples(SmallMultiples {
            title: self.text(self.figure.title, map),
            subtitle: self.text(self.figure.subtitle, map),
            x_axis,
            y_axis,
            columns: COLUMNS,
            panels: others.iter().map(panel).collect(),
        })
    }
}

/// Our curves on a map, and the published points up to the last step that is shown.
pub(crate) fn win_rates(panel: &Panel, steps: &[u64]) -> Vec<Series> {
    let learned = |name: &str, colour, curve: &Curve| {
        line(
            format!("{name} ({})", curve.runs),
            colour,
            curve.points(steps),
        )
    };
    let last = steps.last().copied().unwrap_or(0);
    let published = panel.published;
    let rings = |name: Option<&str>, colour, values: &[f64]| Series {
        name: name.map(str::to_owned),
        colour,
        mark: Mark::Rings,
        points: (published.steps.iter().zip(values))
            .filter(|&(&step, _)| step <= last)
            .map(|(&step, &y)| Point::exact(step as f64, y))
            .collect(),
    };
    let [mackrl, central_v] = BOTH;
    let mut series = vec![
        learned("Central-V", central_v, &panel.central_v),
        learned("MACKRL", mackrl, &panel.mackrl),
    ];
    if published.steps[0] <= last {
        series.extend([
            rings(None, central_v, &published.central_v),
            rings(None, mackrl, &published.mackrl),
            rings(Some("published 2018, StarCraft II"), Colour::GREY, &[]),
        ]);
    }
    series
}

/// Ours, and what was published.
fn rates(moment: &Moment) -> Vec<Series> {
    let point = |(enemies, rate): (usize, &Rate)| {
        Some(Point::with_error(enemies as f64, rate.mean?, rate.sem?))
    };
    let points = moment.rates.iter().enumerate().filter_map(point);
    let ours = line("MACKRL".to_owned(), BOTH[0], points.collect());
    let published = published_rates(moment.published);
    std::iter::once(ours).chain(published).collect()
}

/// Published rates by the number of commonly known enemies: rings on a dashed line.
pub(crate) fn published_rates(rates: &[f64]) -> [Series; 2] {
    [(None, Mark::Dashes), (Some("published 2018"), Mark::Rings)].map(|(name, mark)| Series {
        name: name.map(str::to_owned),
        colour: BOTH[1],
        mark,
        points: (rates.iter().enumerate())
            .map(|(enemies, &rate)| Point::exact(enemies as f64, rate))
            .collect(),
    })
}

/// A named curve.
pub(crate) fn line(name: String, colour: Colour, points: Vec<Point>) -> Series {
    Series {
        name: Some(name),
        colour,
        mark: Mark::Line,
        points,
    }
}

fn note(variant: &Variant) -> String {
    variant.versus_mackrl.map_or_else(String::new, |versus| {
        let sign = if versus.difference < 0.0 { '−' } else { '+' };
        format!("{sign}{:.2} ± {:.2}", versus.difference.abs(), versus.error)
    })
}
