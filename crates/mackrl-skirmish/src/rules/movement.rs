//! Walking, stepping round each other, and staying apart.
//!
//! Every walker steps towards its destination, along the tangent of whoever stands in its way; then overlaps are shared out
//! and walls push back. All steps and all pushes of a loop are computed from the same positions, so nobody is first.
//! The engine's own steering is not known; what a player would recognise is kept: walkers push idle friends aside, nobody
//! pushes a unit that is attacking, enemies block each other, and units slide round obstacles instead of stopping.

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
    /// Attacking: nobody pushes it.
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

/// A walker's wish: the unit vector to its destination and the distance.
#[derive(Debug, Clone, Copy)]
struct Wish {
    ahead: [f32; 2],
    distance: f32,
}

/// Gap to an obstacle, in map units, at which a walker begins to step round it.
pub(super) const LOOKAHEAD: f32 = 0.5;
/// Loops for which a walker keeps the side on which it steps round.
const DETOUR_LOOPS: u8 = 8;
/// Rounds of pushing apart in a loop, at most.
const PUSH_ROUNDS: usize = 2;
/// Map units that a round pushes a unit along an axis, at most.
const GREATEST_PUSH: f32 = 0.07;
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
        self.scratch.steps.x[index] = x + way_x * stride;
        self.scratch.steps.y[index] = y + way_y * stride;
    }

    /// The unit vector along which a walker goes: towards its destination if nothing blocks it, else the tangent of the
    /// obstacle that turns it the most, on the side where that is less; if both sides are equal, towards greater y. All
    /// obstacles are looked at before a side is chosen, so that the order of units in the arrays is of no consequence.
    fn way_round(&mut self, index: usize, wish: Wish) -> [f32; 2] {
        let (state, neighbours) = (&mut self.state, &self.scratch.neighbours);
        let (x, y) = (state.x[index], state.y[index]);
        // Per side, left and right: the obstacle that turns the walker the most, and the cosine of the turn.
        let mut tangents = [(wish.ahead, 1.0_f32); 2];
        for &other in neighbours.of(index) {
            let other = usize::from(other);
            if !blocks(
                self.scratch.footing[other],
                neighbours.are_friends(index, other),
            ) {
                continue;
            }
            let toward = [state.x[other] - x, state.y[other] - y];
            let Some(across) = wish.obstructed(toward, neighbours.touch(index, other)) else {
                continue;
            };
            let square = toward[0] * toward[0] + toward[1] * toward[1];
            let scale = 1.0 / square.max(1e-12).sqrt();
            for (tangent, side) in tangents.iter_mut().zip([scale, -scale]) {
                let along = -across * side;
                if along < tangent.1 {
                    *tangent = ([-toward[1] * side, toward[0] * side], along);
                }
            }
        }
        let unit = &mut state.units[index];
        unit.detour_loops = unit.detour_loops.saturating_sub(1);
        let [left, right] = tangents;
        if left.1 == 1.0 && right.1 == 1.0 {
            return wish.ahead;
        }
        let goes_left = if unit.detour_loops > 0 {
            unit.detour > 0
        } else if left.1 == right.1 {
            wish.ahead[0] >= 0.0
        } else {
            left.1 > right.1
        };
        unit.detour = if goes_left { 1 } else { -1 };
        unit.detour_loops = DETOUR_LOOPS;
        if goes_left { left.0 } else { right.0 }
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
            (state.x[index], state.y[index]) = (x, y);
        }
    }
}

impl Wish {
    /// Whether an obstacle that lies `toward` and is touched at distance `touch` is in the way; if so, how far it lies to the
    /// left (negative: to the right) of the straight way.
    fn obstructed(&self, toward: [f32; 2], touch: f32) -> Option<f32> {
        let [px, py] = toward;
        let forward = px * self.ahead[0] + py * self.ahead[1];
        let across = self.ahead[0] * py - self.ahead[1] * px;
        let near = touch + LOOKAHEAD;
        let is_destination = forward >= self.distance - 1e-3 && across.abs() < 1e-3;
        let is_in_the_way = forward > 0.0
            && across.abs() < touch
            && px * px + py * py < near * near
            && !is_destination;
        is_in_the_way.then_some(across)
    }
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
        self.push_x[i] -= ux * overlap * share_i;
        self.push_y[i] -= uy * overlap * share_i;
        self.push_x[j] += ux * overlap * share_j;
        self.push_y[j] += uy * overlap * share_j;
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

/// How readily a unit gives way: walkers do, idle units do to friends, attackers do not.
fn readiness(footing: Footing, are_friends: bool) -> f32 {
    match footing {
        Footing::Walking => 1.0,
        Footing::Standing if are_friends => 0.5,
        Footing::Standing | Footing::Braced | Footing::Gone => 0.0,
    }
}
