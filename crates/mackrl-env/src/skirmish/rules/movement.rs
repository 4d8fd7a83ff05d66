//! Walking, stepping round each other, and staying apart.
//!
//! Every walker steps towards its destination, along the tangent of whoever stands in its way; then overlaps are shared out
//! and walls push back. All steps and all pushes of a loop are computed from the same positions, so nobody is first.
//! The engine's own steering is not known; what a player would recognise is kept: walkers push idle friends aside, nobody
//! pushes a unit that is attacking, enemies block each other, and units slide round obstacles instead of stopping.

use crate::skirmish::rules::{Battle, Team};

/// How firmly a unit stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Footing {
    /// On the move.
    Walking,
    /// Idle: walking friends push it aside.
    Standing,
    /// Attacking: nobody pushes it.
    Braced,
}

/// Living units in compact arrays, which the loops over pairs run through.
#[derive(Debug, Clone, Default)]
pub(super) struct Neighbours {
    x: Vec<f32>,
    y: Vec<f32>,
    radius: Vec<f32>,
    footing: Vec<Footing>,
    team: Vec<Team>,
    index: Vec<usize>,
    push_x: Vec<f32>,
    push_y: Vec<f32>,
}

/// Gap to an obstacle, in map units, at which a walker begins to step round it.
const LOOKAHEAD: f32 = 0.5;
/// Loops for which a walker keeps the side on which it steps round.
const DETOUR_LOOPS: u8 = 8;
/// Rounds of pushing apart in a loop, at most.
const PUSH_ROUNDS: usize = 3;
/// Overlap in map units that is left alone.
const OVERLAP_TOLERANCE: f32 = 1e-3;

impl Neighbours {
    pub(super) fn reserve(&mut self, units: usize) {
        self.clear();
        self.x.reserve(units);
        self.y.reserve(units);
        self.radius.reserve(units);
        self.footing.reserve(units);
        self.team.reserve(units);
        self.index.reserve(units);
        self.push_x.reserve(units);
        self.push_y.reserve(units);
    }

    fn clear(&mut self) {
        self.x.clear();
        self.y.clear();
        self.radius.clear();
        self.footing.clear();
        self.team.clear();
        self.index.clear();
    }

    fn len(&self) -> usize {
        self.index.len()
    }

    /// Whether `other` is in the way of a walker of `team`: it will not move aside.
    fn blocks(&self, other: usize, team: Team) -> bool {
        match self.footing[other] {
            Footing::Braced => true,
            Footing::Standing => self.team[other] != team,
            Footing::Walking => false,
        }
    }
}

impl Battle {
    /// Moves every walker by one loop and resolves what overlaps.
    pub(super) fn walk(&mut self) {
        self.gather();
        self.step_forward();
        for _ in 0..PUSH_ROUNDS {
            if !push_apart(&mut self.scratch.neighbours) {
                break;
            }
        }
        self.settle();
    }

    fn gather(&mut self) {
        let neighbours = &mut self.scratch.neighbours;
        neighbours.clear();
        for (index, unit) in self.state.units.iter().enumerate() {
            if unit.life > 0.0 {
                neighbours.x.push(self.state.x[index]);
                neighbours.y.push(self.state.y[index]);
                let profile = &self.field.profiles[usize::from(unit.kind)];
                neighbours.radius.push(profile.separation_radius);
                neighbours.footing.push(self.scratch.footing[index]);
                neighbours.team.push(unit.team);
                neighbours.index.push(index);
            }
        }
    }

    /// Steps of all walkers, computed from the positions in `state` and written to the neighbours' positions.
    fn step_forward(&mut self) {
        for slot in 0..self.scratch.neighbours.len() {
            let index = self.scratch.neighbours.index[slot];
            let Some([to_x, to_y]) = self.scratch.destination[index] else {
                continue;
            };
            let (x, y) = (self.state.x[index], self.state.y[index]);
            let (dx, dy) = (to_x - x, to_y - y);
            let distance = (dx * dx + dy * dy).sqrt();
            if distance == 0.0 {
                continue;
            }
            let speed = self.field.profiles[usize::from(self.state.units[index].kind)].speed;
            let stride = speed.min(distance);
            let ahead = [dx / distance, dy / distance];
            let [way_x, way_y] = self.way_round(slot, index, ahead, distance);
            self.scratch.neighbours.x[slot] = x + way_x * stride;
            self.scratch.neighbours.y[slot] = y + way_y * stride;
        }
    }

