//! Who knows what in a group, and why it is or is not common.

use mackrl::{
    common_knowledge::common_knowledge,
    policy::{PartitionThought, Thought},
};
use mackrl_env::{AgentId, EntitySet};

/// What the members of a group know at one moment, in parts that do not overlap.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroupKnowledge {
    /// What everybody knows, knows that everybody knows, and so on (Lemma 1).
    pub common: EntitySet,
    /// What every member sees although it is not common: somebody is not seen by somebody, so nobody can rely on it.
    pub mutual: EntitySet,
    /// What some members see and others do not, by who sees it.
    pub private: Vec<PrivateKnowledge>,
    /// Members that do not see each other: (who, whom). Common knowledge exists exactly if there are none.
    pub unseen: Vec<(AgentId, AgentId)>,
}

/// Entities that the same members see.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PrivateKnowledge {
    /// Who sees them: at least one member, not all.
    pub seen_by: Vec<AgentId>,
    /// What they see.
    pub entities: EntitySet,
}

impl GroupKnowledge {
    /// What `group` knows where agents see `visible_n` \[N\].
    #[must_use]
    pub fn of(group: &[AgentId], visible_n: &[EntitySet]) -> Self {
        let view = |agent: &AgentId| visible_n[agent.index()];
        let seen_by_all = group.iter().map(view).reduce(EntitySet::intersection);
        let common = common_knowledge(group, visible_n);
        let mutual = seen_by_all.unwrap_or_default().difference(common);
        let seen = group
            .iter()
            .map(view)
            .fold(EntitySet::EMPTY, EntitySet::union);
        let mut private: Vec<PrivateKnowledge> = Vec::new();
        for entity in seen.difference(common).difference(mutual).iter() {
            let seers = group.iter().filter(|agent| view(agent).contains(entity));
            let seen_by: Vec<AgentId> = seers.copied().collect();
            match private.iter_mut().find(|known| known.seen_by == seen_by) {
                Some(known) => known.entities.insert(entity),
                None => private.push(PrivateKnowledge {
                    seen_by,
                    entities: [entity].into_iter().collect(),
                }),
            }
        }
        let couples = group
            .iter()
            .flat_map(|who| group.iter().map(move |whom| (*who, *whom)));
        Self {
            common,
            mutual,
            private,
            unseen: couples
                .filter(|(who, whom)| !view(who).contains(*whom))
                .collect(),
        }
    }
}

/// The groups of a partition without the dead, who have no controllers in `thought`. Two partitions may differ in the dead alone.
#[must_use]
pub fn living_groups(thought: &Thought, partition: &PartitionThought) -> Vec<Vec<AgentId>> {
    let is_alive = |agent: &AgentId| thought.agents.iter().any(|alone| alone.agent == *agent);
    let living =
        |group: &Vec<AgentId>| -> Vec<AgentId> { group.iter().copied().filter(is_alive).collect() };
    let groups = partition.groups.iter().map(living);
    groups.filter(|group| !group.is_empty()).collect()
}
