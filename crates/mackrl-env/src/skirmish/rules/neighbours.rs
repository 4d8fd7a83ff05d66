//! Who is near whom, so that movement does not look at all pairs in every loop.
//!
//! For each unit a list of those that could come close within the next loops, in ascending order. Lists are renewed when
//! somebody has moved far enough that they could miss one. They hold more than is near, never less, so that what movement
//! computes does not depend on when they were renewed: a battle that is restored from its state goes on to the same bits.

use crate::skirmish::{
    rules::{BattleState, Battlefield, battle::make_room, movement::LOOKAHEAD},
    unit_types::Layer,
};

/// Gap beyond which a pair is not listed, on top of the gap that movement asks about.
const SKIN: f32 = 2.0;
/// Distance that a unit may have moved before lists are renewed. In the loop that follows it moves by less than 0.25 for its
/// stride and 2 · 0.1 for pushes, so that it is within half the skin of where it was listed.
const RENEW_AT: f32 = 0.5;

/// Lists of near units, one behind the other.
#[derive(Debug, Clone, Default)]
pub(super) struct Neighbours {
    list: Vec<u8>,
    /// Where each unit's list begins; one more than units.
    begin: Vec<u16>,
    /// Where the part of each unit's list begins that holds higher indices.
    middle: Vec<u16>,
    listed_x: Vec<f32>,
    listed_y: Vec<f32>,
    radius: Vec<f32>,
    is_enemy: Vec<bool>,
    is_on_ground: Vec<bool>,
    is_valid: bool,
}

impl Neighbours {
    pub(super) fn reserve(&mut self, units: usize) {
        make_room(&mut self.list, units * units);
        make_room(&mut self.begin, units + 1);
        make_room(&mut self.middle, units);
        self.listed_x.resize(units, 0.0);
        self.listed_y.resize(units, 0.0);
        self.radius.resize(units, 0.0);
        self.is_enemy.resize(units, false);
        self.is_on_ground.resize(units, true);
        self.is_valid = false;
    }

    /// Units near `index`, ascending.
    pub(super) fn of(&self, index: usize) -> &[u8] {
        &self.list[usize::from(self.begin[index])..usize::from(self.begin[index + 1])]
    }

    /// Units near `index` with higher indices, ascending.
    pub(super) fn after(&self, index: usize) -> &[u8] {
        &self.list[usize::from(self.middle[index])..usize::from(self.begin[index + 1])]
    }

    /// Distance between centres at which two units touch.
    pub(super) fn touch(&self, a: usize, b: usize) -> f32 {
        self.radius[a] + self.radius[b]
    }

    /// Whether two units are on the same side.
    pub(super) fn are_friends(&self, a: usize, b: usize) -> bool {
        self.is_enemy[a] == self.is_enemy[b]
    }

    /// Renews the lists if somebody has moved far.
    pub(super) fn refresh(&mut self, field: &Battlefield, state: &BattleState) {
        let has_moved_far = |(index, x): (usize, &f32)| {
            let (dx, dy) = (
                x - self.listed_x[index],
                state.y[index] - self.listed_y[index],
            );
            dx * dx + dy * dy > RENEW_AT * RENEW_AT
        };
        if !self.is_valid || state.x.iter().enumerate().any(has_moved_far) {
            self.renew(field, state);
        }
    }

    fn renew(&mut self, field: &Battlefield, state: &BattleState) {
        self.is_valid = true;
        self.listed_x.copy_from_slice(&state.x);
        self.listed_y.copy_from_slice(&state.y);
        for (index, unit) in state.units.iter().enumerate() {
            let profile = &field.profiles[usize::from(unit.kind)];
            self.radius[index] = profile.separation_radius;
            self.is_on_ground[index] = profile.layer == Layer::Ground;
            self.is_enemy[index] = unit.team == crate::skirmish::rules::Team::Enemy;
        }
        self.list.clear();
        self.begin.clear();
        self.middle.clear();
        for index in 0..state.units.len() {
            self.begin.push(short(self.list.len()));
            self.list_range(state, index, 0..index);
            self.middle.push(short(self.list.len()));
            self.list_range(state, index, index + 1..state.units.len());
        }
        self.begin.push(short(self.list.len()));
    }

    fn list_range(&mut self, state: &BattleState, index: usize, range: std::ops::Range<usize>) {
        if !state.units[index].is_alive() {
            return;
        }
        let (x, y, reach) = (
            state.x[index],
            state.y[index],
            self.radius[index] + LOOKAHEAD + SKIN,
        );
        for other in range {
            let (dx, dy) = (state.x[other] - x, state.y[other] - y);
            let near = reach + self.radius[other];
            if dx * dx + dy * dy < near * near
                && state.units[other].is_alive()
                && self.is_on_ground[index] == self.is_on_ground[other]
            {
                self.list
                    .push(u8::try_from(other).expect("a battle has ≤ 256 units"));
            }
        }
    }
}

fn short(length: usize) -> u16 {
    u16::try_from(length).expect("256 units have fewer than 65 536 ordered pairs")
}