    /// The unit vector along which a walker goes that wants to go `ahead`: the same if nothing blocks it, else the tangent,
    /// on the side that it is passing, of the obstacle that turns it the most.
    fn way_round(&mut self, slot: usize, index: usize, ahead: [f32; 2], distance: f32) -> [f32; 2] {
        let neighbours = &self.scratch.neighbours;
        let (xs, ys) = (&self.state.x, &self.state.y);
        let own = (xs[index], ys[index]);
        let (radius, team) = (neighbours.radius[slot], neighbours.team[slot]);
        let unit = &mut self.state.units[index];
        unit.detour_loops = unit.detour_loops.saturating_sub(1);
        let mut side = if unit.detour_loops > 0 {
            f32::from(unit.detour)
        } else {
            0.0
        };
        let mut way = ahead;
        let mut turned = 1.0;
        for other in 0..neighbours.len() {
            if other == slot || !neighbours.blocks(other, team) {
                continue;
            }
            let there = neighbours.index[other];
            let (px, py) = (xs[there] - own.0, ys[there] - own.1);
            let touch = radius + neighbours.radius[other];
            let square = px * px + py * py;
            let near = touch + LOOKAHEAD;
            let forward = px * ahead[0] + py * ahead[1];
            let across = ahead[0] * py - ahead[1] * px;
            let is_destination = forward >= distance - 1e-3 && across.abs() < 1e-3;
            if square >= near * near || forward <= 0.0 || across.abs() >= touch || is_destination {
                continue;
            }
            if side == 0.0 {
                // Pass on the side where less of the obstacle is; straight ahead, towards greater y.
                let left = if across == 0.0 {
                    ahead[0] >= 0.0
                } else {
                    across < 0.0
                };
                side = if left { 1.0 } else { -1.0 };
            }
            let scale = side / square.max(1e-12).sqrt();
            let tangent = [-py * scale, px * scale];
            let along = tangent[0] * ahead[0] + tangent[1] * ahead[1];
            if along < turned {
                (way, turned) = (tangent, along);
            }
        }
        if turned < 1.0 {
            unit.detour = if side > 0.0 { 1 } else { -1 };
            unit.detour_loops = DETOUR_LOOPS;
        }
        way
    }

    /// Takes the new positions over, off the walls. A walker that a wall stops passes its obstacle on the other side.
    fn settle(&mut self) {
        let neighbours = &self.scratch.neighbours;
        for slot in 0..neighbours.len() {
            let index = neighbours.index[slot];
            let unit = &mut self.state.units[index];
            let profile = &self.field.profiles[usize::from(unit.kind)];
            let (new_x, new_y) = (neighbours.x[slot], neighbours.y[slot]);
            if (new_x, new_y) == (self.state.x[index], self.state.y[index]) {
                continue;
            }
            let (x, y) = self
                .field
                .terrain
                .pushed_out_of_walls(new_x, new_y, profile.inner_radius);
            let back = (x - new_x).abs() + (y - new_y).abs();
            if unit.detour_loops > 0 && back > 0.5 * profile.speed {
                unit.detour = -unit.detour;
                unit.detour_loops = 2 * DETOUR_LOOPS;
            }
            (self.state.x[index], self.state.y[index]) = (x, y);
        }
    }
}

/// Pushes overlapping units apart once; returns whether any overlapped.
fn push_apart(neighbours: &mut Neighbours) -> bool {
    let count = neighbours.len();
    let mut overlapped = false;
    for i in 0..count {
        let (x, y, radius) = (neighbours.x[i], neighbours.y[i], neighbours.radius[i]);
        for j in i + 1..count {
            let (dx, dy) = (neighbours.x[j] - x, neighbours.y[j] - y);
            let touch = radius + neighbours.radius[j];
            let square = dx * dx + dy * dy;
            if square < touch * touch {
                if !overlapped {
                    neighbours.push_x.clear();
                    neighbours.push_x.resize(count, 0.0);
                    neighbours.push_y.clear();
                    neighbours.push_y.resize(count, 0.0);
                    overlapped = true;
                }
                share_out(neighbours, i, j, [dx, dy, square.sqrt(), touch]);
            }
        }
    }
    if overlapped {
        for i in 0..count {
            neighbours.x[i] += neighbours.push_x[i];
            neighbours.y[i] += neighbours.push_y[i];
        }
    }
    overlapped
}

/// Adds what the overlap of `i` and `j` moves each.
fn share_out(neighbours: &mut Neighbours, i: usize, j: usize, [dx, dy, distance, touch]: [f32; 4]) {
    let overlap = touch - distance;
    if overlap < OVERLAP_TOLERANCE {
        return;
    }
    let (weight_i, weight_j) = (give_way(neighbours, i, j), give_way(neighbours, j, i));
    let total = weight_i + weight_j;
    let (share_i, share_j) = if total > 0.0 {
        (weight_i / total, weight_j / total)
    } else {
        (0.5, 0.5)
    };
    // Units on the very same spot part along y.
    let (ux, uy) = if distance > 1e-6 {
        (dx / distance, dy / distance)
    } else {
        (0.0, 1.0)
    };
    neighbours.push_x[i] -= ux * overlap * share_i;
    neighbours.push_y[i] -= uy * overlap * share_i;
    neighbours.push_x[j] += ux * overlap * share_j;
    neighbours.push_y[j] += uy * overlap * share_j;
}

/// How readily `unit` gives way to `other`: walkers do, idle units do to friends, attackers do not.
fn give_way(neighbours: &Neighbours, unit: usize, other: usize) -> f32 {
    match neighbours.footing[unit] {
        Footing::Walking => 1.0,
        Footing::Standing if neighbours.team[unit] == neighbours.team[other] => 0.5,
        Footing::Standing | Footing::Braced => 0.0,
    }
}
