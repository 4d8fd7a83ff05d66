//! Who knew what at one step, and what the controllers made of it, in names that people read.

mod only;
mod text;

use mackrl::policy::{GroupChoice, GroupThought, PairThought, Thought};
use mackrl_env::{Action, AgentId, EntityId, EntitySet};
use mackrl_run::replay::{GroupKnowledge, Summary, living_groups};
use serde::Serialize;

use super::Opened;
pub(crate) use only::About;

/// How the choice of a partition is called among controllers.
const PARTITION: &str = "partition";

/// The facts of one step.
#[derive(Debug, Serialize)]
pub(crate) struct Explanation {
    episode: Summary,
    step: usize,
    /// V(s), if there is a critic.
    value: Option<f32>,
    /// Reward of the step.
    reward: Option<f32>,
    entities: Vec<Entity>,
    /// What every agent sees.
    views: Vec<View>,
    /// What every pair of living agents knows.
    knowledge: Vec<Knowledge>,
    /// What every agent did.
    actions: Vec<Taken>,
    /// What the controllers computed, if there are any.
    controllers: Option<Controllers>,
}

#[derive(Debug, Serialize)]
struct Entity {
    name: String,
    kind: String,
    is_alive: bool,
}

#[derive(Debug, Serialize)]
struct View {
    agent: String,
    sees: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Knowledge {
    group: Vec<String>,
    common: Vec<String>,
    mutual_but_not_common: Vec<String>,
    private: Vec<Private>,
    /// Who does not see whom.
    unseen: Vec<[String; 2]>,
    why: String,
}

#[derive(Debug, Serialize)]
struct Private {
    seen_by: Vec<String>,
    entities: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Taken {
    agent: String,
    action: String,
}

#[derive(Debug, Serialize)]
struct Controllers {
    partitions: Vec<Partition>,
    /// The whole team, where it acts as one.
    #[serde(skip_serializing_if = "Option::is_none")]
    team: Option<Team>,
    pairs: Vec<Pair>,
    agents: Vec<Agent>,
    /// The choices on the way to the joint action.
    path: Vec<Chosen>,
    /// Their product.
    path_probability: f64,
    /// p(u), the joint action's probability over all ways.
    marginal_probability: f64,
}

#[derive(Debug, Serialize)]
struct Partition {
    groups: String,
    probability: f32,
    posterior: f32,
    is_chosen: bool,
}

#[derive(Debug, Serialize)]
struct Pair {
    members: [String; 2],
    choice: Option<GroupChoice>,
    delegate_probability: f32,
    joint: Vec<Entry>,
    posterior_joint: f32,
    posterior_delegate: f32,
}

#[derive(Debug, Serialize)]
struct Team {
    members: Vec<String>,
    joint: Vec<Entry>,
}

#[derive(Debug, Serialize)]
struct Agent {
    agent: String,
    options: Vec<Entry>,
}

#[derive(Debug, Serialize)]
struct Entry {
    action: String,
    probability: f32,
    is_taken: bool,
}

#[derive(Debug, Serialize)]
struct Chosen {
    controller: String,
    choice: String,
    probability: f32,
}

impl Explanation {
    /// Of the decision after `step` steps, or of the last moment.
    pub(crate) fn of(opened: &Opened, step: usize) -> Self {
        let writer = Writer { opened, step };
        let recorded = opened.replay.steps.get(step);
        let thought = recorded.and_then(|step| step.thought.as_ref());
        let entities = opened.playback.moments[step].state.units.len();
        Self {
            episode: opened.summary(),
            step,
            value: recorded.and_then(|step| step.value),
            reward: opened.playback.reward_t.get(step).copied(),
            entities: (0..entities)
                .map(|e| writer.entity(EntityId::new(e)))
                .collect(),
            views: opened.agents().map(|agent| writer.view(agent)).collect(),
            knowledge: writer.knowledge(),
            actions: recorded
                .map_or(&[][..], |step| &step.actions)
                .iter()
                .enumerate()
                .map(|(agent, action)| writer.taken(AgentId::new(agent), *action))
                .collect(),
            controllers: thought.map(|thought| writer.controllers(thought)),
        }
    }
}

/// Gives things of one step their names.
struct Writer<'a> {
    opened: &'a Opened,
    step: usize,
}

impl Writer<'_> {
    fn visible_n(&self) -> &[EntitySet] {
        &self.opened.playback.moments[self.step].visible_n
    }

