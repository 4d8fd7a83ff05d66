//! Walking, stepping round each other, and staying apart.
//!
//! Every walker steps towards its destination, round whoever stands in its way; then overlaps are shared out and walls push
//! back. All steps and all pushes of a loop are computed from the same positions, so nobody is first.
//!
//! The engine's own steering is not public. What is here was chosen by recorded runs of the game (`docs/fidelity.md`): a walker
//! goes round a row of fighters as round one obstacle, so that an army flows round those of it that fight; where the way round
//! would lead back, it goes straight on and pushes; friends that fight give way a little. Walkers push idle friends aside, and
//! enemies block each other.

use crate::{
    rules::{
        Battle, Team,
        combat::small,
        neighbours::{ALL, BEHIND, Discs, Places},
        obstacles::Wish,
    },
    terrain::Terrain,
    unit_types::Layer,
};

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

/// Who can be in whose way: those of the same plane.
#[derive(Debug, Clone, Default)]
pub(super) struct Plane {
    /// Where its living units are about to be.
    crowd: Discs,
    /// What blocks walkers of either team, where it stood at the loop's beginning.
    blockers: [Discs; 2],
    /// How each unit, by its index, is pushed in a round.
    pushes: Vec<[f32; 2]>,
}

/// Gap to an obstacle, in map units, at which a walker begins to step round it. With 0.5 a walker sees only the neighbour that it
/// runs into: stalkers and zealots then surround a team that stands sooner, in 42.6 steps, 42.9 here and 43.1 in recorded runs.
const LOOKAHEAD: f32 = 2.0;
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
/// Overlap in map units that is left alone.
const OVERLAP_TOLERANCE: f32 = 1e-3;

impl Plane {
    pub(super) fn reserve(&mut self, units: usize) {
        self.crowd.reserve(units);
        self.blockers
            .iter_mut()
            .for_each(|blockers| blockers.reserve(units));
        self.pushes.resize(units, [0.0; 2]);
    }

    fn clear(&mut self) {
        self.crowd.clear();
        self.blockers.iter_mut().for_each(Discs::clear);
    }
}

impl Battle {
    /// Moves every walker by one loop and resolves what overlaps.
    pub(super) fn walk(&mut self) {
        self.gather();
        for plane in 0..self.scratch.planes.len() {
            self.step_forward_all(plane);
            for _ in 0..PUSH_ROUNDS {
                if !self.push_apart(plane) {
                    break;
                }
            }
            self.settle(plane);
        }
    }

    /// Pushes everybody apart, as they stand, and off the walls, in so many rounds at most.
    pub(super) fn part(&mut self, rounds: usize) {
        for _ in 0..rounds {
            self.gather();
            let mut overlapped = false;
            for plane in 0..self.scratch.planes.len() {
                overlapped |= self.push_apart(plane);
                self.settle(plane);
            }
            if !overlapped {
                break;
            }
        }
    }

    /// Sorts the living by planes.
    fn gather(&mut self) {
        let (state, scratch) = (&self.state, &mut self.scratch);
        scratch.planes.iter_mut().for_each(Plane::clear);
        for (index, unit) in state.units.iter().enumerate() {
            let footing = scratch.footing[index];
            if !unit.is_alive() || footing == Footing::Gone {
                continue;
            }
            let profile = &self.field.profiles[usize::from(unit.kind)];
            let plane = &mut scratch.planes[usize::from(profile.layer != Layer::Ground)];
            let (position, radius) = ([state.x[index], state.y[index]], profile.separation_radius);
            plane.crowd.push(small(index), position, radius);
            for team in [Team::Ally, Team::Enemy] {
                if blocks(footing, team == unit.team) {
                    plane.blockers[team as usize].push(small(index), position, radius);
                }
            }
        }
    }

    fn step_forward_all(&mut self, plane: usize) {
        for row in 0..self.scratch.planes[plane].crowd.rows().len() {
            for place in 0..self.scratch.planes[plane].crowd.held(row) {
                let unit = usize::from(self.scratch.planes[plane].crowd.rows()[row].unit[place]);
                let Some(to) = self.scratch.destination[unit] else {
                    self.state.units[unit].pace = 0.0;
                    continue;
                };
                if let Some([x, y]) = self.step_forward(plane, unit, to) {
                    let row = &mut self.scratch.planes[plane].crowd.rows_mut()[row];
                    (row.x[place], row.y[place]) = (x, y);
                }
            }
        }
    }

    /// Where a walker's step leads, computed from the positions at the loop's beginning; `None` if it is where it wants to be.
    fn step_forward(&mut self, plane: usize, index: usize, to: [f32; 2]) -> Option<[f32; 2]> {
        let (x, y) = (self.state.x[index], self.state.y[index]);
        let profile = &self.field.profiles[usize::from(self.state.units[index].kind)];
        let [to_x, to_y] = match self.field.terrain.for_layer(profile.layer) {
            Some(terrain) => terrain.waypoint([x, y], to, profile.inner_radius),
            None => to,
        };
        let (dx, dy) = (to_x - x, to_y - y);
        let distance = (dx * dx + dy * dy).sqrt();
        if distance == 0.0 {
            return None;
        }
        let unit = &mut self.state.units[index];
        unit.pace = (unit.pace + profile.acceleration).min(profile.speed);
        let stride = unit.pace.min(distance);
        let ahead = [dx / distance, dy / distance];
        let [way_x, way_y] = self.way_round(plane, index, Wish { ahead, distance });
        Some([x + on_grid(way_x * stride), y + on_grid(way_y * stride)])
    }

