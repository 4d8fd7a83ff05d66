//! What a team's controllers computed at one step, as plain data for people to look at.
//!
//! Reports, replays and explanations read it; no controller and no learner does. Large tables are cut down to their most
//! probable entries and the one that was taken, so that a battle of many agents stays a small file.

use mackrl_env::{Action, AgentId, EntityId};
use serde::{Deserialize, Serialize};

/// What the controllers of one environment computed at one step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thought {
    /// The partitions in force; none in a team without a hierarchy.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub partitions: Vec<PartitionThought>,
    /// Index of the partition that was chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen: Option<usize>,
    /// Every group that divides further after the team did and before pairs act, such as fours; or the whole team, where it acts as one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<GroupThought>,
    /// Every pair of living agents that some partition can contain.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<PairThought>,
    /// Every living agent.
    pub agents: Vec<AgentThought>,
    /// The logarithm of the probability of the choices that were made on the way to the joint action.
    pub log_p_path: f64,
    /// log p(u): the logarithm of the joint action's probability over all ways (eq. 5).
    pub log_p: f64,
}

/// One partition that could be chosen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartitionThought {
    /// The pairs, and the agent that stays alone.
    pub groups: Vec<Vec<AgentId>>,
    /// The selector's probability of it.
    pub probability: f32,
    /// The probability that it was chosen, given the joint action alone.
    pub posterior: f32,
}

/// What the controller of a group computed that divides, or of a whole team that acts as one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroupThought {
    /// Its members, ascending.
    pub members: Vec<AgentId>,
    /// What they commonly know.
    pub known: Vec<EntityId>,
    /// The ways in which it may divide.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub divisions: Vec<PartitionThought>,
    /// Of a team that acts as one: its most probable joint actions, and the one that was taken.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint: Vec<TeamOption>,
    /// The way that it chose; absent if it was not asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen: Option<usize>,
}

/// What the controller of one pair computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairThought {
    /// The two agents, the lower first.
    pub members: [AgentId; 2],
    /// What the two commonly know, and nothing else went into the controller.
    pub known: Vec<EntityId>,
    /// Probability of delegating.
    pub delegate: f32,
    /// The most probable joint actions, and the one that was taken.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint: Vec<JointOption>,
    /// What the pair chose; absent if the chosen partition does not contain it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub choice: Option<GroupChoice>,
    /// The probability, given the joint action alone, that the pair was formed and acted jointly.
    pub posterior_joint: f32,
    /// The probability, given the joint action alone, that the pair was formed and delegated.
    pub posterior_delegate: f32,
}

/// What a pair did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GroupChoice {
    /// Acted jointly.
    Joint,
    /// Left it to its members.
    Delegate,
}

/// One joint action that a pair could take.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointOption {
    /// The actions of the lower and the higher member.
    pub actions: [Action; 2],
    /// Its probability.
    pub probability: f32,
}

/// One joint action that a whole team could take.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TeamOption {
    /// The actions of its living members, in their order.
    pub actions: Vec<Action>,
    /// Its probability.
    pub probability: f32,
}

/// What the controller of one agent computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AgentThought {
    /// The agent.
    pub agent: AgentId,
    /// Its most probable actions, and the one that was taken.
    pub options: Vec<SoloOption>,
}

/// One action that an agent could take.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SoloOption {
    /// The action.
    pub action: Action,
    /// Its probability.
    pub probability: f32,
}

impl AgentThought {
    /// What the row `log_p_a` \[A\] of `agent` says, which took `taken`.
    pub(crate) fn new(agent: AgentId, log_p_a: &[f32], taken: Action) -> Self {
        let options = most_probable(log_p_a, taken.index()).into_iter();
        Self {
            agent,
            options: options
                .map(|(action, probability)| SoloOption {
                    action: Action::new(action),
                    probability,
                })
                .collect(),
        }
    }
}

/// Entries of a table that are kept, besides the one that was taken.
const OPTIONS_MOST: usize = 5;

/// Indices and probabilities of the most probable entries of a row and of the entry `taken`, the most probable first.
pub(crate) fn most_probable(log_p: &[f32], taken: usize) -> Vec<(usize, f32)> {
    let mut order: Vec<usize> = (0..log_p.len())
        .filter(|&index| log_p[index] > f32::NEG_INFINITY)
        .collect();
    order.sort_by(|&a, &b| log_p[b].total_cmp(&log_p[a]).then(a.cmp(&b)));
    let rest = order.split_off(OPTIONS_MOST.min(order.len()));
    order.extend(rest.into_iter().filter(|&index| index == taken));
    order
        .into_iter()
        .map(|index| (index, log_p[index].exp()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_entry_that_was_taken_is_kept_however_improbable() {
        let log_p: Vec<f32> = [0.1, 0.3, 0.0, 0.05, 0.25, 0.2, 0.06, 0.04_f32]
            .map(f32::ln)
            .to_vec();
        let kept = |taken| -> Vec<usize> {
            let options = most_probable(&log_p, taken);
            options.into_iter().map(|(index, _)| index).collect()
        };
        assert_eq!(kept(4), [1, 4, 5, 0, 6]);
        assert_eq!(kept(7), [1, 4, 5, 0, 6, 7]);
        assert_eq!(most_probable(&[f32::NEG_INFINITY, 0.0], 1), [(1, 1.0)]);
    }
}