    fn agent(&self, agent: AgentId) -> String {
        self.opened.names.agent(agent)
    }

    fn names(&self, set: EntitySet) -> Vec<String> {
        set.iter().map(|e| self.opened.names.entity(e)).collect()
    }

    fn entity(&self, entity: EntityId) -> Entity {
        let unit = &self.opened.playback.moments[self.step].state.units[entity.index()];
        Entity {
            name: self.opened.names.entity(entity),
            kind: self.opened.names.kind(entity).to_owned(),
            is_alive: unit.is_alive(),
        }
    }

    fn view(&self, agent: AgentId) -> View {
        View {
            agent: self.agent(agent),
            sees: self.names(self.visible_n()[agent.index()]),
        }
    }

    fn taken(&self, agent: AgentId, action: Action) -> Taken {
        Taken {
            agent: self.agent(agent),
            action: self.opened.names.action(agent, action),
        }
    }

    /// Of every pair of living agents.
    fn knowledge(&self) -> Vec<Knowledge> {
        let living = |agent: &AgentId| !self.visible_n()[agent.index()].is_empty();
        let agents: Vec<AgentId> = self.opened.agents().filter(living).collect();
        let pairs = agents.iter().enumerate().flat_map(|(place, first)| {
            let others = agents[place + 1..].iter();
            others.map(move |second| [*first, *second])
        });
        pairs.map(|pair| self.pair_knowledge(pair)).collect()
    }

    fn pair_knowledge(&self, pair: [AgentId; 2]) -> Knowledge {
        let knowledge = GroupKnowledge::of(&pair, self.visible_n());
        Knowledge {
            group: pair.map(|agent| self.agent(agent)).to_vec(),
            common: self.names(knowledge.common),
            mutual_but_not_common: self.names(knowledge.mutual),
            private: (knowledge.private.iter())
                .map(|private| Private {
                    seen_by: (private.seen_by.iter()).map(|a| self.agent(*a)).collect(),
                    entities: self.names(private.entities),
                })
                .collect(),
            unseen: (knowledge.unseen.iter())
                .map(|(who, whom)| [*who, *whom].map(|agent| self.agent(agent)))
                .collect(),
            why: self.why(pair, &knowledge),
        }
    }

    fn why(&self, pair: [AgentId; 2], knowledge: &GroupKnowledge) -> String {
        let [a, b] = pair.map(|agent| self.agent(agent));
        if knowledge.unseen.is_empty() {
            return format!("{a} sees {b} and {b} sees {a}");
        }
        let unseen = knowledge
            .unseen
            .iter()
            .map(|(who, whom)| format!("{} does not see {}", self.agent(*who), self.agent(*whom)));
        unseen.collect::<Vec<_>>().join(" and ")
    }

    fn controllers(&self, thought: &Thought) -> Controllers {
        let taken = |agent: AgentId| self.opened.replay.steps[self.step].actions[agent.index()];
        let partitions = thought.partitions.iter().enumerate();
        let pairs = thought.pairs.iter();
        let agents = thought.agents.iter();
        Controllers {
            partitions: partitions
                .map(|(index, partition)| Partition {
                    groups: self.groups(&living_groups(thought, partition)),
                    probability: partition.probability,
                    posterior: partition.posterior,
                    is_chosen: thought.chosen == Some(index),
                })
                .collect(),
            team: (thought.groups.iter())
                .find(|group| !group.joint.is_empty())
                .map(|group| self.team(group, taken)),
            pairs: pairs.map(|pair| self.pair(pair, taken)).collect(),
            agents: agents
                .map(|agent| Agent {
                    agent: self.agent(agent.agent),
                    options: (agent.options.iter())
                        .map(|option| Entry {
                            action: self.opened.names.action(agent.agent, option.action),
                            probability: option.probability,
                            is_taken: option.action == taken(agent.agent),
                        })
                        .collect(),
                })
                .collect(),
            path: self.path(thought, taken),
            path_probability: thought.log_p_path.exp(),
            marginal_probability: thought.log_p.exp(),
        }
    }

