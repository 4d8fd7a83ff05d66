//! From a replay to the picture of one of its decisions.

use mackrl::policy::GroupChoice;
use mackrl_env::{AgentId, EntityId, EntitySet, Environment};
use mackrl_run::replay::{GroupKnowledge, shot};
use mackrl_skirmish::{
    rules::{BattleState, Team},
    terrain::MAP_SIZE,
};

use super::{Opened, caption::caption};
use crate::plot::{BattlePicture, Figure, Lens, Link, Side};

/// Agents outside the group whose fields of view are drawn too; more would hide the battle.
const OTHERS_SHOWN: usize = 1;

/// The decision at `step`, as `mackrl explain` tells it: where all are when it is made, the pairs that are formed, what everybody
/// then does, and what `group` knows, if it has members. After the last step nothing is decided.
pub(crate) fn picture(opened: &Opened, step: usize, group: &[AgentId]) -> BattlePicture {
    let playback = &opened.playback;
    let scenario = playback.skirmish.scenario();
    let moment = &playback.moments[step];
    let next = playback.moments.get(step + 1).unwrap_or(moment);
    let (state, after) = (&moment.state, &next.state);
    let terrain = &scenario.field.terrain;
    let cells = 0..i32::try_from(MAP_SIZE).unwrap_or(i32::MAX);
    let rewards = playback.reward_t.iter().take(step);
    let total = rewards.fold(0.0, |total, reward| total + f64::from(*reward));
    let knowledge = GroupKnowledge::of(group, &moment.visible_n);
    let is_over = step == playback.steps();
    BattlePicture {
        title: format!(
            "{}, step {step} of {}{}",
            playback.skirmish.spec().name,
            playback.steps(),
            if is_over { ": the end" } else { "" }
        ),
        subtitle: format!(
            "{} against the game, seed {}; {} allies and {} enemies alive; return so far {total:.1}",
            opened.replay.player.name(),
            opened.replay.key.seed,
            state.living(Team::Ally),
            state.living(Team::Enemy),
        ),
        caption: caption(opened, step, group, &knowledge),
        walkable: cells
            .clone()
            .flat_map(|y| cells.clone().map(move |x| (x, y)))
            .map(|(x, y)| terrain.is_walkable(x, y))
            .collect(),
        edge: MAP_SIZE,
        figures: (0..state.units.len())
            .map(|index| figure(opened, state, after, index))
            .collect(),
        shots: (0..state.units.len())
            .filter(|_| !is_over)
            .filter_map(|index| shot(after, state, index))
            .collect(),
        missiles: (state.missiles.iter())
            .map(|missile| [missile.x, missile.y].map(f64::from))
            .collect(),
        sight: f64::from(playback.skirmish.settings().sight_range),
        links: links(opened, step, group),
        lens: (!group.is_empty()).then(|| lens(&moment.visible_n, group, &knowledge)),
    }
}

fn figure(opened: &Opened, state: &BattleState, after: &BattleState, index: usize) -> Figure {
    let scenario = opened.playback.skirmish.scenario();
    let unit = &state.units[index];
    let profile = &scenario.field.profiles[usize::from(unit.kind)];
    let place = |state: &BattleState| [state.x[index], state.y[index]].map(f64::from);
    Figure {
        side: match unit.team {
            Team::Ally => Side::Ally,
            Team::Enemy => Side::Enemy,
        },
        kind: opened.names.kind(EntityId::new(index)).to_owned(),
        letters: opened.names.letters(EntityId::new(index)).to_owned(),
        name: opened.names.entity(EntityId::new(index)),
        at: place(state),
        to: place(after),
        radius: f64::from(profile.radius),
        is_alive: unit.is_alive(),
        life: f64::from(unit.life / profile.life),
        shield: (profile.shield > 0.0).then(|| f64::from(unit.shield / profile.shield)),
    }
}

/// The pairs of living agents that the partition chosen at this step contains; those inside `group`, if it has members.
fn links(opened: &Opened, step: usize, group: &[AgentId]) -> Vec<Link> {
    let visible_n = &opened.playback.moments[step].visible_n;
    let step = opened.replay.steps.get(step);
    let thought = step.and_then(|step| step.thought.as_ref());
    let pairs = thought.into_iter().flat_map(|thought| &thought.pairs);
    let is_shown = |agent: &AgentId| {
        !visible_n[agent.index()].is_empty() && (group.is_empty() || group.contains(agent))
    };
    pairs
        .filter(|pair| pair.members.iter().all(is_shown))
        .filter_map(|pair| {
            Some(Link {
                members: pair.members.map(AgentId::index),
                is_joint: pair.choice? == GroupChoice::Joint,
            })
        })
        .collect()
}

fn lens(visible_n: &[EntitySet], group: &[AgentId], knowledge: &GroupKnowledge) -> Lens {
    let members: Vec<usize> = group.iter().map(|agent| agent.index()).collect();
    let living = |agent: &usize| !visible_n[*agent].is_empty();
    let others: Vec<usize> = (0..visible_n.len())
        .filter(|agent| living(agent) && !members.contains(agent))
        .collect();
    let mut fields: Vec<usize> = members.iter().copied().filter(living).collect();
    if others.len() <= OTHERS_SHOWN {
        fields.extend(others);
    }
    let indices = |set: EntitySet| set.iter().map(EntityId::index);
    let private = knowledge.private.iter();
    Lens {
        common: indices(knowledge.common).collect(),
        mutual: indices(knowledge.mutual).collect(),
        private: private.flat_map(|known| indices(known.entities)).collect(),
        members,
        fields,
    }
}
