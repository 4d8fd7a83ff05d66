//! Where units can walk: a grid of cells of one map unit.
//!
//! The walkable regions are those of the maps' cell flags. On terrain where every two walkable points are joined by a straight
//! walkable line (the lane, the open field, the octagon) nobody needs a path, and none is computed.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

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
}

/// A walkability grid and what movement derives from it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Terrain {
    /// Whether a cell is walkable, index `y * MAP_SIZE + x`.
    walkable: Vec<bool>,
    /// Whether a cell and its eight neighbours are walkable, so that no wall is near.
    is_far_from_walls: Vec<bool>,
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
        let mut terrain = Self {
            walkable,
            is_far_from_walls: Vec::new(),
        };
        terrain.is_far_from_walls = (0..MAP_SIZE * MAP_SIZE)
            .map(|cell| {
                let (x, y) = (signed(cell % MAP_SIZE), signed(cell / MAP_SIZE));
                (-1..=1).all(|dy| (-1..=1).all(|dx| terrain.is_walkable(x + dx, y + dy)))
            })
            .collect();
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
    fn beyond_the_map_nothing_is_walkable() {
        let open = Terrain::named(TerrainName::Open);
        assert!(
            !open.is_walkable(-1, 5) && !open.is_walkable(5, 32),
            "outside"
        );
    }
}