    /// The unit vector along which a walker goes: towards its destination if nothing blocks it, else round what does, on the side
    /// where that is less of a turn; if both are equal, towards greater y. If either side would turn it back it goes straight on
    /// and pushes. All obstacles are looked at before a side is chosen, so that the order of units is of no consequence.
    fn way_round(&mut self, plane: usize, index: usize, wish: Wish) -> [f32; 2] {
        let is_free = self.note_obstacles(plane, index, wish);
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
    fn note_obstacles(&mut self, plane: usize, index: usize, wish: Wish) -> bool {
        let (state, scratch) = (&self.state, &mut self.scratch);
        let unit = &state.units[index];
        let radius = self.field.profiles[usize::from(unit.kind)].separation_radius;
        let [x, y] = [state.x[index], state.y[index]];
        scratch.obstacles.clear();
        for row in scratch.planes[plane].blockers[unit.team as usize].rows() {
            let reaches = row.reaches_squared(radius, LOOKAHEAD);
            for place in Places::of_less(row.squares([x, y]), reaches) {
                let toward = [row.x[place] - x, row.y[place] - y];
                if !wish.leads_to(toward) {
                    scratch.obstacles.push(toward, radius + row.radius[place]);
                }
            }
        }
        if scratch.obstacles.are_free(wish.ahead) {
            return true;
        }
        scratch.obstacles.find_tangents();
        false
    }

    /// Pushes overlapping units of a plane apart once; returns whether any overlapped.
    fn push_apart(&mut self, plane: usize) -> bool {
        let Plane { crowd, pushes, .. } = &mut self.scratch.planes[plane];
        let (footing, units) = (&self.scratch.footing, &self.state.units);
        let rows = crowd.rows();
        let mut overlapped = false;
        for (number, row) in rows.iter().enumerate() {
            for (place, behind) in BEHIND.iter().enumerate().take(crowd.held(number)) {
                let (x, y) = (row.x[place], row.y[place]);
                let (i, radius) = (usize::from(row.unit[place]), row.radius[place]);
                let mut mask = behind;
                for other in &rows[number..] {
                    let squares = other.squares([x, y]);
                    let slacks = other.reaches_squared(radius, -OVERLAP_TOLERANCE);
                    let touching = Places::of_less_among(mask, squares, slacks);
                    mask = &ALL;
                    for other_place in touching {
                        overlapped = true;
                        let j = usize::from(other.unit[other_place]);
                        let are_friends = units[i].team == units[j].team;
                        let [push_i, push_j] = parting(
                            [other.x[other_place] - x, other.y[other_place] - y],
                            radius + other.radius[other_place],
                            shares(footing[i], footing[j], are_friends),
                        );
                        pushes[i][0] -= push_i[0];
                        pushes[i][1] -= push_i[1];
                        pushes[j][0] += push_j[0];
                        pushes[j][1] += push_j[1];
                    }
                }
            }
        }
        if overlapped {
            for number in 0..crowd.rows().len() {
                let held = crowd.held(number);
                let row = &mut crowd.rows_mut()[number];
                for place in 0..held {
                    let push = &mut pushes[usize::from(row.unit[place])];
                    row.x[place] += push[0].clamp(-GREATEST_PUSH, GREATEST_PUSH);
                    row.y[place] += push[1].clamp(-GREATEST_PUSH, GREATEST_PUSH);
                }
            }
            pushes.fill([0.0; 2]);
        }
        overlapped
    }

    /// Takes the new positions over, off the walls. A walker that a wall stops passes its obstacle on the other side.
    fn settle(&mut self, plane: usize) {
        let state = &mut self.state;
        let crowd = &self.scratch.planes[plane].crowd;
        for (number, row) in crowd.rows().iter().enumerate() {
            for place in 0..crowd.held(number) {
                let index = usize::from(row.unit[place]);
                let (new_x, new_y) = (row.x[place], row.y[place]);
                if new_x == state.x[index] && new_y == state.y[index] {
                    continue;
                }
                let unit = &mut state.units[index];
                let profile = &self.field.profiles[usize::from(unit.kind)];
                let (x, y) = match self.field.terrain.for_layer(profile.layer) {
                    Some(terrain) => {
                        terrain.pushed_out_of_walls(new_x, new_y, profile.inner_radius)
                    }
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

/// What the overlap of two units moves each of them by, the first against `toward`, which leads from it to the second.
fn parting([dx, dy]: [f32; 2], touch: f32, shares: [f32; 2]) -> [[f32; 2]; 2] {
    let distance = (dx * dx + dy * dy).sqrt();
    let overlap = touch - distance;
    // Units on the very same spot part along y.
    let (ux, uy) = if distance > 1e-6 {
        (dx / distance, dy / distance)
    } else {
        (0.0, 1.0)
    };
    shares.map(|share| [ux, uy].map(|along| on_grid(along * overlap * share)))
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
