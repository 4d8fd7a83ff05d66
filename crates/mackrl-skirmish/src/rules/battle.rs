//! A battle and its clock.

use std::sync::Arc;

use crate::rules::{
    BattleState, Battlefield, Chance, Order, Stance, Team, Unit, UnitIndex,
    combat::Hit,
    movement::{Footing, Plane, on_grid},
    neighbours::Discs,
    obstacles::Obstacles,
};

/// A battle: what changes, on what does not.
#[derive(Debug)]
pub struct Battle {
    pub(super) field: Arc<Battlefield>,
    pub(super) state: BattleState,
    pub(super) scratch: Scratch,
}

/// Buffers that live for one loop, kept so that a loop allocates nothing.
#[derive(Debug, Clone, Default)]
pub(super) struct Scratch {
    /// Where each unit wants to walk in this loop, if anywhere.
    pub(super) destination: Vec<Option<[f32; 2]>>,
    /// How each unit stands in this loop.
    pub(super) footing: Vec<Footing>,
    /// Hits that land at the end of this loop.
    pub(super) hits: Vec<Hit>,
    /// Healers and their patients in this loop.
    pub(super) treatments: Vec<(usize, usize)>,
    /// Units that have looked for a quarry in this loop and found none.
    pub(super) idle: Vec<usize>,
    /// Units that come to help a friend in this loop, and whom they fight.
    pub(super) supports: Vec<(usize, UnitIndex)>,
    /// Units that explode at the end of this loop.
    pub(super) exploding: Vec<usize>,
    /// The living on the ground, and those above it.
    pub(super) planes: [Plane; 2],
    /// The living of each team, with the radii that ranges are measured from.
    pub(super) targets: [Discs; 2],
    /// Whether they were listed in this loop.
    pub(super) has_targets: bool,
    /// What does not move aside for the walker at hand.
    pub(super) obstacles: Obstacles,
}

impl Battle {
    /// An empty battle with room for `capacity` units.
    #[must_use]
    pub fn new(field: Arc<Battlefield>, capacity: usize) -> Self {
        let mut battle = Self {
            field,
            state: BattleState::default(),
            scratch: Scratch::default(),
        };
        battle.reserve(capacity);
        battle
    }

    /// What changes.
    #[must_use]
    pub fn state(&self) -> &BattleState {
        &self.state
    }

    /// What never changes.
    #[must_use]
    pub fn field(&self) -> &Battlefield {
        &self.field
    }

    /// Goes back (or forth) to `state`, which a battle on the same battlefield was in.
    pub fn restore(&mut self, state: &BattleState) {
        self.state.x.clone_from(&state.x);
        self.state.y.clone_from(&state.y);
        self.state.units.clone_from(&state.units);
        self.state.missiles.clone_from(&state.missiles);
        self.state.blows.clone_from(&state.blows);
        self.reserve(self.state.units.len());
    }

    /// Puts a fresh unit of the given kind on the field; returns its index.
    ///
    /// # Panics
    /// If `kind` is not among the battlefield's profiles, or there are 256 units already.
    pub fn add(&mut self, kind: u8, team: Team, stance: Stance, [x, y]: [f32; 2]) -> UnitIndex {
        let profile = &self.field.profiles[usize::from(kind)];
        let index = UnitIndex::try_from(self.state.units.len()).expect("a battle has ≤ 256 units");
        let [x, y] = [x, y].map(on_grid);
        self.state.x.push(x);
        self.state.y.push(y);
        self.state.units.push(Unit {
            kind,
            team,
            stance,
            life: profile.life,
            shield: profile.shield,
            energy: profile.energy,
            pace: 0.0,
            order: Order::Stop,
            quarry: None,
            chase_from: [x, y],
            rescan: 0.0,
            cooldown: 0.0,
            swing: None,
            backswing: 0.0,
            unharmed: self.field.shield_delay_loops,
            call_wait: 0.0,
            detour: 0,
            detour_loops: 0,
        });
        self.reserve(self.state.units.len());
        index
    }

    /// Gives a living unit an order. An order that it already has changes nothing; another one ends an attack that has not
    /// reached its damage point. One that it cannot obey (to attack what its weapon does not reach, to heal the whole or the
    /// mechanical) is refused, and it goes on with what it was doing.
    pub fn order(&mut self, unit: UnitIndex, order: Order) {
        let is_refused = match order {
            Order::Attack { target } => !self.can_attack(usize::from(unit), usize::from(target)),
            Order::Heal { target } => !self.can_heal(usize::from(unit), usize::from(target)),
            _ => false,
        };
        if is_refused {
            return;
        }
        let unit = &mut self.state.units[usize::from(unit)];
        if unit.is_alive() && unit.order != order {
            unit.order = order;
            unit.quarry = None;
            unit.swing = None;
            unit.backswing = 0.0;
            unit.detour_loops = 0;
        }
    }

    /// Lets a unit stand for so many loops, in which it looks for nobody.
    pub fn hold(&mut self, unit: UnitIndex, loops: f32) {
        let unit = &mut self.state.units[usize::from(unit)];
        unit.backswing = loops;
        unit.rescan = loops;
    }

    /// Takes a unit off the field: it is dead, without the effects that a death in battle has.
    pub fn remove(&mut self, unit: UnitIndex) {
        let unit = &mut self.state.units[usize::from(unit)];
        unit.life = 0.0;
        unit.shield = 0.0;
    }

    /// Plays one loop.
    pub fn advance(&mut self, chance: &mut Chance) {
        self.choose_quarries();
        self.act(chance);
        self.walk();
        self.fly_missiles();
        self.count_down_blows();
        self.land_hits();
        self.treat();
        self.regenerate();
    }

    fn reserve(&mut self, units: usize) {
        // On the shipped maps four per unit are never reached. A crowd of one's own in front of many beams can have more: then
        // the list grows once, and stays as long.
        make_room(&mut self.state.missiles, 4 * units);
        make_room(&mut self.state.blows, 4 * units);
        make_room(&mut self.scratch.hits, 4 * units);
        make_room(&mut self.scratch.exploding, units);
        make_room(&mut self.scratch.treatments, units);
        make_room(&mut self.scratch.idle, units);
        make_room(&mut self.scratch.supports, units);
        self.scratch.obstacles.reserve(units);
        self.scratch.destination.resize(units, None);
        self.scratch.footing.resize(units, Footing::Standing);
        for targets in &mut self.scratch.targets {
            targets.reserve(units);
        }
        for plane in &mut self.scratch.planes {
            plane.reserve(units);
        }
    }
}

/// A copy has the room of its original, so that it allocates as little from its first loop on.
impl Clone for Battle {
    fn clone(&self) -> Self {
        let mut battle = Self {
            field: Arc::clone(&self.field),
            state: self.state.clone(),
            scratch: self.scratch.clone(),
        };
        battle.reserve(battle.state.units.len());
        battle
    }
}

/// Sees to it that `list` can hold `length` elements without growing, those that it holds now included.
pub(super) fn make_room<T>(list: &mut Vec<T>, length: usize) {
    list.reserve(length.saturating_sub(list.len()));
}
