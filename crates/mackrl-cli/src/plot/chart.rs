//! What a chart shows.

use super::{layout::lay_out, png, svg};

/// Lines over a common pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LineChart {
    /// What is shown, in a few words.
    pub(crate) title: String,
    /// What one has to know to read it: what bands and marks mean. May be empty.
    pub(crate) subtitle: String,
    /// The horizontal axis.
    pub(crate) x_axis: Axis,
    /// The vertical axis.
    pub(crate) y_axis: Axis,
    /// Drawn in order: later ones lie on top.
    pub(crate) series: Vec<Series>,
    /// Where the legend stands inside the axes; choose the emptiest.
    pub(crate) legend: Corner,
}

/// One axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axis {
    /// Quantity and unit.
    pub(crate) label: String,
    /// Lowest and highest number shown; `None` fits the data.
    pub(crate) range: Option<[f64; 2]>,
}

/// A corner of the plotting area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(dead_code, reason = "every figure has its own emptiest corner")]
pub(crate) enum Corner {
    /// Top left.
    UpperLeft,
    /// Top right.
    UpperRight,
    /// Bottom left.
    LowerLeft,
    /// Bottom right.
    LowerRight,
}

/// Points that belong together.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Series {
    /// Name in the legend; `None` leaves it out.
    pub(crate) name: Option<String>,
    /// Of lines, marks and band.
    pub(crate) colour: Colour,
    /// How points are drawn.
    pub(crate) mark: Mark,
    /// In ascending order of x, all numbers finite.
    pub(crate) points: Vec<Point>,
}

/// One point of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    /// Place on the horizontal axis.
    pub(crate) x: f64,
    /// Place on the vertical axis.
    pub(crate) y: f64,
    /// The band reaches from `y - half_width` to `y + half_width`; 0 for none.
    pub(crate) half_width: f64,
}

/// How the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mark {
    /// A strong line: what was measured.
    Line,
    /// A thin dashed line: a bound or a reference.
    Dashes,
    /// Rings without a line: somebody else's measurement.
    Rings,
}

/// Red, green and blue, each in 0..=255.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Colour(pub(crate) u8, pub(crate) u8, pub(crate) u8);

impl Colour {
    /// Black of the Okabe–Ito palette.
    pub(crate) const BLACK: Self = Self(0x00, 0x00, 0x00);
    /// Blue of the Okabe–Ito palette.
    pub(crate) const BLUE: Self = Self(0x00, 0x72, 0xB2);
    /// Bluish green of the Okabe–Ito palette.
    pub(crate) const GREEN: Self = Self(0x00, 0x9E, 0x73);
    /// Orange of the Okabe–Ito palette.
    pub(crate) const ORANGE: Self = Self(0xE6, 0x9F, 0x00);
    /// Reddish purple of the Okabe–Ito palette.
    pub(crate) const PURPLE: Self = Self(0xCC, 0x79, 0xA7);
    /// Sky blue of the Okabe–Ito palette.
    pub(crate) const SKY: Self = Self(0x56, 0xB4, 0xE9);
    /// Vermillion of the Okabe–Ito palette.
    pub(crate) const VERMILLION: Self = Self(0xD5, 0x5E, 0x00);
    /// For references that belong to no series.
    pub(crate) const GREY: Self = Self(0x70, 0x70, 0x70);
}

impl LineChart {
    /// The chart as an SVG document.
    #[must_use]
    pub(crate) fn to_svg(&self) -> String {
        svg::write(&lay_out(self), &self.title)
    }

    /// The chart as a PNG image.
    ///
    /// # Errors
    /// If the image cannot be encoded.
    pub(crate) fn to_png(&self) -> anyhow::Result<Vec<u8>> {
        png::write(&lay_out(self))
    }
}
