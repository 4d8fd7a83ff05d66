//! Units that heal: whom they choose, how they follow the army, what treatment costs.
//!
//! A healer treats one friend at a time, in range and without a pause, as long as it has energy. An aggressive one looks for
//! the nearest hurt friend in every loop in which it treats nobody. What the engine makes of a healer in an army that is sent
//! to attack is not known; here it flies to its place with the others but never alone: as long as it is out of range of all
//! fighting friends it goes to the nearest.

use crate::rules::{Battle, Battlefield, Care, Order, Stance, combat::small};

impl Battle {
    /// Whether `target` is a living friend that is hurt and that `index`, if it is a healer, can treat.
    pub(crate) fn can_heal(&self, index: usize, target: usize) -> bool {
        let (unit, other) = (&self.state.units[index], &self.state.units[target]);
        let profiles = &self.field.profiles;
        let care = &profiles[usize::from(unit.kind)].care;
        index != target
            && unit.team == other.team
            && other.is_alive()
            && other.life < profiles[usize::from(other.kind)].life
            && care
                .as_ref()
                .is_some_and(|care| care.can_heal[usize::from(other.kind)])
    }

    /// One loop of a healer: treat, go to a patient, or follow the order.
    pub(super) fn tend(&mut self, field: &Battlefield, index: usize, care: &Care) {
        let Some(patient) = self.patient_of(index, care) else {
            self.accompany(field, index, care);
            return;
        };
        if self.gap(index, patient) <= care.range {
            self.scratch.treatments.push((index, patient));
        } else {
            self.set_out(index, [self.state.x[patient], self.state.y[patient]]);
        }
    }

    /// Whom a healer treats: the friend of its order, or of its own choice.
    fn patient_of(&mut self, index: usize, care: &Care) -> Option<usize> {
        let unit = &self.state.units[index];
        if let Order::Heal { target } = unit.order {
            let target = usize::from(target);
            if self.can_heal(index, target) {
                return Some(target);
            }
            self.state.units[index].order = Order::Stop;
            return None;
        }
        if unit.stance != Stance::Aggressive || matches!(unit.order, Order::Move { .. }) {
            return None;
        }
        let current = unit
            .quarry
            .map(usize::from)
            .filter(|patient| unit.energy > 0.0 && self.can_heal(index, *patient));
        let patient = current.or_else(|| {
            (unit.energy >= care.autocast_energy)
                .then(|| self.nearest_patient(index, care))
                .flatten()
        });
        self.state.units[index].quarry = patient.map(small);
        patient
    }

    fn nearest_patient(&self, index: usize, care: &Care) -> Option<usize> {
        (0..self.state.units.len())
            .filter(|other| self.can_heal(index, *other))
            .map(|other| (self.gap(index, other), other))
            .filter(|(gap, _)| *gap <= care.autocast_range)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, other)| other)
    }

    /// Follows the order; sent to attack, stays within range of the fighters.
    fn accompany(&mut self, field: &Battlefield, index: usize, care: &Care) {
        let unit = &self.state.units[index];
        let marches = matches!(unit.order, Order::AttackMove { .. } | Order::Hunt);
        if marches && unit.stance == Stance::Aggressive {
            let fights = |other: &usize| {
                let friend = &self.state.units[*other];
                friend.team == unit.team
                    && friend.is_alive()
                    && field.profiles[usize::from(friend.kind)].strike.is_some()
            };
            let nearest = (0..self.state.units.len())
                .filter(fights)
                .map(|other| (self.gap(index, other), other))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((gap, friend)) = nearest
                && gap > care.range
            {
                self.set_out(index, [self.state.x[friend], self.state.y[friend]]);
                return;
            }
        }
        self.follow_order(index);
    }

    /// Distance from edge to edge.
    fn gap(&self, index: usize, other: usize) -> f32 {
        let radius =
            |unit: usize| self.field.profiles[usize::from(self.state.units[unit].kind)].radius;
        self.state.distance_squared(index, other).sqrt() - radius(index) - radius(other)
    }

    /// Gives the life of this loop's treatments, to those whom its hits left alive.
    pub(super) fn treat(&mut self) {
        let profiles = &self.field.profiles;
        for &(healer, patient) in &self.scratch.treatments {
            let Some(care) = &profiles[usize::from(self.state.units[healer].kind)].care else {
                continue;
            };
            let (energy, other) = (
                self.state.units[healer].energy,
                &mut self.state.units[patient],
            );
            if !other.is_alive() {
                continue;
            }
            let missing = profiles[usize::from(other.kind)].life - other.life;
            let given = care
                .life_per_loop
                .min(missing)
                .min(energy / care.energy_per_life);
            other.life += given;
            let energy = &mut self.state.units[healer].energy;
            *energy = (*energy - given * care.energy_per_life).max(0.0);
        }
        self.scratch.treatments.clear();
    }
}
