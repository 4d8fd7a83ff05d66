//! Where units can walk: a grid of cells of one map unit.
//!
//! The walkable regions are those of the maps' cell flags. On the lane and the open field every two points are joined by a
//! straight walkable line, so nobody needs a path and none is computed; elsewhere [`Terrain::waypoint`] leads round corners.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::{paths::Paths, unit_types::Layer};

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
    /// Two rooms joined by a choke in which nobody stands abreast.
    Corridor,
    /// Lower ground below a plateau, with a ramp at either end of the cliff.
    Plateau,
}

/// A walkability grid and what movement derives from it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Terrain {
    /// Whether the map flags a cell as walkable, index `y * MAP_SIZE + x`: what agents are told.
    walkable: Vec<bool>,
    /// Where units really walk: flagged cells, and those that diagonal walls leave open.
    passable: Vec<bool>,
    /// Cliff level of the ground, 0 where nobody walks.
    level: Vec<u8>,
    /// The terrain of units that walk over cliffs, if it differs.
    over_cliffs: Option<Arc<Self>>,
    /// How many rings of cells around a cell are passable, the cell itself included; from 2 on no wall is near.
    clearance: Vec<u8>,
    /// Which of a cell and its neighbours are impassable: a bit each, in the order of [`NEIGHBOURS_FACES_FIRST`].
    walls: Vec<u16>,
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
            TerrainName::Corridor => &[
                [2, 11, 2, 11],
                [12, 13, 12, 13],
                [14, 25, 14, 15],
                [14, 27, 16, 17],
                [12, 29, 18, 21],
                [14, 29, 22, 23],
                [16, 29, 24, 25],
                [18, 29, 26, 27],
                [20, 29, 28, 29],
            ],
            TerrainName::Plateau => &[
                [4, 27, 6, 7],
                [2, 29, 8, 9],
                [0, 31, 10, 11],
                [0, 3, 12, 13],
                [28, 31, 12, 13],
                [0, 31, 14, 15],
                [2, 29, 16, 17],
                [8, 23, 18, 19],
            ],
        };
        let mut terrain = Self::from_rectangles(rectangles);
        match name {
            TerrainName::Corridor => terrain.open(&CORRIDOR_DIAGONALS),
            TerrainName::Plateau => {
                let mut over_cliffs = terrain.clone();
                over_cliffs.open(&[PLATEAU_CLIFF]);
                terrain.over_cliffs = Some(Arc::new(over_cliffs));
                fill(&mut terrain.level, PLATEAU_TOP, |level| *level *= 2);
            }
            _ => {}
        }
        Arc::new(terrain)
    }

    fn from_rectangles(rectangles: &[[usize; 4]]) -> Self {
        let mut walkable = vec![false; MAP_SIZE * MAP_SIZE];
        for rectangle in rectangles {
            fill(&mut walkable, *rectangle, |cell| *cell = true);
        }
        Self::from_cells(walkable, rectangles.len() > 1)
    }

    /// The terrain with the given walkable cells, index `y * MAP_SIZE + x`; with `corners`, units find ways round them.
    pub(crate) fn from_cells(walkable: Vec<bool>, corners: bool) -> Self {
        let mut terrain = Self {
            passable: walkable.clone(),
            level: walkable.iter().map(|cell| u8::from(*cell)).collect(),
            walkable,
            over_cliffs: None,
            clearance: Vec::new(),
            walls: Vec::new(),
            paths: None,
        };
        terrain.survey();
        if corners {
            terrain.paths = Some(Paths::new(&terrain.passable));
        }
        terrain
    }

    /// Lets units walk on cells that the map does not flag as walkable.
    fn open(&mut self, rectangles: &[[usize; 4]]) {
        for rectangle in rectangles {
            fill(&mut self.passable, *rectangle, |cell| *cell = true);
        }
        self.survey();
        self.paths = Some(Paths::new(&self.passable));
    }

    /// Finds how far every cell is from walls.
    fn survey(&mut self) {
        let has_ring = |cell: usize, ring: i32| {
            let (x, y) = (signed(cell % MAP_SIZE), signed(cell / MAP_SIZE));
            (-ring..=ring).all(|dy| (-ring..=ring).all(|dx| self.is_passable(x + dx, y + dy)))
        };
        self.clearance = (0..MAP_SIZE * MAP_SIZE)
            .map(|cell| (0..16).take_while(|ring| has_ring(cell, *ring)).count())
            .map(|rings| u8::try_from(rings).expect("there are at most 16 rings"))
            .collect();
        self.walls = (0..MAP_SIZE * MAP_SIZE)
            .map(|cell| {
                let (x, y) = (signed(cell % MAP_SIZE), signed(cell / MAP_SIZE));
                let sides = NEIGHBOURS_FACES_FIRST.iter().enumerate();
                sides.fold(0, |walls, (side, (dx, dy))| {
                    walls | u16::from(!self.is_passable(x + dx, y + dy)) << side
                })
            })
            .collect();
    }

    /// The terrain as units of `layer` find it; `None` for those that fly over everything.
    #[must_use]
    pub fn for_layer(&self, layer: Layer) -> Option<&Self> {
        match layer {
            Layer::Ground => Some(self),
            Layer::Tall => Some(self.over_cliffs.as_deref().unwrap_or(self)),
            Layer::Air => None,
        }
    }

    /// Cliff level of a cell over 2, in \[0, 1\]; 0 where nobody walks, 1 outside the map.
    #[must_use]
    pub fn height(&self, x: i32, y: i32) -> f32 {
        cell_index(x, y).map_or(1.0, |cell| f32::from(self.level[cell]) / 2.0)
    }

    fn is_passable(&self, x: i32, y: i32) -> bool {
        cell_index(x, y).is_some_and(|cell| self.passable[cell])
    }

    /// Whether the cell with corner (`x`, `y`) is inside the map and walkable.
    #[must_use]
    pub fn is_walkable(&self, x: i32, y: i32) -> bool {
        cell_index(x, y).is_some_and(|cell| self.walkable[cell])
    }

    /// Whether a cell belongs to the map.
    #[must_use]
    pub fn is_inside(x: i32, y: i32) -> bool {
        cell_index(x, y).is_some()
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
        // Looks for each map unit along the longer axis, to leave out those that cannot get near a wall.
        let looks_per_unit = looks / dx.abs().max(dy.abs()).max(1e-3);
        let mut look = 1.0;
        while look <= looks {
            let (x, y) = (from[0] + dx * look / looks, from[1] + dy * look / looks);
            let rings = cell_index(cell_of(x), cell_of(y)).map_or(0, |cell| self.clearance[cell]);
            if rings >= 2 {
                let spare = (f32::from(rings) - 2.01).max(0.0);
                look += 1.0 + (spare * looks_per_unit).floor();
                continue;
            }
            if self.touches_wall(x, y, radius) {
                return false;
            }
            look += 1.0;
        }
        true
    }

    /// Whether a disc of `radius` ≤ 1 overlaps an impassable cell; the same as being pushed off walls, but faster.
    fn touches_wall(&self, x: f32, y: f32, radius: f32) -> bool {
        if Self::within_map(x, y) != (x, y) {
            return true;
        }
        let (cell_x, cell_y) = (cell_of(x), cell_of(y));
        let Some(walls) = cell_index(cell_x, cell_y).map(|cell| self.walls[cell]) else {
            return true;
        };
        if walls & 1 != 0 {
            return true;
        }
        let (west, south) = (x - cell_x as f32, y - cell_y as f32);
        let (east, north) = ((cell_x + 1) as f32 - x, (cell_y + 1) as f32 - y);
        let square = radius * radius;
        let [east, west, north, south] = [east, west, north, south].map(|gap| gap * gap);
        let corners = [east + north, east + south, west + north, west + south];
        let [northeast, southeast, northwest, southwest] = corners;
        [
            east, west, north, south, northeast, southeast, northwest, southwest,
        ]
        .into_iter()
        .enumerate()
        .any(|(side, gap)| walls & (2 << side) != 0 && gap < square)
    }

    /// The point of the map nearest to (`x`, `y`).
    #[must_use]
    pub fn within_map(x: f32, y: f32) -> (f32, f32) {
        let edge = MAP_SIZE as f32 - 0.01;
        (x.clamp(0.01, edge), y.clamp(0.01, edge))
    }

    /// The point nearest to (`x`, `y`) where a disc of `radius` ≤ 1 touches no wall, as far as one correction per
    /// neighbouring cell finds it.
    #[must_use]
    pub fn pushed_out_of_walls(&self, x: f32, y: f32, radius: f32) -> (f32, f32) {
        let (mut x, mut y) = Self::within_map(x, y);
        let (cell_x, cell_y) = (cell_of(x), cell_of(y));
        if cell_index(cell_x, cell_y).is_some_and(|cell| self.clearance[cell] >= 2) {
            return (x, y);
        }
        // Faces before corners: a wall of several cells must not catch a unit at the seams between them.
        for (dx, dy) in NEIGHBOURS_FACES_FIRST {
            if !self.is_passable(cell_x + dx, cell_y + dy) {
                (x, y) = pushed_out_of_cell(x, y, radius, cell_x + dx, cell_y + dy);
            }
        }
        (x, y)
    }
}

