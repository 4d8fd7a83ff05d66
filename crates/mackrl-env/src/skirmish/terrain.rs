//! Where units can walk: a grid of cells of one map unit.
//!
//! The walkable regions are those of the maps' cell flags. On the lane and the open field every two points are joined by a
//! straight walkable line, so nobody needs a path and none is computed; elsewhere [`Terrain::waypoint`] leads round corners.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::skirmish::paths::Paths;

/// Edge of the square map in map units and cells.
pub const MAP_SIZE: usize = 32;

/// Names of the terrains of SMAC's maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TerrainName {
    /// A lane along x, 16 cells wide: the maps of symmetric armies.
    Lane,
    /// Everything is walkable.
    Open,
    /// A square with stepped corners.
    Octagon,
    /// The arena of `6h_vs_8z`.
    #[serde(rename = "arena-6h")]
    Arena6h,
    /// The arena of `2s_vs_1sc`.
    #[serde(rename = "arena-2s")]
    Arena2s,
    /// A broad way from one corner to the other.
    WindingSlope,
}

/// A walkability grid and what movement derives from it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Terrain {
    /// Whether a cell is walkable, index `y * MAP_SIZE + x`.
    walkable: Vec<bool>,
    /// Whether a cell and its eight neighbours are walkable, so that no wall is near.
    is_far_from_walls: Vec<bool>,
    /// Ways round corners, where there are corners.
    paths: Option<Paths>,
}

impl Terrain {
    /// The terrain called `name`.
    #[must_use]
    pub fn named(name: TerrainName) -> Arc<Self> {
        // Rectangles of walkable cells: inclusive x range, inclusive y range.
        let rectangles: &[[usize; 4]] = match name {
            TerrainName::Lane => &[[0, 31, 8, 23]],
            TerrainName::Open => &[[0, 31, 0, 31]],
            TerrainName::Octagon => &[[10, 21, 6, 25], [8, 23, 8, 23], [6, 25, 10, 21]],
            TerrainName::Arena6h => &[[10, 19, 8, 19], [8, 21, 10, 17]],
            TerrainName::Arena2s => &[[8, 19, 8, 19], [10, 17, 20, 21], [12, 15, 22, 23]],
            TerrainName::WindingSlope => &[
                [2, 7, 2, 3],
                [2, 11, 4, 7],
                [4, 15, 8, 11],
                [8, 19, 12, 15],
                [10, 19, 16, 17],
                [14, 25, 18, 21],
                [16, 29, 22, 23],
                [20, 29, 24, 27],
                [22, 29, 28, 29],
            ],
        };
        Arc::new(Self::from_rectangles(rectangles))
    }

    fn from_rectangles(rectangles: &[[usize; 4]]) -> Self {
        let mut walkable = vec![false; MAP_SIZE * MAP_SIZE];
        for &[x_first, x_last, y_first, y_last] in rectangles {
            for y in y_first..=y_last {
                walkable[y * MAP_SIZE + x_first..=y * MAP_SIZE + x_last].fill(true);
            }
        }
        Self::from_cells(walkable, rectangles.len() > 1)
    }

    /// The terrain with the given walkable cells, index `y * MAP_SIZE + x`; with `corners`, units find ways round them.
    pub(crate) fn from_cells(walkable: Vec<bool>, corners: bool) -> Self {
        let mut terrain = Self {
            walkable,
            is_far_from_walls: Vec::new(),
            paths: None,
        };
        terrain.is_far_from_walls = (0..MAP_SIZE * MAP_SIZE)
            .map(|cell| {
                let (x, y) = (signed(cell % MAP_SIZE), signed(cell / MAP_SIZE));
                (-1..=1).all(|dy| (-1..=1).all(|dx| terrain.is_walkable(x + dx, y + dy)))
            })
            .collect();
        if corners {
            terrain.paths = Some(Paths::new(&terrain.walkable));
        }
        terrain
    }

