//! Walking, stepping round each other, and staying apart.
//!
//! Every walker steps towards its destination, round whoever stands in its way; then overlaps are shared out and walls push
//! back. All steps and all pushes of a loop are computed from the same positions, so nobody is first.
//!
//! The engine's own steering is not public. What is here was chosen by recorded runs of the game (`docs/fidelity.md`): a walker
//! goes round a row of fighters as round one obstacle, so that an army flows round those of it that fight; where the way round
//! would lead back, it goes straight on and pushes; friends that fight give way a little. Walkers push idle friends aside, and
//! enemies block each other.

use crate::{rules::Battle, terrain::Terrain};

/// How firmly a unit stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Footing {
    /// Dead: in nobody's way.
    Gone,
    /// On the move.
    Walking,
    /// Idle: walking friends push it aside.
    Standing,
    /// Attacking: enemies do not push it, and friends hardly.
    Braced,
}

/// Where units are about to be, and how they are pushed.
#[derive(Debug, Clone, Default)]
pub(super) struct Steps {
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
    push_x: Vec<f32>,
    push_y: Vec<f32>,
}

/// Something that does not move aside for a walker.
#[derive(Debug, Clone, Copy)]
pub(super) struct Obstacle {
    /// From the walker to its centre.
    toward: [f32; 2],
    /// Distance between centres at which the two touch.
    touch: f32,
}

/// A walker's wish: the unit vector to its destination and the distance.
#[derive(Debug, Clone, Copy)]
struct Wish {
    ahead: [f32; 2],
    distance: f32,
}

/// Gap to an obstacle, in map units, at which a walker begins to step round it. With 0.5 a walker sees only the neighbour that it
/// runs into: stalkers and zealots then surround a team that stands sooner, in 42.6 steps, 42.9 here and 43.1 in recorded runs.
pub(super) const LOOKAHEAD: f32 = 2.0;
/// Cosine of the greatest turn round obstacles, 105°. Walkers that turn back further, up to 127°, run about behind their own
/// front: 24 zerglings take 4 steps longer; with 90° stalkers and zealots surround a team that stands a step too soon.
const LEAST_COSINE: f32 = -0.266;
/// Obstacles that a walker goes round in one turn, at most.
const TURNS: usize = 8;
/// How readily those who fight give way to walking friends, where walkers do with 1. Without it 8 marines that stand last 25.1
/// steps, 24.0 in recorded runs, and 25 marines at random 3 steps longer; more of it changes little.
const FIGHTERS_READINESS: f32 = 0.4;
/// Loops for which a walker keeps the side on which it steps round.
const DETOUR_LOOPS: u8 = 8;
/// Rounds of pushing apart in a loop, at most.
const PUSH_ROUNDS: usize = 2;
/// Map units that a round pushes a unit along an axis, at most.
const GREATEST_PUSH: f32 = 0.070_312_5;
/// Difference of cosines below which two turns are equal: rounding differs on the two sides of the map, and must not decide.
const EQUAL_TURNS: f32 = 1e-3;
/// Map units by which a tangent may cut an obstacle.
const TANGENT_TOLERANCE: f32 = 2e-3;
/// Overlap in map units that is left alone.
const OVERLAP_TOLERANCE: f32 = 1e-3;

impl Steps {
    pub(super) fn resize(&mut self, units: usize) {
        self.x.resize(units, 0.0);
        self.y.resize(units, 0.0);
        self.push_x.resize(units, 0.0);
        self.push_y.resize(units, 0.0);
    }
}

impl Battle {
    /// Moves every walker by one loop and resolves what overlaps.
    pub(super) fn walk(&mut self) {
        self.scratch.neighbours.refresh(&self.field, &self.state);
        self.scratch.steps.x.copy_from_slice(&self.state.x);
        self.scratch.steps.y.copy_from_slice(&self.state.y);
        for index in 0..self.state.units.len() {
            match self.scratch.destination[index] {
                Some(to) => self.step_forward(index, to),
                None => self.state.units[index].pace = 0.0,
            }
        }
        for _ in 0..PUSH_ROUNDS {
            if !self.push_apart() {
                break;
            }
        }
        self.settle();
    }

