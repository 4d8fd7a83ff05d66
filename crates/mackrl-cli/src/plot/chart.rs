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
}

/// One axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axis {
    /// Quantity and unit.
    pub(crate) label: String,
    /// Lowest and highest number shown; `None` fits the data.
    pub(crate) range: Option<[f64; 2]>,
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
    /// Lower and upper edge of the band; both are y where there is none.
    pub(crate) band: [f64; 2],
}

impl Point {
    /// A point without a band.
    #[must_use]
    pub(crate) const fn exact(x: f64, y: f64) -> Self {
        Self { x, y, band: [y; 2] }
    }

    /// A point with a band of `half_width` on both sides.
    #[must_use]
    pub(crate) const fn with_error(x: f64, y: f64, half_width: f64) -> Self {
        let band = [y - half_width, y + half_width];
        Self { x, y, band }
    }

    /// Whether there is a band.
    pub(super) const fn has_band(&self) -> bool {
        self.band[0] < self.band[1]
    }
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

    /// Colours for lines, in the order in which they are best told apart.
    pub(crate) const LINES: [Self; 9] = [
        Self::BLUE,
        Self::VERMILLION,
        Self::GREEN,
        Self::ORANGE,
        Self::PURPLE,
        Self::SKY,
        Self::BLACK,
        Self::GREY,
        Self(0x8B, 0x5A, 0x2B),
    ];
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
