//! A map in play: both armies at their places, the enemies under their order.
//!
//! This is all of a map that the rules need and nothing that learning needs: [`crate::Skirmish`] shows it to agents, and a
//! game server can play it by orders alone.

use std::sync::Arc;

use mackrl_env::EpisodeKey;

use crate::{
    rules::{Battle, BattleState, Chance, Order, Stance, Team, UnitIndex},
    scenario::{EnemyOrder, Scenario},
    settings::{EnemyBehaviour, SkirmishSettings},
};

/// Loops for which fresh enemies stand and look for nobody: SMAC's restart plays some loops until both armies are there, and the
/// map's order comes after that. Teams of 3 marines that stand still last 21.82 steps in recorded runs, 21.75 here, and 21.38
/// with two loops less.
const MUSTER_LOOPS: f32 = 6.0;

/// The battle of a scenario, which can begin again and again.
#[derive(Debug, Clone)]
pub struct Encounter {
    scenario: Arc<Scenario>,
    /// Everybody at the places of the map.
    muster: BattleState,
    /// What the enemies are told.
    enemy_order: EnemyOrder,
    /// How far from these places an episode starts, in map units along each axis.
    scatter: f32,
    pub(super) battle: Battle,
}

impl Encounter {
    /// Puts everybody at their places. Of `settings`, `enemy_order` and `spawn_scatter` count here.
    #[must_use]
    pub fn new(scenario: Arc<Scenario>, settings: &SkirmishSettings) -> Self {
        let mut battle = Battle::new(scenario.field.clone(), scenario.recruits.len());
        for recruit in &scenario.recruits {
            let stance = match recruit.team {
                Team::Ally => Stance::Passive,
                Team::Enemy => Stance::Aggressive,
            };
            battle.add(recruit.kind, recruit.team, stance, recruit.at);
        }
        Self {
            muster: battle.state().clone(),
            enemy_order: match settings.enemy_order {
                EnemyBehaviour::Map => scenario.enemy_order,
                EnemyBehaviour::Hunt => EnemyOrder::Hunt,
            },
            scatter: settings.spawn_scatter,
            battle,
            scenario,
        }
    }

    /// The map.
    #[must_use]
    pub const fn scenario(&self) -> &Arc<Scenario> {
        &self.scenario
    }

    /// The battle as it stands.
    #[must_use]
    pub const fn battle(&self) -> &Battle {
        &self.battle
    }

    /// Everybody at the places of the map.
    #[must_use]
    pub const fn muster(&self) -> &BattleState {
        &self.muster
    }

    /// Puts everybody back, whole, scattered as the episode `key` has it, and gives the enemies their order.
    pub fn begin(&mut self, key: EpisodeKey) {
        let mut chance = Chance::new(key, 0);
        self.battle.restore(&self.muster);
        self.battle.scatter(self.scatter, &mut chance);
        // Agents are numbered by type, x and y as an episode begins. Fresh units of a type are alike, so places are exchanged
        // instead of numbers.
        self.battle.sort_places(0..self.scenario.agents);
        self.order_enemies(&mut chance);
    }

    /// Gives a unit an order, as [`Battle::order`].
    pub fn order(&mut self, unit: UnitIndex, order: Order) {
        self.battle.order(unit, order);
    }

    /// Takes a unit off the field, without the effects that a death in battle has.
    pub fn remove(&mut self, unit: UnitIndex) {
        self.battle.remove(unit);
    }

    /// Plays one loop.
    pub fn advance(&mut self, chance: &mut Chance) {
        self.battle.advance(chance);
    }

    fn order_enemies(&mut self, chance: &mut Chance) {
        let to = match self.enemy_order {
            EnemyOrder::None => return,
            EnemyOrder::Hunt => None,
            EnemyOrder::AttackMove(to) => Some(to),
            EnemyOrder::AttackMoveBetween([from, to]) => {
                let part = chance.uniform();
                Some([0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * part))
            }
        };
        for index in self.scenario.agents..self.scenario.recruits.len() {
            let order = to.map_or(Order::Hunt, |to| Order::AttackMove {
                to: self.place_in_formation(index, to),
            });
            self.battle.order(unit_index(index), order);
            self.battle.hold(unit_index(index), MUSTER_LOOPS);
        }
    }

    /// Where an enemy goes when the army is sent to `to`: the army keeps its formation, as far as there is ground.
    fn place_in_formation(&self, index: usize, to: [f32; 2]) -> [f32; 2] {
        let at = self.scenario.recruits[index].at;
        let place = [0, 1].map(|axis| to[axis] + at[axis] - self.scenario.enemy_centre[axis]);
        let field = &self.scenario.field;
        let radius = field.profiles[usize::from(self.scenario.recruits[index].kind)].inner_radius;
        let (x, y) = field
            .terrain
            .pushed_out_of_walls(place[0], place[1], radius);
        if [x, y] == place { place } else { to }
    }
}

fn unit_index(index: usize) -> UnitIndex {
    UnitIndex::try_from(index).expect("a battle has ≤ 256 units")
}
