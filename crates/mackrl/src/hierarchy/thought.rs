//! From the tables of one step to what a person wants to see of them.

use mackrl_env::{Action, AgentId};

use super::tables::Decision;
use crate::{
    Real,
    marginalisation::{MarginalGradient, log_likelihood_with_gradient},
    policy::{
        AgentThought, Division, GroupChoice, GroupThought, JointOption, PairThought, Part,
        PartitionThought, TEAM, TeamOption, Thought, most_probable,
    },
};

/// Describes a decided step that led to `action_n`; `posterior` is room for the gradient of log p(u), whose entries are
/// posteriors.
pub(super) fn describe(
    decision: &Decision<'_>,
    action_n: &[Action],
    posterior: &mut MarginalGradient<f32>,
) -> Thought {
    let table = &decision.table;
    let declaration = table.declaration();
    let log_p = log_likelihood_with_gradient(table, action_n, posterior);
    let team = Part {
        level: TEAM,
        group: 0,
    };
    let mut thought = Thought {
        log_p_path: decision
            .path
            .choices
            .iter()
            .map(|&(part, column)| f64::from(table.row(part)[column]))
            .sum(),
        log_p: f64::from(log_p),
        ..Thought::default()
    };
    // A team of agents that act alone divides in one way, which says nothing.
    if declaration.levels().len() > 2 {
        thought.partitions = divisions(decision, team, posterior);
        thought.chosen = decision.path.choice(team);
    }
    for (place, level) in declaration.levels().iter().enumerate().skip(1) {
        for &group in &level.active {
            let part = Part {
                level: place,
                group,
            };
            if !decision.possible_g[place][group]
                || level.is_forced_by_death() && !decision.lives(part)
            {
                continue;
            }
            if level.survives {
                thought.groups.push(whole_team(decision, part, action_n));
                continue;
            }
            match (level.size(), declaration.members(part)) {
                (1, &[agent]) => {
                    let taken = action_n[agent.index()];
                    thought
                        .agents
                        .push(AgentThought::new(agent, table.row(part), taken));
                }
                (2, &[a, b]) => {
                    thought
                        .pairs
                        .push(pair(decision, part, [a, b], action_n, posterior));
                }
                (_, members) => thought.groups.push(GroupThought {
                    members: members.to_vec(),
                    known: decision.known(part).iter().collect(),
                    divisions: divisions(decision, part, posterior),
                    joint: Vec::new(),
                    chosen: decision.path.choice(part),
                }),
            }
        }
    }
    thought
}

/// The ways in which a group may divide.
fn divisions(
    decision: &Decision<'_>,
    part: Part,
    posterior: &MarginalGradient<f32>,
) -> Vec<PartitionThought> {
    let declaration = decision.table.declaration();
    let groups = |division: &Division| {
        let parts = division.parts.iter();
        parts
            .map(|part| declaration.members(*part).to_vec())
            .collect()
    };
    let choices = decision
        .table
        .divisions(part)
        .iter()
        .zip(decision.table.row(part));
    choices
        .zip(posterior.divisions(part))
        .map(|((division, &log_p), &posterior)| PartitionThought {
            groups: groups(division),
            probability: Real::exp(log_p),
            posterior,
        })
        .collect()
}

/// The living members of a team that acts as one, and what they could do.
fn whole_team(decision: &Decision<'_>, part: Part, action_n: &[Action]) -> GroupThought {
    let declaration = decision.table.declaration();
    let (level, actions) = (&declaration.levels()[part.level], declaration.actions());
    let all = declaration.members(part);
    let members = all.iter().copied();
    let members: Vec<AgentId> = members.filter(|&a| decision.alive.contains(a)).collect();
    let column = level.column(part.group, actions, action_n);
    let column = column.expect("the team acts jointly");
    let options = most_probable(decision.table.row(part), column).into_iter();
    let action = |joint: usize, member: &AgentId| {
        let later = all.iter().filter(|other| *other > member).count();
        let joint = (0..later).fold(joint, |joint, _| joint / actions);
        Action::new(joint % actions)
    };
    GroupThought {
        known: decision.known(part).iter().collect(),
        divisions: Vec::new(),
        joint: options
            .map(|(joint, probability)| TeamOption {
                actions: members.iter().map(|member| action(joint, member)).collect(),
                probability,
            })
            .collect(),
        chosen: None,
        members,
    }
}

fn pair(
    decision: &Decision<'_>,
    part: Part,
    members: [AgentId; 2],
    action_n: &[Action],
    posterior: &MarginalGradient<f32>,
) -> PairThought {
    let declaration = decision.table.declaration();
    let (level, actions) = (&declaration.levels()[part.level], declaration.actions());
    let log_p_c = decision.table.row(part);
    let (divide, joint) = log_p_c.split_at(level.divisions);
    let column = level
        .column(part.group, actions, action_n)
        .expect("pairs act jointly");
    let choice = decision.path.choice(part).map(|column| {
        if column < level.divisions {
            GroupChoice::Delegate
        } else {
            GroupChoice::Joint
        }
    });
    let options = most_probable(joint, column - level.divisions).into_iter();
    PairThought {
        members,
        known: decision.known(part).iter().collect(),
        delegate: divide.iter().map(|&log_p| Real::exp(log_p)).sum(),
        joint: options
            .map(|(joint, probability)| JointOption {
                actions: [joint / actions, joint % actions].map(Action::new),
                probability,
            })
            .collect(),
        choice,
        posterior_joint: posterior.joint(part),
        posterior_delegate: posterior.divisions(part).iter().sum(),
    }
}
