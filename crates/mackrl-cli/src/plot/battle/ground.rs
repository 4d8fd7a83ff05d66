//! The ground that a picture shows.

use super::{
    BattlePicture,
    marks::{filled, open},
};
use crate::plot::{
    chart::Colour,
    scene::{Rectangle, Shape, Stroke},
};

/// Map units about each body that are shown too.
pub(super) const SURROUNDINGS: f64 = 1.2;
/// Most map units along x and along y at which whole fields of view are shown: more would make the units small.
const FIELDS_WITHIN: [f64; 2] = [24.0, 15.0];
const GROUND: Colour = Colour(0xF4, 0xF1, 0xEA);
const GRID: Colour = Colour(0xE6, 0xE1, 0xD6);
pub(super) const WALL: Colour = Colour(0xC9, 0xC4, 0xB8);

/// First and last place shown along x, and along y, in map units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Window([[f64; 2]; 2]);

impl Window {
    /// What is about all units, where they are and where they go; the lens's fields of view too, where there is room.
    pub(super) fn around(pictures: &[BattlePicture]) -> Self {
        let figures = pictures.iter().flat_map(|picture| &picture.figures);
        let units = figures.flat_map(|figure| {
            let about = figure.radius + SURROUNDINGS;
            [(figure.at, about), (figure.to, about)]
        });
        let units = Self::about(units);
        let fields = pictures.iter().flat_map(|picture| {
            let lens = picture.lens.iter().flat_map(|lens| &lens.fields);
            lens.map(|index| (picture.figures[*index].at, picture.sight + 0.3))
        });
        let whole = units.joined(Self::about(fields));
        let [across, down] = whole.size();
        if across <= FIELDS_WITHIN[0] && down <= FIELDS_WITHIN[1] {
            whole
        } else {
            units
        }
    }

    /// What is about some places, each with how far about it.
    fn about(places: impl Iterator<Item = ([f64; 2], f64)>) -> Self {
        let nothing = Self([[f64::INFINITY, f64::NEG_INFINITY]; 2]);
        places.fold(nothing, |window, (at, about)| {
            window.joined(Self(at.map(|place| [place - about, place + about])))
        })
    }

    /// What is in one of the two, or between them.
    fn joined(self, other: Self) -> Self {
        Self([0, 1].map(|axis| {
            let ([first, last], [other_first, other_last]) = (self.0[axis], other.0[axis]);
            [first.min(other_first), last.max(other_last)]
        }))
    }

    /// At least this wide and high about the same middle, but inside a map of `edge` units if that is as large.
    pub(super) fn widened(self, least: [f64; 2], edge: f64) -> Self {
        Self([0, 1].map(|axis| {
            let [first, last] = self.0[axis];
            let length = (last - first).max(least[axis]);
            let start = f64::midpoint(first, last) - length / 2.0;
            let start = if length <= edge {
                start.clamp(0.0, edge - length)
            } else {
                start
            };
            [start, start + length]
        }))
    }

    /// Map units along x, and along y.
    pub(super) fn size(self) -> [f64; 2] {
        self.0.map(|[first, last]| last - first)
    }

    /// Map units to the east and to the south of the window's corner.
    pub(super) fn offset(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Self([[west, _], [_, north]]) = self;
        [x - west, north - y]
    }

    /// Walls, ground and a fine grid on it. Cells side by side are one shape.
    pub(super) fn ground(
        self,
        picture: &BattlePicture,
        area: Rectangle,
        place: impl Fn([f64; 2]) -> [f64; 2],
    ) -> Vec<Shape> {
        let mut shapes = vec![filled(&area.corners(), WALL, 1.0)];
        let [columns, rows] = self.0.map(|ends| cells(ends, picture.edge));
        let is_ground = |x: usize, y: usize| picture.walkable[y * picture.edge + x];
        for y in rows {
            let mut x = columns.start;
            while x < columns.end {
                let start = x;
                while x < columns.end && is_ground(x, y) {
                    x += 1;
                }
                if x > start {
                    let [left, bottom] = place([start as f64, y as f64]);
                    let [right, top] = place([x as f64, y as f64 + 1.0]);
                    // A hair of overlap, so that no seam shows between rows.
                    let bottom = bottom + 0.4;
                    let row = Rectangle {
                        left,
                        top,
                        right,
                        bottom,
                    };
                    shapes.push(filled(&row.corners(), GROUND, 1.0));
                }
                x += 1;
            }
        }
        shapes.extend(self.grid(picture.edge, place));
        shapes
    }

    /// A line at every fourth cell.
    fn grid(self, edge: usize, place: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<Shape> {
        let Self([[west, east], [south, north]]) = self;
        let fourth = |ends| cells(ends, edge).filter(|line| line % 4 == 0);
        let upright = fourth([west, east]).map(|x| [[x as f64, south], [x as f64, north]]);
        let level = fourth([south, north]).map(|y| [[west, y as f64], [east, y as f64]]);
        let lines = upright.chain(level).map(|ends| ends.map(&place));
        lines
            .map(|ends| open(&ends, GRID, 1.0, Stroke::Solid))
            .collect()
    }
}

/// The cells of which something lies between two places.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the map"
)]
fn cells([first, last]: [f64; 2], edge: usize) -> std::ops::Range<usize> {
    let [first, last] = [first.floor(), last.ceil()].map(|end| end.clamp(0.0, edge as f64));
    first as usize..last as usize
}
