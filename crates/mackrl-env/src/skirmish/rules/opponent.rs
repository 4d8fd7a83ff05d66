//! What aggressive units do unasked: scan, acquire, retarget, answer attacks, call for help, give up.
//!
//! The game data give the ranges (scan, help, leash); how often the engine looks and how it breaks ties is not known. Here a
//! unit without a quarry looks in every loop and takes the nearest target that it notices; a unit whose quarry is in weapon
//! range stays with it until one is dead; one whose quarry is out of range looks again every half second and takes the
//! nearest. Fog is lifted on these maps, so sight plays no part.

use crate::skirmish::rules::{Battle, Order, Stance, UnitIndex};

/// Loops between two looks for a better quarry than one that is out of range.
const RESCAN_LOOPS: f32 = 8.0;

impl Battle {
    /// Lets every living aggressive unit keep, change or find its quarry.
    pub(super) fn choose_quarries(&mut self) {
        for index in 0..self.state.units.len() {
            let unit = &self.state.units[index];
            let is_free = matches!(
                unit.order,
                Order::Stop | Order::AttackMove { .. } | Order::Hunt
            );
            if unit.stance == Stance::Aggressive && unit.is_alive() && is_free {
                self.choose_quarry(index);
            }
        }
    }

    fn choose_quarry(&mut self, index: usize) {
        self.give_up_lost_quarry(index);
        let unit = &mut self.state.units[index];
        unit.rescan = (unit.rescan - 1.0).max(0.0);
        if unit.swing.is_some() {
            return;
        }
        if let Some(quarry) = unit.quarry
            && (unit.rescan > 0.0 || self.is_in_reach(index, usize::from(quarry)))
        {
            return;
        }
        let found = self.nearest_target(index, false);
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

    /// The nearest unit of the other side that `index` can attack, within its scan range or anywhere. All types have the same
    /// priority; of equally near ones the first is taken.
    fn nearest_target(&self, index: usize, anywhere: bool) -> Option<UnitIndex> {
        let unit = &self.state.units[index];
        let own = &self.field.profiles[usize::from(unit.kind)];
        let strike = own.strike.as_ref()?;
        let (x, y) = (self.state.x[index], self.state.y[index]);
        let mut nearest = None;
        let mut least = f32::INFINITY;
        for (other, candidate) in self.state.units.iter().enumerate() {
            if candidate.team == unit.team || !candidate.is_alive() {
                continue;
            }
            let (dx, dy) = (self.state.x[other] - x, self.state.y[other] - y);
            let square = dx * dx + dy * dy;
            let kind = usize::from(candidate.kind);
            let scan = own.scan_range + own.radius + self.field.profiles[kind].radius;
            if square < least && (anywhere || square <= scan * scan) && strike.effects[kind].can_hit
            {
                least = square;
                nearest = Some(other);
            }
        }
        nearest.and_then(|other| UnitIndex::try_from(other).ok())
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

    /// Answers a hit: an aggressive unit that fights nobody turns on its attacker, and calls its friends to do the same. The
    /// dead call too: their friends saw the shot.
    pub(super) fn respond(&mut self, victim: usize, attacker: usize) {
        let unit = &self.state.units[victim];
        if unit.stance != Stance::Aggressive || unit.call_wait > 0.0 && unit.quarry.is_some() {
            return;
        }
        self.turn_on(victim, attacker);
        if self.state.units[victim].call_wait > 0.0 {
            return;
        }
        self.state.units[victim].call_wait = self.field.help_period_loops;
        let team = self.state.units[victim].team;
        for friend in 0..self.state.units.len() {
            let hears = friend != victim
                && self.state.units[friend].team == team
                && self.state.distance_squared(victim, friend) <= self.field.help_radius_squared;
            if hears {
                self.turn_on(friend, attacker);
            }
        }
    }

    /// Makes `index` fight `attacker`, if it lives, fights unasked, is free to and can.
    fn turn_on(&mut self, index: usize, attacker: usize) {
        let unit = &self.state.units[index];
        let is_free = matches!(
            unit.order,
            Order::Stop | Order::AttackMove { .. } | Order::Hunt
        );
        if unit.stance == Stance::Aggressive
            && unit.is_alive()
            && unit.quarry.is_none()
            && is_free
            && self.can_attack(index, attacker)
            && let Ok(attacker) = UnitIndex::try_from(attacker)
        {
            self.engage(index, attacker);
        }
    }
}
