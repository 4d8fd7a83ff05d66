//! What aggressive units do unasked: scan, acquire, retarget, answer attacks, call for help, give up.
//!
//! The game data give ranges (scan, help, leash); how often the engine looks and how it breaks ties is not known. Here every
//! unit looks each quarter of a second, and at once when its quarry has died. Without a quarry it takes the nearest target
//! that it notices. It keeps its quarry until one of the two is dead; only if the quarry is out of reach and another is in reach
//! it turns to that. One that notices nobody helps friends near it that fight. Fog is lifted on these maps, so sight plays no part.

use crate::rules::{
    Battle, Order, Stance, UnitIndex,
    combat::small,
    neighbours::{Discs, LANES, Lane, Places},
};

/// Map units to a friend that fights within which a unit that fights nobody takes that friend's quarry: the radius of a call for
/// help. Without it stragglers survive too long where armies are large: 25 marines take 2 steps longer.
const SUPPORT_RADIUS: f32 = 4.0;
/// Loops between two looks for a quarry. With 4 and more 25 marines at random do more damage than in recorded runs.
const RESCAN_LOOPS: f32 = 2.0;
/// Map units beyond the scan range of the data in which units notice targets. With 0.4 enemies walk past agents that the game's
/// enemies find, and random play with 25 marines lasts 41 steps where the game's lasts 37; with more than 1.1 they find teams that
/// hide at the northern edge of 3m, which 57 of 144 such teams of recorded runs did unfound.
const NOTICE_MARGIN: f32 = 0.9;
/// Square of a distance greater than any on the map.
const EVERYWHERE: f32 = 1e6;
/// Difference of squared distances, in squared map units, below which two targets are equally near.
const NEARNESS_TOLERANCE: f32 = 1e-3;

impl Battle {
    /// Lets every living aggressive unit keep, change or find its quarry.
    pub(super) fn choose_quarries(&mut self) {
        self.scratch.has_targets = false;
        for index in 0..self.state.units.len() {
            let unit = &self.state.units[index];
            let is_free = matches!(
                unit.order,
                Order::Stop | Order::AttackMove { .. } | Order::Hunt
            );
            if unit.stance == Stance::Aggressive && unit.is_alive() && is_free {
                self.choose_quarry(index);
                self.note_idleness(index);
            }
        }
        self.support_friends();
    }

    /// Notes a unit that has just looked and found nobody.
    fn note_idleness(&mut self, index: usize) {
        let unit = &self.state.units[index];
        let has_just_looked = unit.rescan == RESCAN_LOOPS && unit.swing.is_none();
        if has_just_looked && unit.quarry.is_none() && unit.order != Order::Hunt {
            self.scratch.idle.push(index);
        }
    }

    /// Lists the living of each team, once in a loop in which somebody looks.
    fn list_targets(&mut self) {
        if std::mem::replace(&mut self.scratch.has_targets, true) {
            return;
        }
        let (state, targets) = (&self.state, &mut self.scratch.targets);
        targets.iter_mut().for_each(Discs::clear);
        for (index, unit) in state.units.iter().enumerate() {
            if unit.is_alive() {
                let radius = self.field.profiles[usize::from(unit.kind)].radius;
                let position = [state.x[index], state.y[index]];
                targets[unit.team as usize].push(small(index), position, radius);
            }
        }
    }

    /// Lets those who have just looked and found nobody help friends near them that fight. That comes after everybody's own
    /// choice, so that the order of units in the arrays is of no consequence.
    fn support_friends(&mut self) {
        for number in 0..self.scratch.idle.len() {
            let index = self.scratch.idle[number];
            self.list_targets();
            if let Some(quarry) = self.quarry_to_support(index) {
                self.scratch.supports.push((index, quarry));
            }
        }
        self.scratch.idle.clear();
        for number in 0..self.scratch.supports.len() {
            let (index, quarry) = self.scratch.supports[number];
            self.engage(index, quarry);
        }
        self.scratch.supports.clear();
    }

    fn choose_quarry(&mut self, index: usize) {
        self.give_up_lost_quarry(index);
        let unit = &mut self.state.units[index];
        unit.rescan = (unit.rescan - 1.0).max(0.0);
        if unit.swing.is_some() {
            return;
        }
        if unit.rescan > 0.0 {
            return;
        }
        unit.rescan = RESCAN_LOOPS;
        if let Some(quarry) = unit.quarry
            && self.is_in_reach(index, usize::from(quarry))
        {
            return;
        }
        self.list_targets();
        let found = self.nearest_target(index, false);
        let is_chasing = self.state.units[index].quarry.is_some();
        if is_chasing && !found.is_some_and(|other| self.is_in_reach(index, usize::from(other))) {
            return;
        }
        let hunts = self.state.units[index].order == Order::Hunt;
        let found = found.or_else(|| hunts.then(|| self.nearest_target(index, true)).flatten());
        if let Some(target) = found {
            self.engage(index, target);
        }
    }

    fn give_up_lost_quarry(&mut self, index: usize) {
        let unit = &self.state.units[index];
        let Some(quarry) = unit.quarry else { return };
        let [from_x, from_y] = unit.chase_from;
        let (dx, dy) = (self.state.x[index] - from_x, self.state.y[index] - from_y);
        let is_leashed = unit.order != Order::Hunt && dx * dx + dy * dy > self.field.leash_squared;
        if is_leashed || !self.state.units[usize::from(quarry)].is_alive() {
            let unit = &mut self.state.units[index];
            unit.quarry = None;
            unit.swing = None;
            unit.rescan = 0.0;
        }
    }

