//! Who aims at whom in a battle.

use mackrl_skirmish::rules::{BattleState, Order};

/// A unit that aims at another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shot {
    /// Index of the attacker among the units.
    pub from: usize,
    /// Index of the target.
    pub to: usize,
    /// Whether it attacked in this step; otherwise it only aims.
    pub has_fired: bool,
}

/// Whom a living unit is aiming at or healing, and whether it has attacked since `before`: then its weapon reloads for longer than it
/// did.
#[must_use]
pub fn shot(state: &BattleState, before: &BattleState, index: usize) -> Option<Shot> {
    let unit = &state.units[index];
    let target = match unit.order {
        Order::Attack { target } | Order::Heal { target } => Some(target),
        Order::Stop | Order::Move { .. } | Order::AttackMove { .. } | Order::Hunt => unit.quarry,
    };
    let target = usize::from(target?);
    let is_shown = unit.is_alive() && before.units[target].is_alive();
    is_shown.then(|| Shot {
        from: index,
        to: target,
        has_fired: unit.cooldown > before.units[index].cooldown,
    })
}
