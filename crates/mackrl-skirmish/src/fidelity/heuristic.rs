//! The team that SMAC ships as a script (`heuristic_ai`), in orders instead of actions: it attacks from anywhere, which agents
//! cannot.

use crate::{
    Skirmish,
    rules::{Battle, Order, Team, UnitIndex},
};

/// What each agent has chosen.
#[derive(Debug)]
pub(super) struct Heuristic {
    targets: Vec<Option<UnitIndex>>,
    orders: Vec<Option<Order>>,
}

impl Heuristic {
    pub(super) fn new(skirmish: &Skirmish) -> Self {
        let agents = skirmish.scenario().agents;
        Self {
            targets: vec![None; agents],
            orders: vec![None; agents],
        }
    }

    /// The order of each agent for this step; none for those that rest.
    pub(super) fn orders(&self) -> &[Option<Order>] {
        &self.orders
    }

    /// Keeps each agent's target as long as it is one, and takes the nearest otherwise.
    pub(super) fn choose(&mut self, battle: &Battle, is_new_episode: bool) {
        if is_new_episode {
            self.targets.fill(None);
        }
        for agent in 0..self.targets.len() {
            let unit = &battle.state().units[agent];
            let kept = self.targets[agent].filter(|&target| suits(battle, agent, target.into()));
            self.targets[agent] = kept.or_else(|| nearest(battle, agent));
            let is_healer = battle.field().profiles[usize::from(unit.kind)]
                .care
                .is_some();
            self.orders[agent] = self.targets[agent]
                .filter(|_| unit.is_alive())
                .map(|target| match is_healer {
                    true => Order::Heal { target },
                    false => Order::Attack { target },
                });
        }
    }
}

fn nearest(battle: &Battle, agent: usize) -> Option<UnitIndex> {
    let state = battle.state();
    (0..state.units.len())
        .filter(|&other| suits(battle, agent, other))
        .min_by(|&a, &b| {
            let square = |other| state.distance_squared(agent, other);
            square(a).total_cmp(&square(b))
        })
        .and_then(|other| UnitIndex::try_from(other).ok())
}

/// Whether `other` is somebody whom `agent` can do what it is there for.
fn suits(battle: &Battle, agent: usize, other: usize) -> bool {
    let target = &battle.state().units[other];
    match target.team {
        Team::Enemy => battle.can_attack(agent, other),
        Team::Ally => battle.can_heal(agent, other),
    }
}