    /// Pushes everybody apart, as they stand, and off the walls, in so many rounds at most.
    pub(super) fn part(&mut self, rounds: usize) {
        for _ in 0..rounds {
            self.scratch.neighbours.refresh(&self.field, &self.state);
            self.scratch.steps.x.copy_from_slice(&self.state.x);
            self.scratch.steps.y.copy_from_slice(&self.state.y);
            let overlapped = self.push_apart();
            self.settle();
            if !overlapped {
                break;
            }
        }
    }

    /// One walker's step, computed from the positions at the loop's beginning.
    fn step_forward(&mut self, index: usize, to: [f32; 2]) {
        let (x, y) = (self.state.x[index], self.state.y[index]);
        let profile = &self.field.profiles[usize::from(self.state.units[index].kind)];
        let [to_x, to_y] = match self.field.terrain.for_layer(profile.layer) {
            Some(terrain) => terrain.waypoint([x, y], to, profile.inner_radius),
            None => to,
        };
        let (dx, dy) = (to_x - x, to_y - y);
        let distance = (dx * dx + dy * dy).sqrt();
        if distance == 0.0 {
            return;
        }
        let unit = &mut self.state.units[index];
        unit.pace = (unit.pace + profile.acceleration).min(profile.speed);
        let stride = unit.pace.min(distance);
        let ahead = [dx / distance, dy / distance];
        let [way_x, way_y] = self.way_round(index, Wish { ahead, distance });
        self.scratch.steps.x[index] = x + on_grid(way_x * stride);
        self.scratch.steps.y[index] = y + on_grid(way_y * stride);
    }

    /// The unit vector along which a walker goes: towards its destination if nothing blocks it, else round what does, on the side
    /// where that is less of a turn; if both are equal, towards greater y. If either side would turn it back it goes straight on
    /// and pushes. All obstacles are looked at before a side is chosen, so that the order of units is of no consequence.
    fn way_round(&mut self, index: usize, wish: Wish) -> [f32; 2] {
        let is_free = self.note_obstacles(index, wish);
        let unit = &mut self.state.units[index];
        unit.detour_loops = unit.detour_loops.saturating_sub(1);
        if is_free {
            return wish.ahead;
        }
        let obstacles = &self.scratch.obstacles;
        let [left, right] = [1.0, -1.0].map(|side| wish.turned(obstacles, side));
        let goes_left = match (left, right) {
            (None, None) => return wish.ahead,
            (Some(_), None) => true,
            (None, Some(_)) => false,
            (Some(_), Some(_)) if unit.detour_loops > 0 => unit.detour > 0,
            (Some((_, left)), Some((_, right))) if (left - right).abs() < EQUAL_TURNS => {
                wish.ahead[0] >= 0.0
            }
            (Some((_, left)), Some((_, right))) => left > right,
        };
        unit.detour = if goes_left { 1 } else { -1 };
        unit.detour_loops = DETOUR_LOOPS;
        let chosen = if goes_left { left } else { right };
        chosen.map_or(wish.ahead, |(way, _)| way)
    }

    /// Lists what stands near a walker and does not move aside for it; returns whether its straight way is free.
    fn note_obstacles(&mut self, index: usize, wish: Wish) -> bool {
        let (state, scratch) = (&self.state, &mut self.scratch);
        let neighbours = &scratch.neighbours;
        let (x, y) = (state.x[index], state.y[index]);
        let mut is_free = true;
        scratch.obstacles.clear();
        for &other in neighbours.of(index) {
            let other = usize::from(other);
            if !blocks(scratch.footing[other], neighbours.are_friends(index, other)) {
                continue;
            }
            let obstacle = Obstacle {
                toward: [state.x[other] - x, state.y[other] - y],
                touch: neighbours.touch(index, other),
            };
            if obstacle.is_near() && !wish.leads_to(&obstacle) {
                is_free &= !obstacle.obstructs(wish.ahead);
                scratch.obstacles.push(obstacle);
            }
        }
        is_free
    }

