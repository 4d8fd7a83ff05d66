//! Where everything stands: from a chart to a scene.

use super::{
    chart::{Colour, Corner, LineChart, Mark, Point, Series},
    scale::Scale,
    scene::{Anchor, Direction, Panel, Rectangle, Scene, Shape, Weight, Words},
    text,
};

const WIDTH: u16 = 720;
const HEIGHT: u16 = 480;
pub(super) const MARGIN: f64 = 20.0;
pub(super) const TITLE_SIZE: f64 = 17.0;
pub(super) const SUBTITLE_SIZE: f64 = 12.0;
pub(super) const LABEL_SIZE: f64 = 13.0;
pub(super) const TICK_SIZE: f64 = 12.0;
const LEGEND_ROW: f64 = 19.0;
pub(super) const SAMPLE_WIDTH: f64 = 25.0;
const LINE_WIDTH: f64 = 2.25;
const DASHES_WIDTH: f64 = 1.25;
const RING_RADIUS: f64 = 3.4;
const BAND_OPACITY: f64 = 0.18;
/// Share of a font's size by which a base line lies below the middle of its lower-case letters.
pub(super) const MIDDLE: f64 = 0.35;

const WHITE: Colour = Colour(0xFF, 0xFF, 0xFF);
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
    let area = plot_area(chart, &y);
    let axes = Axes {
        x: x.onto(area.left, area.right),
        y: y.onto(area.bottom, area.top),
    };
    let mut foreground = axis_words(chart, area, &axes);
    foreground.extend(titles(&chart.title, &chart.subtitle, area.left));
    foreground.extend(legend(chart, area));
    let panel = Panel {
        area,
        background: grid(area, &axes),
        data: data(&chart.series, &axes),
        foreground,
    };
    Scene {
        width: WIDTH,
        height: HEIGHT,
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

fn plot_area(chart: &LineChart, y: &Scale) -> Rectangle {
    let widest = widest_label(y);
    let subtitle = if chart.subtitle.is_empty() { 0.0 } else { 19.0 };
    Rectangle {
        left: MARGIN + LABEL_SIZE + 12.0 + widest + 8.0,
        top: MARGIN + TITLE_SIZE + 12.0 + subtitle,
        right: f64::from(WIDTH) - MARGIN - 8.0,
        bottom: f64::from(HEIGHT) - MARGIN - LABEL_SIZE - 12.0 - TICK_SIZE - 6.0,
    }
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
        dashed: false,
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

fn axis_words(chart: &LineChart, area: Rectangle, axes: &Axes) -> Vec<Shape> {
    let mut shapes = ticks_below(area, &axes.x);
    shapes.extend(ticks_beside(area, &axes.y));
    let below = [
        f64::midpoint(area.left, area.right),
        f64::from(HEIGHT) - MARGIN,
    ];
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

/// What stands above a chart.
pub(super) fn titles(title: &str, subtitle: &str, left: f64) -> [Shape; 2] {
    let base = MARGIN + TITLE_SIZE * 0.8;
    let title = Words {
        weight: Weight::Medium,
        ..words(title.to_owned(), [left, base], TITLE_SIZE, INK)
    };
    let at = [left, base + 19.0];
    let subtitle = words(subtitle.to_owned(), at, SUBTITLE_SIZE, FAINT_INK);
    [title, subtitle].map(Shape::Words)
}

/// Bands below, lines and marks above.
pub(super) fn data(series: &[Series], axes: &Axes) -> Vec<Shape> {
    let bands = series.iter().filter_map(|series| band(series, axes));
    let marks = series.iter().flat_map(|series| {
        let places = (series.points.iter())
            .map(|point| [axes.x.place(point.x), axes.y.place(point.y)])
            .collect();
        marks(series, places)
    });
    bands.chain(marks).collect()
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
    let line = |width, dashed| Shape::Line {
        points: places.clone(),
        colour,
        width,
        dashed,
    };
    match series.mark {
        Mark::Line => vec![line(LINE_WIDTH, false)],
        Mark::Dashes => vec![line(DASHES_WIDTH, true)],
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

fn legend(chart: &LineChart, area: Rectangle) -> Vec<Shape> {
    let rows: Vec<(&Series, &str)> = (chart.series.iter())
        .filter_map(|series| series.name.as_deref().map(|name| (series, name)))
        .collect();
    let widest = (rows.iter())
        .map(|(_, name)| text::width(name, TICK_SIZE, Weight::Regular))
        .fold(0.0, f64::max);
    let (width, height) = (
        SAMPLE_WIDTH + 8.0 + widest + 20.0,
        rows.len() as f64 * LEGEND_ROW + 10.0,
    );
    let left = match chart.legend {
        Corner::UpperLeft | Corner::LowerLeft => area.left + 10.0,
        Corner::UpperRight | Corner::LowerRight => area.right - 6.0 - width,
    };
    let top = match chart.legend {
        Corner::UpperLeft | Corner::UpperRight => area.top + 6.0,
        Corner::LowerLeft | Corner::LowerRight => area.bottom - 10.0 - height,
    };
    let paper = Rectangle {
        left,
        top,
        right: match chart.legend {
            Corner::UpperLeft | Corner::LowerLeft => left + width,
            // To the edge, lest stubs of grid lines stick out behind the legend.
            Corner::UpperRight | Corner::LowerRight => area.right,
        },
        bottom: top + height,
    };
    let mut shapes = vec![Shape::Polygon {
        points: paper.corners().to_vec(),
        colour: WHITE,
        opacity: 0.9,
    }];
    for (row, (series, name)) in rows.into_iter().enumerate() {
        let middle = top + 5.0 + (row as f64 + 0.5) * LEGEND_ROW;
        let start = left + 10.0;
        shapes.extend(sample(series, start, middle));
        let at = [start + SAMPLE_WIDTH + 8.0, middle + MIDDLE * TICK_SIZE];
        shapes.push(Shape::Words(words(name.into(), at, TICK_SIZE, INK)));
    }
    shapes
}

/// What a series looks like, beside its name.
pub(super) fn sample(series: &Series, start: f64, middle: f64) -> Vec<Shape> {
    let end = start + SAMPLE_WIDTH;
    let places = match series.mark {
        Mark::Line | Mark::Dashes => vec![[start, middle], [end, middle]],
        Mark::Rings => vec![[f64::midpoint(start, end), middle]],
    };
    let mut shapes = Vec::new();
    if series.points.iter().any(Point::has_band) {
        let area = Rectangle {
            left: start,
            top: middle - 5.0,
            right: end,
            bottom: middle + 5.0,
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
