//! What is in a walker's way, and the ways round it.

use crate::rules::{
    battle::make_room,
    neighbours::{LANES, Lane, Places, lanes},
};

/// What does not move aside for a walker, in rows of eight.
#[derive(Debug, Clone, Default)]
pub(super) struct Obstacles {
    rows: Vec<ObstacleRow>,
    count: usize,
}

/// Eight obstacles.
#[derive(Debug, Clone, Copy)]
struct ObstacleRow {
    /// From the walker to their centres.
    x: Lane,
    y: Lane,
    /// Distances between centres at which the two touch.
    touch: Lane,
    /// The unit vectors to their centres.
    centre_x: Lane,
    centre_y: Lane,
    /// Sines and cosines of the angles between their centres and ways that just touch them.
    sine: Lane,
    cosine: Lane,
}

/// A walker's wish: the unit vector to its destination and the distance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wish {
    pub(super) ahead: [f32; 2],
    pub(super) distance: f32,
}

/// Cosine of the greatest turn round obstacles, 105°. Walkers that turn back further, up to 127°, run about behind their own
/// front: 24 zerglings take 4 steps longer; with 90° stalkers and zealots surround a team that stands a step too soon.
const LEAST_COSINE: f32 = -0.266;
/// Obstacles that a walker goes round in one turn, at most.
const TURNS: usize = 8;
/// Map units by which a tangent may cut an obstacle.
const TANGENT_TOLERANCE: f32 = 2e-3;

impl Wish {
    /// Whether what is so far from the walker is the destination itself.
    pub(super) fn leads_to(&self, toward: [f32; 2]) -> bool {
        let (forward, across) = split(toward, self.ahead);
        forward >= self.distance - 1e-3 && across.abs() < 1e-3
    }

    /// The first free way when turning to one side, left with 1 and right with −1, with the cosine of the turn: at each obstacle
    /// the tangent that turns the most, until nothing is in the way. `None` if that turns back.
    pub(super) fn turned(&self, obstacles: &Obstacles, side: f32) -> Option<([f32; 2], f32)> {
        let mut way = self.ahead;
        for _ in 0..TURNS {
            let mut farthest: Option<([f32; 2], f32)> = None;
            for row in &obstacles.rows {
                for place in row.obstructing(way) {
                    let tangent = row.tangent(place, side);
                    let (cosine, _) = split(tangent, way);
                    if farthest.is_none_or(|(_, least)| cosine.total_cmp(&least).is_lt()) {
                        farthest = Some((tangent, cosine));
                    }
                }
            }
            let Some((farthest, _)) = farthest else {
                return Some((way, split(way, self.ahead).0));
            };
            way = farthest;
            let (cosine, sine) = split(way, self.ahead);
            if cosine < LEAST_COSINE || sine * side < 0.0 {
                return None;
            }
        }
        None
    }
}

impl Obstacles {
    pub(super) fn reserve(&mut self, obstacles: usize) {
        make_room(&mut self.rows, obstacles.div_ceil(LANES));
    }

    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.count = 0;
    }

    pub(super) fn push(&mut self, [x, y]: [f32; 2], touch: f32) {
        let place = self.count % LANES;
        if place == 0 {
            self.rows.push(ObstacleRow::EMPTY);
        }
        if let Some(row) = self.rows.last_mut() {
            row.x[place] = x;
            row.y[place] = y;
            row.touch[place] = touch;
        }
        self.count += 1;
    }

    /// Whether none is in the way.
    pub(super) fn are_free(&self, way: [f32; 2]) -> bool {
        self.rows.iter().all(|row| row.obstructing(way).is_empty())
    }

    pub(super) fn find_tangents(&mut self) {
        self.rows.iter_mut().for_each(ObstacleRow::find_tangents);
    }
}

impl ObstacleRow {
    /// Places without an obstacle: what has no size is never in the way.
    const EMPTY: Self = Self {
        x: [0.0; LANES],
        y: [0.0; LANES],
        touch: [0.0; LANES],
        centre_x: [0.0; LANES],
        centre_y: [0.0; LANES],
        sine: [0.0; LANES],
        cosine: [0.0; LANES],
    };

    /// Those in the way of a walker that goes along the unit vector `way`.
    #[inline(always)]
    fn obstructing(&self, way: [f32; 2]) -> Places {
        let behind = lanes(|place| 0.0 - (self.x[place] * way[0] + self.y[place] * way[1]));
        let aside = lanes(|place| (way[0] * self.y[place] - way[1] * self.x[place]).abs());
        let passing = lanes(|place| self.touch[place] - TANGENT_TOLERANCE);
        Places::of_negative_and_less(behind, aside, passing)
    }

    fn find_tangents(&mut self) {
        let distance = lanes(|place| {
            let (x, y) = (self.x[place], self.y[place]);
            (x * x + y * y).max(1e-12).sqrt()
        });
        self.centre_x = lanes(|place| self.x[place] / distance[place]);
        self.centre_y = lanes(|place| self.y[place] / distance[place]);
        self.sine = lanes(|place| (self.touch[place] / distance[place]).min(1.0));
        self.cosine = lanes(|place| {
            let sine = self.sine[place];
            (1.0 - sine * sine).max(0.0).sqrt()
        });
    }

    /// The unit vector that passes one on one side and just touches it; at a right angle to it for a walker that touches it.
    fn tangent(&self, place: usize, side: f32) -> [f32; 2] {
        let (x, y) = (self.centre_x[place], self.centre_y[place]);
        let (sine, cosine) = (self.sine[place] * side, self.cosine[place]);
        [x * cosine - y * sine, y * cosine + x * sine]
    }
}

/// The parts of a vector along a unit vector and to the left of it.
fn split([x, y]: [f32; 2], [along_x, along_y]: [f32; 2]) -> (f32, f32) {
    (x * along_x + y * along_y, along_x * y - along_y * x)
}
