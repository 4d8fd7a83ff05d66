//! Where everything stands: from a chart to a scene.

use super::{
    chart::{Colour, LineChart, Mark, Point, Series},
    legend::{self, Entry, Legend},
    scale::Scale,
    scene::{Anchor, Direction, Panel, Rectangle, Scene, Shape, Stroke, Weight, Words, pixels},
    text,
};

const WIDTH: u16 = 720;
/// Height of the plotting area.
const AREA_HEIGHT: f64 = 360.0;
pub(super) const MARGIN: f64 = 20.0;
pub(super) const TITLE_SIZE: f64 = 17.0;
pub(super) const SUBTITLE_SIZE: f64 = 12.0;
pub(super) const LABEL_SIZE: f64 = 13.0;
pub(super) const TICK_SIZE: f64 = 12.0;
pub(super) const SAMPLE_WIDTH: f64 = 25.0;
const LINE_WIDTH: f64 = 2.25;
const DASHES_WIDTH: f64 = 1.25;
const RING_RADIUS: f64 = 3.4;
const BAND_OPACITY: f64 = 0.18;
/// Share of a font's size by which a base line lies below the middle of its lower-case letters.
pub(super) const MIDDLE: f64 = 0.35;

pub(super) const INK: Colour = Colour(0x22, 0x22, 0x22);
pub(super) const FAINT_INK: Colour = Colour(0x5A, 0x5A, 0x5A);
const GRID: Colour = Colour(0xE4, 0xE4, 0xE4);

/// Both axes in pixels.
pub(super) struct Axes {
    pub(super) x: Scale,
    pub(super) y: Scale,
}

/// Lays `chart` out.
pub(super) fn lay_out(chart: &LineChart) -> Scene {
    let points = || chart.series.iter().flat_map(|series| &series.points);
    let x = scale(chart.x_axis.range, 6.0, points().map(|point| point.x));
    let heights = points().flat_map(|point| point.band);
    let y = scale(chart.y_axis.range, 7.0, heights);
    let left = MARGIN + LABEL_SIZE + 12.0 + widest_label(&y) + 8.0;
    let right = f64::from(WIDTH) - MARGIN - 8.0;
    let head = head(
        [&chart.title, &chart.subtitle],
        &chart.series,
        [left, right],
    );
    let area = Rectangle {
        left,
        top: head.height,
        right,
        bottom: head.height + AREA_HEIGHT,
    };
    let axes = Axes {
        x: x.onto(area.left, area.right),
        y: y.onto(area.bottom, area.top),
    };
    let height = area.bottom + TICK_SIZE + 18.0 + LABEL_SIZE + MARGIN;
    let mut foreground = rings(&chart.series, &axes, area);
    foreground.extend(axis_words(chart, area, &axes, height));
    foreground.extend(head.shapes);
    let panel = Panel {
        area,
        background: grid(area, &axes),
        data: data(&chart.series, &axes),
        foreground,
    };
    Scene {
        width: WIDTH,
        height: pixels(height),
        panels: vec![panel],
    }
}

/// The scale of `range`, or one that fits `values`.
pub(super) fn scale(
    range: Option<[f64; 2]>,
    ticks: f64,
    values: impl Iterator<Item = f64>,
) -> Scale {
    range.map_or_else(
        || Scale::fitting(values, ticks),
        |range| Scale::new(range, ticks),
    )
}

/// Width of the widest label of an axis.
pub(super) fn widest_label(scale: &Scale) -> f64 {
    (scale.ticks().iter())
        .map(|(_, label)| text::width(label, TICK_SIZE, Weight::Regular))
        .fold(0.0, f64::max)
}

/// Horizontal lines at the ticks of the vertical axis, and the horizontal axis.
pub(super) fn grid(area: Rectangle, axes: &Axes) -> Vec<Shape> {
    let line = |points, colour| Shape::Line {
        points,
        colour,
        width: 1.0,
        stroke: Stroke::Solid,
    };
    let mut shapes: Vec<Shape> = (axes.y.ticks().into_iter())
        .map(|(value, _)| {
            let y = axes.y.place(value);
            line(vec![[area.left, y], [area.right, y]], GRID)
        })
        .collect();
    shapes.extend(axes.x.ticks().into_iter().map(|(value, _)| {
        let x = axes.x.place(value);
        line(vec![[x, area.bottom], [x, area.bottom + 5.0]], FAINT_INK)
    }));
    shapes.push(line(
        vec![[area.left, area.bottom], [area.right, area.bottom]],
        FAINT_INK,
    ));
    shapes
}

fn axis_words(chart: &LineChart, area: Rectangle, axes: &Axes, height: f64) -> Vec<Shape> {
    let mut shapes = ticks_below(area, &axes.x);
    shapes.extend(ticks_beside(area, &axes.y));
    let below = [f64::midpoint(area.left, area.right), height - MARGIN];
    shapes.push(label(&chart.x_axis.label, below, Direction::Rightwards));
    let beside = [MARGIN + LABEL_SIZE, f64::midpoint(area.top, area.bottom)];
    shapes.push(label(&chart.y_axis.label, beside, Direction::Upwards));
    shapes
}

/// The numbers at the horizontal axis.
pub(super) fn ticks_below(area: Rectangle, x: &Scale) -> Vec<Shape> {
    let ticks = x.ticks().into_iter();
    let shapes = ticks.map(|(value, label)| {
        let at = [x.place(value), area.bottom + TICK_SIZE + 8.0];
        tick(label, at, Anchor::Middle)
    });
    shapes.collect()
}