    /// Pushes overlapping units apart once; returns whether any overlapped.
    fn push_apart(&mut self) -> bool {
        let (neighbours, steps) = (&self.scratch.neighbours, &mut self.scratch.steps);
        let footing = &self.scratch.footing;
        let mut overlapped = false;
        for i in 0..footing.len() {
            if footing[i] == Footing::Gone {
                continue;
            }
            let (x, y) = (steps.x[i], steps.y[i]);
            for &j in neighbours.after(i) {
                let j = usize::from(j);
                let (dx, dy) = (steps.x[j] - x, steps.y[j] - y);
                let touch = neighbours.touch(i, j);
                let square = dx * dx + dy * dy;
                let slack = touch - OVERLAP_TOLERANCE;
                if square < slack * slack && footing[j] != Footing::Gone {
                    if !overlapped {
                        steps.push_x.fill(0.0);
                        steps.push_y.fill(0.0);
                        overlapped = true;
                    }
                    let shares = shares(footing[i], footing[j], neighbours.are_friends(i, j));
                    steps.share_out([i, j], [dx, dy], touch - square.sqrt(), shares);
                }
            }
        }
        if overlapped {
            for (position, push) in steps.x.iter_mut().zip(&steps.push_x) {
                *position += push.clamp(-GREATEST_PUSH, GREATEST_PUSH);
            }
            for (position, push) in steps.y.iter_mut().zip(&steps.push_y) {
                *position += push.clamp(-GREATEST_PUSH, GREATEST_PUSH);
            }
        }
        overlapped
    }

    /// Takes the new positions over, off the walls. A walker that a wall stops passes its obstacle on the other side.
    fn settle(&mut self) {
        let state = &mut self.state;
        for (index, unit) in state.units.iter_mut().enumerate() {
            let (new_x, new_y) = (self.scratch.steps.x[index], self.scratch.steps.y[index]);
            if new_x == state.x[index] && new_y == state.y[index] {
                continue;
            }
            let profile = &self.field.profiles[usize::from(unit.kind)];
            let (x, y) = match self.field.terrain.for_layer(profile.layer) {
                Some(terrain) => terrain.pushed_out_of_walls(new_x, new_y, profile.inner_radius),
                None => Terrain::within_map(new_x, new_y),
            };
            let back = (x - new_x).abs() + (y - new_y).abs();
            if unit.detour_loops > 0 && back > 0.5 * profile.speed {
                unit.detour = -unit.detour;
                unit.detour_loops = 2 * DETOUR_LOOPS;
            }
            state.x[index] += on_grid(x - state.x[index]);
            state.y[index] += on_grid(y - state.y[index]);
        }
    }
}

impl Wish {
    /// Whether an obstacle is the destination itself.
    fn leads_to(&self, obstacle: &Obstacle) -> bool {
        let (forward, across) = split(obstacle.toward, self.ahead);
        forward >= self.distance - 1e-3 && across.abs() < 1e-3
    }

