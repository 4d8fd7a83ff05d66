//! What both writers draw: shapes in units of an SVG pixel, the origin at the top left.

use super::chart::Colour;

/// A picture.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scene {
    /// Width of the picture.
    pub(super) width: u16,
    /// Height of the picture.
    pub(super) height: u16,
    /// Drawn in order; they do not overlap.
    pub(super) panels: Vec<Panel>,
}

/// A part of a picture with data of its own.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Panel {
    /// Where data may be drawn.
    pub(super) area: Rectangle,
    /// Grid and frame, drawn first.
    pub(super) background: Vec<Shape>,
    /// Data, clipped to the area.
    pub(super) data: Vec<Shape>,
    /// Words, the legend, and marks that are drawn whole or not at all; drawn last.
    pub(super) foreground: Vec<Shape>,
}

/// An upright rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rectangle {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Rectangle {
    /// The corners, clockwise.
    pub(super) const fn corners(self) -> [[f64; 2]; 4] {
        let Self {
            left,
            top,
            right,
            bottom,
        } = self;
        [[left, top], [right, top], [right, bottom], [left, bottom]]
    }

    /// Whether the two have some area in common.
    pub(super) fn overlaps(self, other: Self) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }

    /// Whether a point lies inside or, but for rounding, on the edge.
    pub(super) fn holds(self, [x, y]: [f64; 2]) -> bool {
        const HAIR: f64 = 1e-6;
        (self.left - HAIR..=self.right + HAIR).contains(&x)
            && (self.top - HAIR..=self.bottom + HAIR).contains(&y)
    }
}

/// A thing to draw.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    /// A filled polygon.
    Polygon {
        points: Vec<[f64; 2]>,
        colour: Colour,
        opacity: f64,
    },
    /// An open line.
    Line {
        points: Vec<[f64; 2]>,
        colour: Colour,
        width: f64,
        stroke: Stroke,
    },
    /// A white disc with a coloured edge.
    Ring {
        centre: [f64; 2],
        radius: f64,
        colour: Colour,
        width: f64,
    },
    /// Words on one line.
    Words(Words),
}

impl Shape {
    /// The same `dx` to the right and `dy` down.
    pub(super) fn moved(mut self, [dx, dy]: [f64; 2]) -> Self {
        let by = |point: &mut [f64; 2]| *point = [point[0] + dx, point[1] + dy];
        match &mut self {
            Self::Polygon { points, .. } | Self::Line { points, .. } => {
                points.iter_mut().for_each(by);
            }
            Self::Ring { centre, .. } => by(centre),
            Self::Words(words) => by(&mut words.at),
        }
        self
    }
}

/// Words on one line.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Words {
    pub(super) text: String,
    /// The end or middle of the base line, as `anchor` says.
    pub(super) at: [f64; 2],
    pub(super) anchor: Anchor,
    /// Height of an em.
    pub(super) size: f64,
    pub(super) weight: Weight,
    pub(super) colour: Colour,
    pub(super) direction: Direction,
}

/// Which part of the words stands at their place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Where words run to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    Rightwards,
    Upwards,
}

/// Weight of a font.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Weight {
    Regular,
    Medium,
}

/// How a line is broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stroke {
    Solid,
    Dashed,
    Dotted,
}

impl Stroke {
    /// Lengths of what is drawn and of the gap, if there are gaps.
    pub(super) const fn pattern(self) -> Option<[f32; 2]> {
        match self {
            Self::Solid => None,
            Self::Dashed => Some([5.0, 3.5]),
            Self::Dotted => Some([2.0, 3.0]),
        }
    }
}

/// An edge of a picture that has room for `length`.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a picture has fewer than 65 536 pixels along an edge"
)]
pub(super) fn pixels(length: f64) -> u16 {
    length.ceil() as u16
}
