//! Who is near whom, so that movement does not look at all pairs in every loop.
//!
//! For each unit a list of those that a walker could take notice of within the next loops, in ascending order, and a shorter one of
//! those of higher indices that it could touch. Lists are renewed when
//! somebody has moved far enough that they could miss one. They hold more than is near, never less, so that what movement
//! computes does not depend on when they were renewed: a battle that is restored from its state goes on to the same bits.

use crate::{
    rules::{BattleState, Battlefield, battle::make_room, movement::LOOKAHEAD},
    unit_types::Layer,
};

/// Gap beyond which a pair is not listed, on top of the gap that movement asks about.
const SKIN: f32 = 2.0;
/// Distance that a unit may have moved before lists are renewed. In the loop that follows it moves by less than 0.25 for its
/// stride and 2 · 0.1 for pushes, so that it is within half the skin of where it was listed.
const RENEW_AT: f32 = 0.5;

/// Who can be in whose way: those of the same plane.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Plane {
    #[default]
    Gone,
    Ground,
    High,
}

/// For each unit a list of others, one behind the other.
#[derive(Debug, Clone, Default)]
struct Lists {
    list: Vec<u8>,
    /// Where each unit's list begins; one more than units.
    begin: Vec<u16>,
}

/// Lists of near units.
#[derive(Debug, Clone, Default)]
pub(super) struct Neighbours {
    /// Those that a walker takes notice of.
    noticed: Lists,
    /// Those of higher indices that touch.
    touching: Lists,
    listed_x: Vec<f32>,
    listed_y: Vec<f32>,
    radius: Vec<f32>,
    is_enemy: Vec<bool>,
    /// Per unit: where it is in others' way. The dead are in nobody's.
    plane: Vec<Plane>,
    is_valid: bool,
}

impl Neighbours {
    pub(super) fn reserve(&mut self, units: usize) {
        self.noticed.reserve(units);
        self.touching.reserve(units);
        self.listed_x.resize(units, 0.0);
        self.listed_y.resize(units, 0.0);
        self.radius.resize(units, 0.0);
        self.is_enemy.resize(units, false);
        self.plane.resize(units, Plane::Gone);
        self.is_valid = false;
    }

    /// Units that `index` could take notice of, ascending.
    pub(super) fn of(&self, index: usize) -> &[u8] {
        self.noticed.of(index)
    }

    /// Units with higher indices that could touch `index`, ascending.
    pub(super) fn after(&self, index: usize) -> &[u8] {
        self.touching.of(index)
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
            self.plane[index] = match profile.layer {
                _ if !unit.is_alive() => Plane::Gone,
                Layer::Ground => Plane::Ground,
                Layer::Tall | Layer::Air => Plane::High,
            };
            self.is_enemy[index] = unit.team == crate::rules::Team::Enemy;
        }
        let (mut noticed, mut touching) = (
            std::mem::take(&mut self.noticed),
            std::mem::take(&mut self.touching),
        );
        let units = state.units.len();
        noticed.renew(units, |list, index, end| {
            let end = self.list_range(list, index, 0..index, LOOKAHEAD, end);
            self.list_range(list, index, index + 1..units, LOOKAHEAD, end)
        });
        touching.renew(units, |list, index, end| {
            self.list_range(list, index, index + 1..units, 0.0, end)
        });
        (self.noticed, self.touching) = (noticed, touching);
    }

    /// Lists those of `range` that `gap` separates from `index` at most, in `list` from place `end` on; returns where they end.
    ///
    /// Everybody is written, and the place moves on only past those who are near: a branch that cannot be foreseen would cost
    /// more than the writing.
    fn list_range(
        &self,
        list: &mut [u8],
        index: usize,
        range: std::ops::Range<usize>,
        gap: f32,
        mut end: usize,
    ) -> usize {
        let plane = self.plane[index];
        if plane == Plane::Gone || range.is_empty() {
            return end;
        }
        let (x, y) = (self.listed_x[index], self.listed_y[index]);
        let reach = self.radius[index] + gap + SKIN;
        let others = self.listed_x[range.clone()]
            .iter()
            .zip(&self.listed_y[range.clone()])
            .zip(&self.radius[range.clone()])
            .zip(&self.plane[range.clone()]);
        for (other, (((other_x, other_y), radius), other_plane)) in range.zip(others) {
            let (dx, dy) = (other_x - x, other_y - y);
            let near = reach + radius;
            let is_listed = (dx * dx + dy * dy < near * near) & (*other_plane == plane);
            list[end] = u8::try_from(other).expect("a battle has ≤ 256 units");
            end += usize::from(is_listed);
        }
        end
    }
}

impl Lists {
    fn reserve(&mut self, units: usize) {
        self.list.resize(units * units, 0);
        make_room(&mut self.begin, units + 1);
    }

    fn of(&self, index: usize) -> &[u8] {
        &self.list[usize::from(self.begin[index])..usize::from(self.begin[index + 1])]
    }

    /// Lists anew: `fill` writes the list of a unit from a place on and returns where it ends.
    fn renew(&mut self, units: usize, fill: impl Fn(&mut [u8], usize, usize) -> usize) {
        self.begin.clear();
        let mut end = 0;
        for index in 0..units {
            self.begin.push(short(end));
            end = fill(&mut self.list, index, end);
        }
        self.begin.push(short(end));
    }
}

fn short(length: usize) -> u16 {
    u16::try_from(length).expect("256 units have fewer than 65 536 ordered pairs")
}