/// The numbers at the vertical axis.
pub(super) fn ticks_beside(area: Rectangle, y: &Scale) -> Vec<Shape> {
    let ticks = y.ticks().into_iter();
    let shapes = ticks.map(|(value, label)| {
        let at = [area.left - 8.0, y.place(value) + MIDDLE * TICK_SIZE];
        tick(label, at, Anchor::End)
    });
    shapes.collect()
}

fn tick(label: String, at: [f64; 2], anchor: Anchor) -> Shape {
    Shape::Words(Words {
        anchor,
        ..words(label, at, TICK_SIZE, FAINT_INK)
    })
}

/// Quantity and unit of an axis, centred at `at`.
pub(super) fn label(text: &str, at: [f64; 2], direction: Direction) -> Shape {
    Shape::Words(Words {
        anchor: Anchor::Middle,
        direction,
        ..words(text.to_owned(), at, LABEL_SIZE, INK)
    })
}

/// What stands above a chart from the picture's upper edge on: title, subtitle and legend.
pub(super) fn head([title, subtitle]: [&str; 2], series: &[Series], ends: [f64; 2]) -> Legend {
    let left = ends[0];
    let base = MARGIN + TITLE_SIZE * 0.8;
    let title = Words {
        weight: Weight::Medium,
        ..words(title.to_owned(), [left, base], TITLE_SIZE, INK)
    };
    let below = if subtitle.is_empty() { 0.0 } else { 19.0 };
    let at = [left, base + below];
    let subtitle = words(subtitle.to_owned(), at, SUBTITLE_SIZE, FAINT_INK);
    let named = series
        .iter()
        .filter_map(|series| Some((series, series.name.as_deref()?)));
    let entries = named.map(|(series, name)| Entry::new(SAMPLE_WIDTH, name, sample(series)));
    let top = base + below + 8.0;
    let mut head = legend::flow(entries.collect(), ends, top);
    head.shapes.extend([title, subtitle].map(Shape::Words));
    head.height += top + 10.0;
    head
}

/// Bands below, lines above.
pub(super) fn data(series: &[Series], axes: &Axes) -> Vec<Shape> {
    let bands = series.iter().filter_map(|series| band(series, axes));
    let lines = series.iter().filter(|series| series.mark != Mark::Rings);
    let lines = lines.flat_map(|series| marks(series, places(series, axes)));
    bands.chain(lines).collect()
}

/// The rings of which the centre is in the plotting area, its edge included: a ring at the edge is not cut.
pub(super) fn rings(series: &[Series], axes: &Axes, area: Rectangle) -> Vec<Shape> {
    let rings = series.iter().filter(|series| series.mark == Mark::Rings);
    rings
        .flat_map(|series| {
            let mut places = places(series, axes);
            places.retain(|place| area.holds(*place));
            marks(series, places)
        })
        .collect()
}

fn places(series: &Series, axes: &Axes) -> Vec<[f64; 2]> {
    let points = series.points.iter();
    points
        .map(|point| [axes.x.place(point.x), axes.y.place(point.y)])
        .collect()
}

fn band(series: &Series, axes: &Axes) -> Option<Shape> {
    let edge = |side: usize| {
        let place = move |point: &Point| [axes.x.place(point.x), axes.y.place(point.band[side])];
        series.points.iter().map(place)
    };
    let wide = series.points.iter().any(Point::has_band);
    wide.then(|| Shape::Polygon {
        points: edge(1).chain(edge(0).rev()).collect(),
        colour: series.colour,
        opacity: BAND_OPACITY,
    })
}

fn marks(series: &Series, places: Vec<[f64; 2]>) -> Vec<Shape> {
    let colour = series.colour;
    let line = |width, stroke| Shape::Line {
        points: places.clone(),
        colour,
        width,
        stroke,
    };
    match series.mark {
        Mark::Line => vec![line(LINE_WIDTH, Stroke::Solid)],
        Mark::Dashes => vec![line(DASHES_WIDTH, Stroke::Dashed)],
        Mark::Rings => (places.iter())
            .map(|&centre| Shape::Ring {
                centre,
                radius: RING_RADIUS,
                colour,
                width: 1.4,
            })
            .collect(),
    }
}

/// What a series looks like in a legend.
fn sample(series: &Series) -> Vec<Shape> {
    let places = match series.mark {
        Mark::Line | Mark::Dashes => vec![[0.0, 0.0], [SAMPLE_WIDTH, 0.0]],
        Mark::Rings => vec![[SAMPLE_WIDTH / 2.0, 0.0]],
    };
    let mut shapes = Vec::new();
    if series.points.iter().any(Point::has_band) {
        let area = Rectangle {
            left: 0.0,
            top: -5.0,
            right: SAMPLE_WIDTH,
            bottom: 5.0,
        };
        shapes.push(Shape::Polygon {
            points: area.corners().to_vec(),
            colour: series.colour,
            opacity: BAND_OPACITY,
        });
    }
    shapes.extend(marks(series, places));
    shapes
}

pub(super) const fn words(text: String, at: [f64; 2], size: f64, colour: Colour) -> Words {
    Words {
        text,
        at,
        anchor: Anchor::Start,
        size,
        weight: Weight::Regular,
        colour,
        direction: Direction::Rightwards,
    }
}
