//! From an episode to the picture of one of its steps.

use mackrl_env::{
    Environment,
    skirmish::{
        rules::{BattleState, Order, Team},
        terrain::MAP_SIZE,
    },
};

use super::episode::Episode;
use crate::plot::{BattlePicture, Figure, Shot, Side};

/// What is seen after `step` steps, with what everybody did in the step before.
pub(super) fn picture(episode: &Episode, step: usize) -> BattlePicture {
    let scenario = episode.skirmish.scenario();
    let (state, before) = (episode.state(step), episode.state(step.saturating_sub(1)));
    let terrain = &scenario.field.terrain;
    let cells = 0..i32::try_from(MAP_SIZE).unwrap_or(i32::MAX);
    let figures = (0..state.units.len()).map(|index| figure(episode, state, before, index));
    let reward: f64 = (episode.steps.iter().take(step))
        .map(|step| f64::from(step.reward))
        .sum();
    BattlePicture {
        title: format!("{}, step {step}", episode.skirmish.spec().name),
        subtitle: format!(
            "{} against the game, seed {}, {} allies and {} enemies alive, return so far {reward:.1}",
            episode.policy.name(),
            episode.key.seed,
            state.living(Team::Ally),
            state.living(Team::Enemy),
        ),
        walkable: cells
            .clone()
            .flat_map(|y| cells.clone().map(move |x| (x, y)))
            .map(|(x, y)| terrain.is_walkable(x, y))
            .collect(),
        edge: MAP_SIZE,
        figures: figures.collect(),
        shots: (0..state.units.len())
            .filter_map(|index| shot(state, before, index))
            .collect(),
        missiles: (state.missiles.iter())
            .map(|missile| [missile.x, missile.y].map(f64::from))
            .collect(),
        sight: f64::from(episode.skirmish.settings().sight_range),
    }
}

fn figure(episode: &Episode, state: &BattleState, before: &BattleState, index: usize) -> Figure {
    let scenario = episode.skirmish.scenario();
    let unit = &state.units[index];
    let profile = &scenario.field.profiles[usize::from(unit.kind)];
    let place = |state: &BattleState| [state.x[index], state.y[index]].map(f64::from);
    Figure {
        side: match unit.team {
            Team::Ally => Side::Ally,
            Team::Enemy => Side::Enemy,
        },
        kind: profile.name.clone(),
        number: match unit.team {
            Team::Ally => index,
            Team::Enemy => index - scenario.agents,
        },
        at: place(state),
        from: place(before),
        radius: f64::from(profile.radius),
        is_alive: unit.is_alive(),
        life: f64::from(unit.life / profile.life),
        shield: (profile.shield > 0.0).then(|| f64::from(unit.shield / profile.shield)),
    }
}

/// Whom a living unit is aiming at or healing, and whether it has attacked since `before`: then its weapon reloads for longer than it
/// did.
fn shot(state: &BattleState, before: &BattleState, index: usize) -> Option<Shot> {
    let unit = &state.units[index];
    let target = match unit.order {
        Order::Attack { target } | Order::Heal { target } => Some(target),
        Order::Stop | Order::Move { .. } => unit.quarry,
        Order::AttackMove { .. } | Order::Hunt => unit.quarry,
    };
    let target = usize::from(target?);
    let is_shown = unit.is_alive() && before.units[target].is_alive();
    is_shown.then(|| Shot {
        from: index,
        to: target,
        has_fired: unit.cooldown > before.units[index].cooldown,
    })
}