    /// Whether `target` is within the weapon range of `index`.
    fn is_in_reach(&self, index: usize, target: usize) -> bool {
        let own = &self.field.profiles[usize::from(self.state.units[index].kind)];
        let other = &self.field.profiles[usize::from(self.state.units[target].kind)];
        own.strike.as_ref().is_some_and(|strike| {
            self.state.distance_squared(index, target) <= strike.reach_squared(own, other)
        })
    }

    /// The nearest unit that a friend near `index` fights.
    fn quarry_to_support(&self, index: usize) -> Option<UnitIndex> {
        let team = self.state.units[index].team;
        let position = [self.state.x[index], self.state.y[index]];
        let mut nearest = Nearest::default();
        for row in self.scratch.targets[team as usize].rows() {
            let squares = row.squares(position);
            for place in Places::of_not_less([SUPPORT_RADIUS * SUPPORT_RADIUS; LANES], squares) {
                let friend = &self.state.units[usize::from(row.unit[place])];
                let Some(quarry) = friend.quarry.map(usize::from) else {
                    continue;
                };
                // What a healer has chosen is a friend.
                let is_enemy = self.state.units[quarry].team != team;
                if is_enemy && self.can_attack(index, quarry) {
                    let square = self.state.distance_squared(index, quarry);
                    nearest.consider(quarry, square, self.state.y[quarry]);
                }
            }
        }
        nearest.unit()
    }

    /// The nearest unit of the other side that `index` can attack, within its scan range or anywhere. All types have the same
    /// priority.
    fn nearest_target(&self, index: usize, anywhere: bool) -> Option<UnitIndex> {
        let unit = &self.state.units[index];
        let own = &self.field.profiles[usize::from(unit.kind)];
        let strike = own.strike.as_ref()?;
        let position = [self.state.x[index], self.state.y[index]];
        let notice = own.scan_range + NOTICE_MARGIN + own.radius;
        let mut nearest = Nearest::default();
        for row in self.scratch.targets[unit.team.other() as usize].rows() {
            let squares = row.squares(position);
            let mut candidates = Places::of_less(squares, nearest.limits());
            if !anywhere {
                let noticed = Places::of_not_less(row.reaches_squared(notice, 0.0), squares);
                candidates = candidates.and(noticed);
            }
            for place in candidates {
                let other = usize::from(row.unit[place]);
                if strike.effects[usize::from(self.state.units[other].kind)].can_hit {
                    nearest.consider(other, squares[place], row.y[place]);
                }
            }
        }
        nearest.unit()
    }

    fn engage(&mut self, index: usize, target: UnitIndex) {
        let position = [self.state.x[index], self.state.y[index]];
        let unit = &mut self.state.units[index];
        if unit.quarry.is_none() {
            unit.chase_from = position;
        }
        unit.quarry = Some(target);
        unit.rescan = RESCAN_LOOPS;
    }

    /// Lets those who fight nobody answer the hits of this loop: their own, and those of friends who call for help. Each turns
    /// on the nearest of these attackers. The dead call too: their friends saw the shot.
    pub(super) fn respond(&mut self) {
        if self.scratch.hits.is_empty() {
            return;
        }
        for index in 0..self.state.units.len() {
            let unit = &self.state.units[index];
            let is_free = matches!(
                unit.order,
                Order::Stop | Order::AttackMove { .. } | Order::Hunt
            );
            let answers = unit.stance == Stance::Aggressive
                && unit.is_alive()
                && unit.quarry.is_none()
                && is_free;
            if answers && let Some(attacker) = self.nearest_attacker(index) {
                self.engage(index, attacker);
            }
        }
        for hit in &self.scratch.hits {
            let victim = &mut self.state.units[usize::from(hit.target)];
            if victim.call_wait <= 0.0 {
                victim.call_wait = self.field.help_period_loops;
            }
        }
    }

    /// The nearest of those who in this loop hit `index` or a friend whose call it hears.
    fn nearest_attacker(&self, index: usize) -> Option<UnitIndex> {
        let mut nearest = Nearest::default();
        for hit in &self.scratch.hits {
            let (victim, attacker) = (usize::from(hit.target), usize::from(hit.attacker));
            let friend = &self.state.units[victim];
            let hears = friend.team == self.state.units[index].team
                && friend.call_wait <= 0.0
                && self.state.distance_squared(index, victim) <= self.field.help_radius_squared;
            if (victim == index || hears) && self.can_attack(index, attacker) {
                let square = self.state.distance_squared(index, attacker);
                nearest.consider(attacker, square, self.state.y[attacker]);
            }
        }
        nearest.unit()
    }
}

/// Keeps the nearest of some units. Of two that are equally near, but for a tolerance, it is the one of smaller y: a rule by
/// index would have one army focus its fire by accident and its mirror image not.
struct Nearest {
    found: Option<usize>,
    square: f32,
    y: f32,
}

impl Default for Nearest {
    fn default() -> Self {
        Self {
            found: None,
            square: f32::INFINITY,
            y: f32::INFINITY,
        }
    }
}

impl Nearest {
    fn consider(&mut self, unit: usize, square: f32, y: f32) {
        let is_nearer = square < self.square - NEARNESS_TOLERANCE
            || square < self.square + NEARNESS_TOLERANCE && y < self.y;
        if is_nearer {
            (self.found, self.square, self.y) = (Some(unit), square, y);
        }
    }

    /// Squares of distances from which on none of a row is considered.
    fn limits(&self) -> Lane {
        [(self.square + NEARNESS_TOLERANCE).min(EVERYWHERE); LANES]
    }

    fn unit(&self) -> Option<UnitIndex> {
        self.found.and_then(|unit| UnitIndex::try_from(unit).ok())
    }
}