    /// Whether the cell with corner (`x`, `y`) is inside the map and walkable.
    #[must_use]
    pub fn is_walkable(&self, x: i32, y: i32) -> bool {
        cell_index(x, y).is_some_and(|cell| self.walkable[cell])
    }

    /// Number of walkable cells.
    #[must_use]
    pub fn walkable_cells(&self) -> usize {
        self.walkable.iter().filter(|walkable| **walkable).count()
    }

    /// Where a disc of `radius` at `from` heads next on its way to `to`: to `to` itself if nothing is between, else to the
    /// farthest of the next cells of a shortest path that it can see.
    #[must_use]
    pub fn waypoint(&self, from: [f32; 2], to: [f32; 2], radius: f32) -> [f32; 2] {
        let Some(paths) = &self.paths else { return to };
        if self.is_clear(from, to, radius) {
            return to;
        }
        let cell = |[x, y]: [f32; 2]| cell_index(cell_of(x), cell_of(y));
        let (Some(mut here), Some(there)) = (cell(from), cell(to)) else {
            return to;
        };
        let mut heading = None;
        for _ in 0..LOOK_ALONG_PATH {
            let Some(next) = paths.next(here, there) else {
                break;
            };
            let centre = [next % MAP_SIZE, next / MAP_SIZE].map(|index| index as f32 + 0.5);
            if heading.is_some() && !self.is_clear(from, centre, radius) {
                break;
            }
            heading = Some(centre);
            here = next;
        }
        heading.unwrap_or(to)
    }

    /// Whether a disc can go straight from `from` to `to`, looked at twice a map unit.
    fn is_clear(&self, from: [f32; 2], to: [f32; 2], radius: f32) -> bool {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let looks = (2.0 * (dx * dx + dy * dy).sqrt()).ceil().max(1.0);
        // Touching a wall by a little is no obstacle: one slides along it.
        let radius = 0.9 * radius;
        let mut look = 1.0;
        while look <= looks {
            let (x, y) = (from[0] + dx * look / looks, from[1] + dy * look / looks);
            if self.pushed_out_of_walls(x, y, radius) != (x, y) {
                return false;
            }
            look += 1.0;
        }
        true
    }

    /// The point nearest to (`x`, `y`) where a disc of `radius` ≤ 1 touches no wall, as far as one correction per
    /// neighbouring cell finds it.
    #[must_use]
    pub fn pushed_out_of_walls(&self, x: f32, y: f32, radius: f32) -> (f32, f32) {
        let edge = MAP_SIZE as f32 - 0.01;
        let (mut x, mut y) = (x.clamp(0.01, edge), y.clamp(0.01, edge));
        let (cell_x, cell_y) = (cell_of(x), cell_of(y));
        if cell_index(cell_x, cell_y).is_some_and(|cell| self.is_far_from_walls[cell]) {
            return (x, y);
        }
        // Faces before corners: a wall of several cells must not catch a unit at the seams between them.
        for (dx, dy) in NEIGHBOURS_FACES_FIRST {
            if !self.is_walkable(cell_x + dx, cell_y + dy) {
                (x, y) = pushed_out_of_cell(x, y, radius, cell_x + dx, cell_y + dy);
            }
        }
        (x, y)
    }
}

/// Cells of a path that are looked along.
const LOOK_ALONG_PATH: usize = 8;

const NEIGHBOURS_FACES_FIRST: [(i32, i32); 9] = [
    (0, 0),
    (1, 0),
    (-1, 0),
    (0, 1),
    (0, -1),
    (1, 1),
    (1, -1),
    (-1, 1),
    (-1, -1),
];