    /// The first free way when turning to one side, left with 1 and right with −1, with the cosine of the turn: at each obstacle
    /// the tangent that turns the most, until nothing is in the way. `None` if that turns back.
    fn turned(&self, obstacles: &[Obstacle], side: f32) -> Option<([f32; 2], f32)> {
        let mut way = self.ahead;
        for _ in 0..TURNS {
            let tangents = obstacles
                .iter()
                .filter(|obstacle| obstacle.obstructs(way))
                .map(|obstacle| obstacle.tangent(side))
                .map(|tangent| (tangent, split(tangent, way).0));
            let Some((farthest, _)) = tangents.min_by(|a, b| a.1.total_cmp(&b.1)) else {
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

impl Obstacle {
    /// Whether a walker takes notice of it.
    fn is_near(&self) -> bool {
        let [x, y] = self.toward;
        let near = self.touch + LOOKAHEAD;
        x * x + y * y < near * near
    }

    /// Whether it is in the way of a walker that goes along the unit vector `way`.
    fn obstructs(&self, way: [f32; 2]) -> bool {
        let (forward, across) = split(self.toward, way);
        forward > 0.0 && across.abs() < self.touch - TANGENT_TOLERANCE
    }

    /// The unit vector that passes it on one side and just touches it; at a right angle to it for a walker that touches it.
    fn tangent(&self, side: f32) -> [f32; 2] {
        let [x, y] = self.toward;
        let distance = (x * x + y * y).max(1e-12).sqrt();
        let sine = (self.touch / distance).min(1.0);
        let cosine = (1.0 - sine * sine).max(0.0).sqrt();
        let (x, y, sine) = (x / distance, y / distance, sine * side);
        [x * cosine - y * sine, y * cosine + x * sine]
    }
}

/// A displacement of less than 1 024 map units, rounded to a multiple of 2⁻¹² map units, halves to the even one.
///
/// The engine's numbers are fixed-point with that grain. All positions are multiples of it, so that sums and differences of
/// them are exact: two armies that are mirror images move as mirror images, to the bit, and pushes add up to the same in any order.
pub(super) fn on_grid(displacement: f32) -> f32 {
    // Numbers from 2 048 to 4 096 are that far apart.
    const SHIFT: f32 = 3_072.0;
    (displacement + SHIFT) - SHIFT
}

/// The parts of a vector along a unit vector and to the left of it.
fn split([x, y]: [f32; 2], [along_x, along_y]: [f32; 2]) -> (f32, f32) {
    (x * along_x + y * along_y, along_x * y - along_y * x)
}

impl Steps {
    /// Adds what an overlap moves each of two units.
    fn share_out(
        &mut self,
        [i, j]: [usize; 2],
        [dx, dy]: [f32; 2],
        overlap: f32,
        [share_i, share_j]: [f32; 2],
    ) {
        let distance = (dx * dx + dy * dy).sqrt();
        // Units on the very same spot part along y.
        let (ux, uy) = if distance > 1e-6 {
            (dx / distance, dy / distance)
        } else {
            (0.0, 1.0)
        };
        self.push_x[i] -= on_grid(ux * overlap * share_i);
        self.push_y[i] -= on_grid(uy * overlap * share_i);
        self.push_x[j] += on_grid(ux * overlap * share_j);
        self.push_y[j] += on_grid(uy * overlap * share_j);
    }
}

/// Whether a unit will not move aside for a walker.
fn blocks(footing: Footing, are_friends: bool) -> bool {
    match footing {
        Footing::Braced => true,
        Footing::Standing => !are_friends,
        Footing::Walking | Footing::Gone => false,
    }
}

/// Which parts of an overlap two units give way by; they sum to 1.
fn shares(i: Footing, j: Footing, are_friends: bool) -> [f32; 2] {
    let (weight_i, weight_j) = (readiness(i, are_friends), readiness(j, are_friends));
    let total = weight_i + weight_j;
    if total > 0.0 {
        [weight_i / total, weight_j / total]
    } else {
        [0.5, 0.5]
    }
}

/// How readily a unit gives way: walkers do, idle units and, a little, fighting ones do to friends.
fn readiness(footing: Footing, are_friends: bool) -> f32 {
    match footing {
        Footing::Walking => 1.0,
        Footing::Standing if are_friends => 0.5,
        Footing::Braced if are_friends => FIGHTERS_READINESS,
        Footing::Standing | Footing::Braced | Footing::Gone => 0.0,
    }
}