    /// {A, B} {C}
    fn groups(&self, groups: &[Vec<AgentId>]) -> String {
        let name = |group: &Vec<AgentId>| {
            let members: Vec<String> = group.iter().map(|a| self.agent(*a)).collect();
            format!("{{{}}}", members.join(", "))
        };
        groups.iter().map(name).collect::<Vec<_>>().join(" ")
    }

    fn joint_action(&self, members: &[AgentId], actions: &[Action]) -> String {
        let each = members.iter().zip(actions);
        let names = each.map(|(member, action)| self.opened.names.action(*member, *action));
        names.collect::<Vec<_>>().join(" + ")
    }

    fn team(&self, team: &GroupThought, taken: impl Fn(AgentId) -> Action) -> Team {
        let own: Vec<Action> = team.members.iter().map(|member| taken(*member)).collect();
        Team {
            members: team
                .members
                .iter()
                .map(|agent| self.agent(*agent))
                .collect(),
            joint: (team.joint.iter())
                .map(|option| Entry {
                    action: self.joint_action(&team.members, &option.actions),
                    probability: option.probability,
                    is_taken: option.actions == own,
                })
                .collect(),
        }
    }

    fn pair(&self, pair: &PairThought, taken: impl Fn(AgentId) -> Action) -> Pair {
        let own = pair.members.map(taken);
        Pair {
            members: pair.members.map(|agent| self.agent(agent)),
            choice: pair.choice,
            delegate_probability: pair.delegate,
            joint: (pair.joint.iter())
                .map(|option| Entry {
                    action: self.joint_action(&pair.members, &option.actions),
                    probability: option.probability,
                    is_taken: option.actions == own,
                })
                .collect(),
            posterior_joint: pair.posterior_joint,
            posterior_delegate: pair.posterior_delegate,
        }
    }

    /// The choices on the way, from the top.
    fn path(&self, thought: &Thought, taken: impl Fn(AgentId) -> Action + Copy) -> Vec<Chosen> {
        let mut path = Vec::new();
        let chosen = thought.chosen.map(|index| &thought.partitions[index]);
        path.extend(chosen.map(|partition| Chosen {
            controller: PARTITION.to_owned(),
            choice: self.groups(&living_groups(thought, partition)),
            probability: partition.probability,
        }));
        let teams = thought.groups.iter().map(|group| self.team(group, taken));
        path.extend(teams.filter_map(|team| {
            let option = team.joint.into_iter().find(|option| option.is_taken)?;
            Some(Chosen {
                controller: team.members.join(", "),
                choice: option.action,
                probability: option.probability,
            })
        }));
        let mut together = EntitySet::EMPTY;
        for pair in &thought.pairs {
            let Some(choice) = pair.choice else { continue };
            let (choice, probability) = match choice {
                GroupChoice::Delegate => ("delegate".to_owned(), pair.delegate),
                GroupChoice::Joint => {
                    let actions = pair.members.map(taken);
                    let mut options = pair.joint.iter();
                    let option = options.find(|option| option.actions == actions);
                    together = together.union(pair.members.into_iter().collect());
                    let name = self.joint_action(&pair.members, &actions);
                    (name, option.map_or(0.0, |option| option.probability))
                }
            };
            path.push(Chosen {
                controller: pair.members.map(|agent| self.agent(agent)).join(", "),
                choice,
                probability,
            });
        }
        let alone = (thought.agents.iter()).filter(|agent| !together.contains(agent.agent));
        path.extend(alone.filter_map(|agent| {
            let action = taken(agent.agent);
            let mut options = agent.options.iter();
            let option = options.find(|option| option.action == action)?;
            Some(Chosen {
                controller: self.agent(agent.agent),
                choice: self.opened.names.action(agent.agent, action),
                probability: option.probability,
            })
        }));
        path
    }
}
