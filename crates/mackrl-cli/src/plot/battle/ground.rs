//! The ground that a picture shows.

use super::{
    BattlePicture,
    marks::{filled, open},
};
use crate::plot::{
    chart::Colour,
    scene::{Rectangle, Shape},
};

/// Cells around the units that are shown too.
const SURROUNDINGS: f64 = 3.0;
/// Least cells shown along x and along y.
const WINDOW_MIN: [usize; 2] = [18, 12];
/// Most cells along x and along y at which whole fields of view are shown.
const FIELDS_WITHIN: [f64; 2] = [26.0, 22.0];
const GROUND: Colour = Colour(0xF4, 0xF1, 0xEA);
const GRID: Colour = Colour(0xE6, 0xE1, 0xD6);
pub(super) const WALL: Colour = Colour(0xC9, 0xC4, 0xB8);

/// First and last cell shown along x, and along y.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window([[usize; 2]; 2]);

impl Window {
    /// The cells about all units; the lens's fields of view too, where there is room.
    pub(super) fn around(picture: &BattlePicture) -> Self {
        let figures = picture.figures.iter();
        let units: Vec<_> = figures.map(|figure| (figure.at, SURROUNDINGS)).collect();
        let lens = picture.lens.iter().flat_map(|lens| &lens.fields);
        let fields = lens.map(|index| (picture.figures[*index].at, picture.sight + 0.5));
        let whole = Self::about(units.iter().copied().chain(fields), picture.edge);
        let [columns, rows] = whole.size();
        if columns <= FIELDS_WITHIN[0] && rows <= FIELDS_WITHIN[1] {
            whole
        } else {
            Self::about(units.into_iter(), picture.edge)
        }
    }

    /// The cells about some places, each with how far about it.
    fn about(places: impl Iterator<Item = ([f64; 2], f64)> + Clone, edge: usize) -> Self {
        Self([0, 1].map(|axis| {
            let first = places.clone().map(|(at, about)| at[axis] - about);
            let last = places.clone().map(|(at, about)| at[axis] + about);
            let ends = [
                first.fold(f64::INFINITY, f64::min),
                last.fold(f64::NEG_INFINITY, f64::max),
            ];
            cells(ends, WINDOW_MIN[axis], edge)
        }))
    }

    /// Cells along x, and along y.
    pub(super) fn size(self) -> [f64; 2] {
        self.0.map(|[first, last]| (last + 1 - first) as f64)
    }

    /// Cells to the east and to the south of the window's corner.
    pub(super) fn offset(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Self([[first_x, _], [_, last_y]]) = self;
        [x - first_x as f64, last_y as f64 + 1.0 - y]
    }

    /// Walls, ground and a fine grid on it. Cells side by side are one shape.
    pub(super) fn ground(
        self,
        picture: &BattlePicture,
        area: Rectangle,
        place: impl Fn([f64; 2]) -> [f64; 2],
    ) -> Vec<Shape> {
        let mut shapes = vec![filled(&area.corners(), WALL, 1.0)];
        let Self([[first_x, last_x], [first_y, last_y]]) = self;
        let is_ground = |x: usize, y: usize| picture.walkable[y * picture.edge + x];
        for y in first_y..=last_y {
            let mut x = first_x;
            while x <= last_x {
                let start = x;
                while x <= last_x && is_ground(x, y) {
                    x += 1;
                }
                if x > start {
                    let [left, bottom] = place([start as f64, y as f64]);
                    let [right, top] = place([x as f64, y as f64 + 1.0]);
                    // A hair of overlap, so that no seam shows between rows.
                    let bottom = (bottom + 0.4).min(area.bottom);
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
        shapes.extend(self.grid(place));
        shapes
    }

    /// A line at every fourth cell.
    fn grid(self, place: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<Shape> {
        let Self([[first_x, last_x], [first_y, last_y]]) = self;
        let fourth = |first: usize, last: usize| (first..=last + 1).filter(|line| line % 4 == 0);
        let upright = fourth(first_x, last_x).map(|x| [[x, first_y], [x, last_y + 1]]);
        let level = fourth(first_y, last_y).map(|y| [[first_x, y], [last_x + 1, y]]);
        let lines = upright.chain(level);
        lines
            .map(|ends| ends.map(|end| place(end.map(|cell| cell as f64))))
            .map(|ends| open(&ends, GRID, 1.0, false))
            .collect()
    }
}

/// The `length` cells or more between two places, as far as there are so many, as first and last.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the map"
)]
pub(super) fn cells([first, last]: [f64; 2], length_min: usize, edge: usize) -> [usize; 2] {
    let greatest = edge.saturating_sub(1);
    let cell = |place: f64| place.floor().clamp(0.0, greatest as f64) as usize;
    let (mut first, mut last) = (cell(first), cell(last));
    while last + 1 - first < length_min.min(edge) {
        first = first.saturating_sub(1);
        last = (last + 1).min(greatest);
    }
    [first, last]
}
