//! Small multiples: the same pair of axes again and again, each with a comparison of its own.
//!
//! Many curves over one pair of axes hide each other. Side by side, each can be compared with the one that all panels share.

use super::{
    chart::{Axis, Series},
    layout::{
        Axes, FAINT_INK, INK, LABEL_SIZE, MARGIN, SUBTITLE_SIZE, TICK_SIZE, data, grid, head,
        label, rings, scale, ticks_below, ticks_beside, widest_label, words,
    },
    png,
    scene::{Direction, Panel, Rectangle, Scene, Shape, Weight, Words, pixels},
    svg,
};

const WIDTH: u16 = 960;
/// Height of the plotting area of one panel.
const PANEL_HEIGHT: f64 = 150.0;
/// Between two panels side by side.
const GAP: f64 = 42.0;
/// Above a panel, for its title and note.
const HEAD: f64 = 44.0;

/// Panels over the same axes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SmallMultiples {
    /// What is shown, in a few words.
    pub(crate) title: String,
    /// What one has to know to read it.
    pub(crate) subtitle: String,
    /// The horizontal axis of every panel.
    pub(crate) x_axis: Axis,
    /// The vertical axis of every panel.
    pub(crate) y_axis: Axis,
    /// Panels in a row, at least 1.
    pub(crate) columns: usize,
    /// Row by row. The legend explains the series of the first, so the others use its colours for the same roles.
    pub(crate) panels: Vec<Multiple>,
}

/// One panel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Multiple {
    /// What is compared here.
    pub(crate) title: String,
    /// What came out, in a few words.
    pub(crate) note: String,
    /// Drawn in order: later ones lie on top.
    pub(crate) series: Vec<Series>,
}

impl SmallMultiples {
    /// The chart as an SVG document.
    #[must_use]
    pub(crate) fn to_svg(&self) -> String {
        svg::write(&self.scene(), &self.title)
    }

    /// The chart as a PNG image.
    ///
    /// # Errors
    /// If the image cannot be encoded.
    pub(crate) fn to_png(&self) -> anyhow::Result<Vec<u8>> {
        png::write(&self.scene())
    }

    fn scene(&self) -> Scene {
        let points =
            || (self.panels.iter().flat_map(|panel| &panel.series)).flat_map(|s| &s.points);
        let x = scale(self.x_axis.range, 3.0, points().map(|point| point.x));
        let heights = points().flat_map(|point| point.band);
        let y = scale(self.y_axis.range, 4.0, heights);
        let left = MARGIN + LABEL_SIZE + 12.0 + widest_label(&y) + 8.0;
        let right = f64::from(WIDTH) - MARGIN - 8.0;
        let named = self.panels.first().map_or(&[][..], |panel| &panel.series);
        let head = head([&self.title, &self.subtitle], named, [left, right]);
        let top = head.height;
        let across = (right - left + GAP) / self.columns as f64;
        let down = HEAD + PANEL_HEIGHT + TICK_SIZE + 14.0;
        let area = |number: usize| {
            let (row, column) = (number / self.columns, number % self.columns);
            let left = left + column as f64 * across;
            let top = top + row as f64 * down + HEAD;
            Rectangle {
                left,
                top,
                right: left + across - GAP,
                bottom: top + PANEL_HEIGHT,
            }
        };
        let mut panels: Vec<Panel> = (self.panels.iter().enumerate())
            .map(|(number, panel)| {
                let area = area(number);
                let axes = Axes {
                    x: x.clone().onto(area.left, area.right),
                    y: y.clone().onto(area.bottom, area.top),
                };
                self.panel(panel, area, &axes, number.is_multiple_of(self.columns))
            })
            .collect();
        let rows = self.panels.len().div_ceil(self.columns);
        let bottom = top + rows as f64 * down;
        let height = bottom + LABEL_SIZE + MARGIN;
        if let Some(first) = panels.first_mut() {
            let below = [f64::midpoint(left, right), height - MARGIN + 4.0];
            let beside = [MARGIN + LABEL_SIZE, f64::midpoint(top + HEAD, bottom)];
            first.foreground.extend(head.shapes);
            first.foreground.extend([
                label(&self.x_axis.label, below, Direction::Rightwards),
                label(&self.y_axis.label, beside, Direction::Upwards),
            ]);
        }
        Scene {
            width: WIDTH,
            height: pixels(height),
            panels,
        }
    }

    fn panel(&self, panel: &Multiple, area: Rectangle, axes: &Axes, is_first: bool) -> Panel {
        let title = Words {
            weight: Weight::Medium,
            ..words(
                panel.title.clone(),
                [area.left, area.top - 24.0],
                LABEL_SIZE,
                INK,
            )
        };
        let note = words(
            panel.note.clone(),
            [area.left, area.top - 8.0],
            SUBTITLE_SIZE,
            FAINT_INK,
        );
        let mut foreground = rings(&panel.series, axes, area);
        foreground.extend(ticks_below(area, &axes.x));
        if is_first {
            foreground.extend(ticks_beside(area, &axes.y));
        }
        foreground.extend([title, note].map(Shape::Words));
        Panel {
            area,
            background: grid(area, axes),
            data: data(&panel.series, axes),
            foreground,
        }
    }
}
