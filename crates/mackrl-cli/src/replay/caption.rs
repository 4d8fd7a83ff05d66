//! One line on what a group knows, as a picture tells it.

use mackrl_env::{AgentId, EntitySet};
use mackrl_run::replay::GroupKnowledge;

use super::Opened;

/// Most entities that are named one by one.
const NAMED_MOST: usize = 7;

/// "A sees B, B sees A, both see e0 e1: common knowledge; only B sees e2", or why nothing is; empty without a group.
pub(super) fn caption(
    opened: &Opened,
    step: usize,
    group: &[AgentId],
    knowledge: &GroupKnowledge,
) -> String {
    let visible_n = &opened.playback.moments[step].visible_n;
    let name = |agent: AgentId| opened.names.agent(agent);
    let listed = |set: EntitySet| -> String {
        let names: Vec<String> = set.iter().map(|e| opened.names.entity(e)).collect();
        let (shown, more) = match names.len() {
            count if count <= NAMED_MOST => (count, String::new()),
            count => (
                NAMED_MOST - 1,
                format!(" and {} more", count - NAMED_MOST + 1),
            ),
        };
        names[..shown].join(" ") + &more
    };
    let fallen = group
        .iter()
        .find(|agent| visible_n[agent.index()].is_empty());
    let nothing = "nothing is common knowledge";
    if let Some(&agent) = fallen {
        return format!("{} has fallen: {nothing}", name(agent));
    }
    if let Some(&(who, whom)) = knowledge.unseen.first() {
        return format!("{} does not see {}: {nothing}", name(who), name(whom));
    }
    let members: EntitySet = group.iter().copied().collect();
    let others = listed(knowledge.common.difference(members));
    let mut text = match *group {
        [] => return String::new(),
        [agent] if others.is_empty() => return format!("{} sees no other unit", name(agent)),
        [agent] => return format!("{} sees {others}", name(agent)),
        [a, b] => {
            let [a, b] = [a, b].map(name);
            format!("{a} sees {b}, {b} sees {a}, both see ")
        }
        _ => format!("{} see each other, all see ", listed(members)),
    };
    text += if others.is_empty() {
        "no other unit"
    } else {
        &others
    };
    text += ": common knowledge";
    for private in &knowledge.private {
        let seers: EntitySet = private.seen_by.iter().copied().collect();
        let verb = if private.seen_by.len() == 1 {
            "sees"
        } else {
            "see"
        };
        text += &format!(
            "; only {} {verb} {}",
            listed(seers),
            listed(private.entities)
        );
    }
    text
}
