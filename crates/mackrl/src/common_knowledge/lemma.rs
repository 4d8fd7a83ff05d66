//! Lemma 1: the common knowledge of a group in one intersection.

use mackrl_env::{AgentId, EntitySet, KnownEntities, PriorKnowledge};

/// The common knowledge of `group`: what all of its members see if they all see each other, else nothing.
///
/// A dead agent sees nothing, so a group with a dead member commonly knows nothing. A single living agent commonly knows
/// all that it sees; the empty group knows nothing.
///
/// # Shapes
/// `visible_n` \[N\]: the entities that each agent sees, itself included while it lives.
///
/// # Examples
/// Figure 1: A and B see each other, C sees both and is seen by neither.
/// ```
/// use mackrl::common_knowledge::common_knowledge;
/// use mackrl_env::{AgentId, EntitySet};
///
/// let [a, b, c] = [0, 1, 2].map(AgentId::new);
/// let visible_n = [0b011, 0b011, 0b111].map(EntitySet::from_bits);
/// assert_eq!(common_knowledge(&[a, b], &visible_n).bits(), 0b011);
/// assert!(common_knowledge(&[a, c], &visible_n).is_empty());
/// assert!(common_knowledge(&[a, b, c], &visible_n).is_empty());
/// ```
///
/// # Equation
/// Eq. (3): 𝓘^𝒢 = ∩_{a ∈ 𝒢} 𝓜^a if μ^a(s^a, s^b) for all a, b ∈ 𝒢, else ∅.
#[must_use]
pub fn common_knowledge(group: &[AgentId], visible_n: &[EntitySet]) -> EntitySet {
    let mutual = group
        .iter()
        .map(|agent| visible_n[agent.index()])
        .reduce(EntitySet::intersection)
        .unwrap_or(EntitySet::EMPTY);
    known_if_all_are_seen(group, mutual)
}

/// The common knowledge of `group` as one of its members finds it alone, from what it sees and from the fields of view that
/// are known to all.
///
/// Equal to [`common_knowledge`] for every member of the group: a member that misses another knows by that alone that
/// nothing is common; otherwise it sees all members and so can tell which of *its* entities each of them sees.
#[must_use]
pub fn common_knowledge_from_view(
    group: &[AgentId],
    seen: KnownEntities<'_>,
    prior: &dyn PriorKnowledge,
) -> EntitySet {
    let members: EntitySet = group.iter().copied().collect();
    if group.is_empty() || !members.is_subset_of(seen.set()) {
        return EntitySet::EMPTY;
    }
    let mut mutual = seen.set();
    for &member in group {
        mutual = mutual.intersection(seen_by(member, seen.restricted_to(mutual), prior));
        if !members.is_subset_of(mutual) {
            return EntitySet::EMPTY;
        }
    }
    mutual
}

/// Which of the entities in `seen` the agent `member`, one of them, sees too.
fn seen_by(member: AgentId, seen: KnownEntities<'_>, prior: &dyn PriorKnowledge) -> EntitySet {
    let Some(member_f) = seen.get(member) else {
        return EntitySet::EMPTY;
    };
    seen.set()
        .iter()
        .filter(|&entity| {
            seen.get(entity)
                .is_some_and(|entity_f| prior.sees(member, member_f, entity, entity_f))
        })
        .collect()
}

/// `mutual` if all of the group are in it, so that everybody sees everybody; else nothing.
fn known_if_all_are_seen(group: &[AgentId], mutual: EntitySet) -> EntitySet {
    if group.iter().all(|&agent| mutual.contains(agent)) {
        mutual
    } else {
        EntitySet::EMPTY
    }
}