/// Cells beside the choke of the corridor that its walls, which run at 45°, leave open. The map's blocks of 2 × 2 cells touch
/// at corners only; half a block each is ground.
const CORRIDOR_DIAGONALS: [[usize; 4]; 8] = [
    [12, 12, 10, 11],
    [13, 13, 11, 11],
    [10, 11, 12, 12],
    [11, 11, 13, 13],
    [14, 14, 12, 13],
    [15, 15, 13, 13],
    [12, 13, 14, 14],
    [13, 13, 15, 15],
];
/// The cliff of the plateau, which only tall units walk over.
const PLATEAU_CLIFF: [usize; 4] = [4, 27, 12, 13];
/// The higher ground; the ramps lead up to it.
const PLATEAU_TOP: [usize; 4] = [4, 27, 14, 19];
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

/// Changes the cells of a rectangle: inclusive x range, inclusive y range.
fn fill<T>(cells: &mut [T], [x_first, x_last, y_first, y_last]: [usize; 4], change: fn(&mut T)) {
    for y in y_first..=y_last {
        cells[y * MAP_SIZE + x_first..=y * MAP_SIZE + x_last]
            .iter_mut()
            .for_each(change);
    }
}

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
        walk(&bend, [3.5, 19.0], [19.0, 3.5], 40.0);
    }

    #[test]
    fn a_way_leads_through_the_choke_of_the_corridor() {
        let corridor = Terrain::named(TerrainName::Corridor);
        walk(&corridor, [27.0, 28.0], [4.47, 4.33], 36.0);
        walk(&corridor, [4.47, 4.33], [14.5, 20.0], 24.0);
    }

    #[test]
    fn a_way_leads_round_the_cliff_and_for_the_tall_over_it() {
        let plateau = Terrain::named(TerrainName::Plateau);
        walk(&plateau, [12.0, 9.0], [12.0, 16.0], 26.0);
        walk(&plateau, [20.0, 9.0], [20.0, 16.0], 26.0);
        let over = plateau.for_layer(Layer::Tall).unwrap();
        walk(over, [16.0, 9.0], [16.0, 16.0], 7.5);
        assert!(!over.is_walkable(16, 12), "agents are told of the cliff");
        assert_eq!(plateau.for_layer(Layer::Air), None);
    }

    /// Follows waypoints until the destination; fails if the way is longer than `longest`.
    fn walk(terrain: &Terrain, from: [f32; 2], to: [f32; 2], longest: f32) {
        let (mut at, mut length) = (from, 0.0);
        while (at[0] - to[0]).hypot(at[1] - to[1]) > 0.01 {
            let [x, y] = terrain.waypoint(at, to, 0.375);
            let (dx, dy) = (x - at[0], y - at[1]);
            let part = (0.14 / dx.hypot(dy)).min(1.0);
            let (x, y) = terrain.pushed_out_of_walls(at[0] + dx * part, at[1] + dy * part, 0.375);
            at = [x, y];
            length += 0.14;
            assert!(
                length < longest,
                "after {length} at {at:?}, from {from:?} to {to:?}"
            );
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