/// Moves a disc out of the cell with corner (`cell_x`, `cell_y`), by the shortest way.
fn pushed_out_of_cell(x: f32, y: f32, radius: f32, cell_x: i32, cell_y: i32) -> (f32, f32) {
    let (low_x, low_y) = (cell_x as f32, cell_y as f32);
    let near_x = x.clamp(low_x, low_x + 1.0);
    let near_y = y.clamp(low_y, low_y + 1.0);
    let (dx, dy) = (x - near_x, y - near_y);
    let square = dx * dx + dy * dy;
    if square >= radius * radius {
        return (x, y);
    }
    if square > 0.0 {
        let scale = radius / square.sqrt();
        return (near_x + dx * scale, near_y + dy * scale);
    }
    // The centre itself is inside: leave by the nearest face.
    let ways = [
        (x - low_x, low_x - radius, y),
        (low_x + 1.0 - x, low_x + 1.0 + radius, y),
        (y - low_y, x, low_y - radius),
        (low_y + 1.0 - y, x, low_y + 1.0 + radius),
    ];
    let shortest = ways.iter().fold(
        ways[0],
        |best, way| if way.0 < best.0 { *way } else { best },
    );
    (shortest.1, shortest.2)
}

/// The index of the cell that holds a coordinate.
#[expect(
    clippy::cast_possible_truncation,
    reason = "coordinates lie within the map"
)]
pub(crate) fn cell_of(coordinate: f32) -> i32 {
    coordinate as i32
}

fn cell_index(x: i32, y: i32) -> Option<usize> {
    let x = usize::try_from(x).ok().filter(|x| *x < MAP_SIZE)?;
    let y = usize::try_from(y).ok().filter(|y| *y < MAP_SIZE)?;
    Some(y * MAP_SIZE + x)
}

fn signed(index: usize) -> i32 {
    i32::try_from(index).expect("cells have small indices")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terrains_have_as_many_cells_as_the_maps_flag() {
        assert_eq!(Terrain::named(TerrainName::Lane).walkable_cells(), 512);
        assert_eq!(Terrain::named(TerrainName::Open).walkable_cells(), 1024);
        assert_eq!(
            Terrain::named(TerrainName::Octagon).walkable_cells(),
            4 * 12 + 4 * 16 + 12 * 20
        );
    }

    #[test]
    fn a_disc_beside_a_wall_is_pushed_off_it() {
        let lane = Terrain::named(TerrainName::Lane);
        assert_eq!(lane.pushed_out_of_walls(5.5, 8.125, 0.375), (5.5, 8.375));
        assert_eq!(lane.pushed_out_of_walls(5.5, 23.9, 0.5), (5.5, 23.5));
        assert_eq!(lane.pushed_out_of_walls(5.5, 16.0, 0.5), (5.5, 16.0));
    }

    #[test]
    fn a_disc_that_slides_along_a_wall_is_not_caught_at_cell_borders() {
        let lane = Terrain::named(TerrainName::Lane);
        for i in 0..50 {
            let x = 5.0 + i as f32 * 0.04;
            assert_eq!(lane.pushed_out_of_walls(x, 8.2, 0.375), (x, 8.375));
        }
    }

    #[test]
    fn a_way_leads_round_a_corner() {
        let bend = Terrain::from_rectangles(&[[2, 5, 2, 20], [2, 20, 2, 5]]);
        let (mut at, to) = ([3.5, 19.0], [19.0, 3.5]);
        for _ in 0..80 {
            let [x, y] = bend.waypoint(at, to, 0.375);
            let (dx, dy) = (x - at[0], y - at[1]);
            let part = (0.5 / (dx * dx + dy * dy).sqrt()).min(1.0);
            let (x, y) = bend.pushed_out_of_walls(at[0] + dx * part, at[1] + dy * part, 0.375);
            at = [x, y];
        }
        assert!(
            (at[0] - to[0]).abs() + (at[1] - to[1]).abs() < 0.1,
            "got to {at:?}"
        );
    }

    #[test]
    fn beyond_the_map_nothing_is_walkable() {
        let open = Terrain::named(TerrainName::Open);
        assert!(
            !open.is_walkable(-1, 5) && !open.is_walkable(5, 32),
            "outside"
        );
    }
}
