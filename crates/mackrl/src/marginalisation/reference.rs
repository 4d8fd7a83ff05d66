//! The general hierarchy of eq. (4), Algorithm 1 and eq. (5), written to be read.
//!
//! A [`Controller`] governs a group. It either acts for the whole group or divides it into smaller groups, each with a
//! controller of its own. Groups, depths and partitions are arbitrary; a hierarchy is a plain tree of probabilities in
//! `f64`. Its cost is exponential in every respect: it exists so that [`super::log_likelihood`] can be tested against it.

use mackrl_env::{Action, AgentId};

use crate::policy::{Part, PolicyTable, TEAM};

/// An assignment of actions to some of the agents.
pub type Assignment = Vec<(AgentId, Action)>;

/// π^𝒢 at one step, eq. (4): a distribution over the joint actions of the group and its partitions,
/// `𝓤_𝒢 = 𝓤_env^𝒢 ∪ 𝓟(𝒢)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller {
    /// The possible choices with their probabilities, which sum to 1.
    pub choices: Vec<(f64, Choice)>,
}

/// What the controller of a group can choose.
#[derive(Debug, Clone, PartialEq)]
pub enum Choice {
    /// A joint action: an action for each member of the group.
    Act(Assignment),
    /// A partition: a controller for each part of the group.
    Divide(Vec<Controller>),
}

/// A possible outcome of Algorithm 1.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightedPath {
    /// p(path | s): the product of the probabilities of all choices on the path.
    pub probability: f64,
    /// The joint action in which the path ends.
    pub assignment: Assignment,
}

impl Controller {
    /// The hierarchy of `table` as a tree: the team and all that it may divide into.
    #[must_use]
    pub fn of_team(table: &PolicyTable<'_, f64>) -> Self {
        Self::of_group(
            table,
            Part {
                level: TEAM,
                group: 0,
            },
        )
    }

    fn of_group(table: &PolicyTable<'_, f64>, part: Part) -> Self {
        let members = table.declaration().members(part);
        let actions = table.declaration().actions();
        let divisions = table.divisions(part);
        let choices = table.row(part).iter().enumerate().map(|(column, log_p)| {
            let choice = match divisions.get(column) {
                Some(division) => {
                    let parts = division.parts.iter();
                    Choice::Divide(parts.map(|part| Self::of_group(table, *part)).collect())
                }
                None => Choice::Act(joint_action(members, actions, column - divisions.len())),
            };
            (log_p.exp(), choice)
        });
        Self {
            choices: choices.collect(),
        }
    }

    /// Every path through this controller and those below it.
    #[must_use]
    pub fn paths(&self) -> Vec<WeightedPath> {
        self.choices
            .iter()
            .flat_map(|(probability, choice)| {
                choice.paths().into_iter().map(move |path| WeightedPath {
                    probability: probability * path.probability,
                    assignment: path.assignment,
                })
            })
            .collect()
    }

    /// p(u | s), eq. (5): `Σ_path p(u | s, path)·p(path | s)`, where p(u | s, path) is 1 if the path ends in u and else 0.
    ///
    /// # Shapes
    /// `actions_n` \[N\].
    #[must_use]
    pub fn probability(&self, actions_n: &[Action]) -> f64 {
        self.paths()
            .iter()
            .filter(|path| {
                path.assignment
                    .iter()
                    .all(|&(agent, action)| actions_n[agent.index()] == action)
            })
            .map(|path| path.probability)
            .sum()
    }

    /// Algorithm 1: samples a choice, and then below it, until every agent has an action. Each call of `uniform` gives a
    /// number in [0, 1).
    ///
    /// # Panics
    /// If a controller has no choice with a probability above 0.
    pub fn sample(&self, uniform: &mut impl FnMut() -> f64) -> Assignment {
        let mut rest = uniform();
        let mut possible = self.choices.iter().filter(|(p, _)| *p > 0.0).peekable();
        loop {
            let (p, choice) = possible.next().expect("a controller has a possible choice");
            rest -= p;
            if rest >= 0.0 && possible.peek().is_some() {
                continue;
            }
            return match choice {
                Choice::Act(assignment) => assignment.clone(),
                Choice::Divide(parts) => {
                    let mut assignment = Assignment::new();
                    for part in parts {
                        assignment.extend(part.sample(uniform));
                    }
                    assignment
                }
            };
        }
    }
}

/// The joint action of `members` that has this number: its digits to the base of the number of actions, the first member's
/// first.
fn joint_action(members: &[AgentId], actions: usize, mut number: usize) -> Assignment {
    let mut assignment = Assignment::new();
    for &member in members.iter().rev() {
        assignment.insert(0, (member, Action::new(number % actions)));
        number /= actions;
    }
    assignment
}

impl Choice {
    /// Every path below this choice: one for a joint action, all combinations of the parts' paths for a partition.
    fn paths(&self) -> Vec<WeightedPath> {
        match self {
            Self::Act(assignment) => vec![WeightedPath {
                probability: 1.0,
                assignment: assignment.clone(),
            }],
            Self::Divide(parts) => {
                let nothing = WeightedPath {
                    probability: 1.0,
                    assignment: Assignment::new(),
                };
                parts.iter().fold(vec![nothing], |paths, part| {
                    let part_paths = part.paths();
                    paths
                        .iter()
                        .flat_map(|path| part_paths.iter().map(|next| path.then(next)))
                        .collect()
                })
            }
        }
    }
}

impl WeightedPath {
    /// Both paths, taken by disjoint groups that choose independently.
    fn then(&self, other: &Self) -> Self {
        Self {
            probability: self.probability * other.probability,
            assignment: self
                .assignment
                .iter()
                .chain(&other.assignment)
                .copied()
                .collect(),
        }
    }
}
