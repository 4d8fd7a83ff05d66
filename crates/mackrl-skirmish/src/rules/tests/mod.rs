//! Rules, one at a time, on units placed by hand. Numbers are those of the unit table.

use mackrl_env::{EpisodeKey, Stream};

use super::*;
use crate::{
    UnitData,
    terrain::{Terrain, TerrainName, cell_of},
    unit_types::{UnitType, UnitTypes},
};

mod colossus;
mod explosions;
mod healing;
mod movement;
mod reflexes;
mod regeneration;
mod rest;
mod saving;
mod symmetry;
mod table;
mod weapons;

use Stance::{Aggressive, Passive};
use Team::{Ally, Enemy};

/// A battle and its dice, with units named by type.
struct Arena {
    battle: Battle,
    chance: Chance,
}

impl Arena {
    /// The open field, every weapon period exact.
    fn new() -> Self {
        Self::on(TerrainName::Open, [0.0, 0.0])
    }

    fn on(terrain: TerrainName, jitter_s: [f32; 2]) -> Self {
        let mut data = (*UnitTypes::load(UnitData::Liberty).unwrap()).clone();
        data.cooldown_jitter_s = jitter_s;
        let types: Vec<&UnitType> = data.types.iter().collect();
        let field = Battlefield::new(Terrain::named(terrain), &data, &types);
        Self {
            battle: Battle::new(field.into(), 0),
            chance: Chance::new(EpisodeKey::new(3, Stream::Other, 0), 1),
        }
    }

    fn add(&mut self, name: &str, team: Team, stance: Stance, at: [f32; 2]) -> UnitIndex {
        let profiles = &self.battle.field.profiles;
        let kind = profiles
            .iter()
            .position(|profile| profile.name == name)
            .unwrap();
        self.battle
            .add(u8::try_from(kind).unwrap(), team, stance, at)
    }

    fn loops(&mut self, count: usize) {
        (0..count).for_each(|_| self.battle.advance(&mut self.chance));
    }

    /// Loops played until `holds`, at most 10 000.
    fn loops_until(&mut self, holds: impl Fn(&BattleState) -> bool) -> usize {
        (1..=10_000)
            .find(|_| {
                self.loops(1);
                holds(&self.battle.state)
            })
            .expect("it happens within 10 000 loops")
    }

    fn unit(&mut self, index: UnitIndex) -> &mut Unit {
        &mut self.battle.state.units[usize::from(index)]
    }

    fn at(&self, index: UnitIndex) -> [f32; 2] {
        [
            self.battle.state.x[usize::from(index)],
            self.battle.state.y[usize::from(index)],
        ]
    }

    fn attack(&mut self, attacker: UnitIndex, target: UnitIndex) {
        self.battle.order(attacker, Order::Attack { target });
    }
}

/// A unit of a type on the allies' side that attacks an idle enemy 3 map units away (1 for melee).
fn duel(attacker: &str, target: &str, distance: f32) -> (Arena, UnitIndex, UnitIndex) {
    let mut arena = Arena::new();
    let one = arena.add(attacker, Ally, Passive, [10.0, 16.0]);
    let other = arena.add(target, Enemy, Passive, [10.0 + distance, 16.0]);
    arena.attack(one, other);
    (arena, one, other)
}
