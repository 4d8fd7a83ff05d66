//! The hierarchies that are declared: that of the paper, one with fours, agents alone, and the whole team as one.

use mackrl_env::AgentId;

use super::{
    Declaration, Delegation, Division, LEVELS_MAX, Level, Memory, Part, Reads, Selection, TEAM,
};
use crate::{
    Error,
    partition::{Pairs, PartitionSchedule, Partitions, ways_to_divide},
};

impl Declaration {
    /// Pairwise MACKRL (Table 1): the team divides into pairs, a pair acts jointly or divides into its members.
    ///
    /// # Errors
    /// [`Error::Config`] if the team is too large for the schedule of partitions.
    pub fn pairwise(
        [agents, actions]: [usize; 2],
        schedule: PartitionSchedule,
        selection: Selection,
        delegation: Delegation,
        seed: u64,
    ) -> Result<Self, Error> {
        let partitions = schedule.plan(agents, seed)?;
        let divisions = partitions.fixed().iter().map(Division::from);
        let mut team = team(agents, divisions.collect());
        team.divisions = partitions.count();
        team.selection = selection;
        let levels = vec![team, pairs(agents, 2, delegation), alone(agents)];
        let rounds = (!partitions.are_fixed()).then_some(partitions);
        Ok(Self::new([agents, actions], levels, rounds, true))
    }

    /// Team → fours → pairs → agents: the team divides into groups of four, a four chooses among its three partitions into
    /// pairs on its *own* common knowledge, and pairs act jointly or divide. Where the team is no multiple of four, what is
    /// left of it divides into pairs at once.
    ///
    /// # Errors
    /// [`Error::Config`] if there are more than 8 agents: ten have 1 575 divisions into fours.
    pub fn fours(
        [agents, actions]: [usize; 2],
        selection: Selection,
        delegation: Delegation,
    ) -> Result<Self, Error> {
        const SIZE: usize = 4;
        let most = PartitionSchedule::MOST_AGENTS_ENUMERATED;
        if agents == 0 || agents > most {
            return Err(Error::Config(format!(
                "a team of {agents} cannot choose among all its divisions into fours, expected 1 to {most} agents"
            )));
        }
        let everybody: Vec<AgentId> = (0..agents).map(AgentId::new).collect();
        let pairing = Pairs::new(agents);
        let small = |group: &[AgentId]| match *group {
            [agent] => Part {
                level: 3,
                group: agent.index(),
            },
            [a, b] => Part {
                level: 2,
                group: pairing.index_of(a, b),
            },
            _ => unreachable!("groups of three and more divide further"),
        };
        let mut fours: Vec<Vec<AgentId>> = Vec::new();
        let mut divisions = Vec::new();
        for groups in ways_to_divide(&everybody, SIZE) {
            let (large, rest): (Vec<_>, Vec<_>) =
                groups.into_iter().partition(|group| group.len() == SIZE);
            let parts = large.into_iter().map(|group| {
                let known = fours.iter().position(|four| *four == group);
                let group = known.unwrap_or_else(|| {
                    fours.push(group);
                    fours.len() - 1
                });
                Part { level: 1, group }
            });
            let parts: Vec<Part> = parts.collect();
            for rest in ways_to_divide(&rest.concat(), 2) {
                let rest = rest.iter().map(|group| small(group));
                divisions.push(Division {
                    parts: parts.iter().copied().chain(rest).collect(),
                });
            }
        }
        let inner = fours.iter().map(|four| {
            let ways = ways_to_divide(four, 2).into_iter();
            ways.map(|pairs| Division {
                parts: pairs.iter().map(|pair| small(pair)).collect(),
            })
            .collect()
        });
        let four = Level {
            name: "four_controller",
            divisions_gd: inner.collect(),
            divisions: 3,
            groups: fours,
            acts: None,
            selection: Selection::Learned,
            reads: Reads::CommonKnowledgeAndMembers,
            explores: false,
            delegation_logit: 0.0,
            memory: Memory::Episode,
            survives: false,
            active: Vec::new(),
        };
        let mut team = team(agents, divisions);
        team.name = "four_selector";
        team.selection = selection;
        let levels = vec![team, four, pairs(agents, 3, delegation), alone(agents)];
        Ok(Self::new([agents, actions], levels, None, false))
    }

    /// No upper levels: every agent acts alone, as in Central-V.
    ///
    /// # Panics
    /// If there are no agents.
    #[must_use]
    pub fn agents_alone([agents, actions]: [usize; 2]) -> Self {
        assert!(agents > 0, "a team has agents");
        let parts = (0..agents).map(|group| Part { level: 1, group }).collect();
        let levels = vec![team(agents, vec![Division { parts }]), alone(agents)];
        Self::new([agents, actions], levels, None, false)
    }

    /// Most joint actions of [`Declaration::whole_team`]: its controller has an output for each.
    pub const JOINT_ACTIONS_MAX: usize = 4096;

    /// The number of joint actions of N agents with A actions each, A to the power of N, if there are not too many for one
    /// controller.
    #[must_use]
    pub fn joint_actions([agents, actions]: [usize; 2]) -> Option<usize> {
        let mut factors = std::iter::repeat_n(actions, agents);
        let count = factors.try_fold(1_usize, usize::checked_mul)?;
        (count <= Self::JOINT_ACTIONS_MAX).then_some(count)
    }

    /// One controller of the whole team, which takes a joint action on what the team commonly knows, and nothing below it: joint-action
    /// learning. It is made for worlds in which all living members always see each other.
    ///
    /// # Errors
    /// [`Error::Config`] if there are more than [`JOINT_ACTIONS_MAX`](Self::JOINT_ACTIONS_MAX) joint actions.
    pub fn whole_team([agents, actions]: [usize; 2]) -> Result<Self, Error> {
        if Self::joint_actions([agents, actions]).is_none() {
            return Err(Error::Config(format!(
                "{agents} agents with {actions} actions each have too many joint actions for one controller, expected at most {}",
                Self::JOINT_ACTIONS_MAX
            )));
        }
        let part = Part { level: 1, group: 0 };
        let division = Division { parts: vec![part] };
        let together = Level {
            name: "team_controller",
            groups: vec![(0..agents).map(AgentId::new).collect()],
            reads: Reads::CommonKnowledge,
            survives: true,
            ..alone(0)
        };
        let levels = vec![team(agents, vec![division]), together];
        Ok(Self::new([agents, actions], levels, None, false))
    }

    fn new(
        [agents, actions]: [usize; 2],
        mut levels: Vec<Level>,
        rounds: Option<Partitions>,
        is_pairwise: bool,
    ) -> Self {
        debug_assert!(
            levels.len() <= LEVELS_MAX,
            "a declaration has at most four levels"
        );
        let mut reached: Vec<Vec<bool>> = levels
            .iter()
            .map(|level| vec![rounds.is_some(); level.groups.len()])
            .collect();
        reached[TEAM].fill(true);
        for level in &levels {
            for part in level
                .divisions_gd
                .iter()
                .flatten()
                .flat_map(|division| &division.parts)
            {
                reached[part.level][part.group] = true;
            }
        }
        for (level, reached) in levels.iter_mut().zip(reached) {
            level.active = (0..reached.len()).filter(|&group| reached[group]).collect();
        }
        Self {
            agents,
            actions,
            levels,
            rounds,
            hold: Some(1),
            is_pairwise,
        }
    }
}

fn team(agents: usize, divisions: Vec<Division>) -> Level {
    Level {
        name: "pair_selector",
        groups: vec![(0..agents).map(AgentId::new).collect()],
        divisions: divisions.len(),
        divisions_gd: vec![divisions],
        acts: None,
        selection: Selection::Learned,
        reads: Reads::CommonKnowledge,
        explores: false,
        delegation_logit: 0.0,
        memory: Memory::Episode,
        survives: false,
        active: Vec::new(),
    }
}

/// All pairs; a pair divides into its members, who stand at level `below`.
fn pairs(agents: usize, below: usize, delegation: Delegation) -> Level {
    let pairs = Pairs::new(agents);
    let divisions = pairs.iter().map(|pair| {
        let members = pair.agents().into_iter();
        let parts = members.map(|agent| Part {
            level: below,
            group: agent.index(),
        });
        vec![Division {
            parts: parts.collect(),
        }]
    });
    Level {
        name: "pair_controller",
        divisions_gd: divisions.collect(),
        divisions: 1,
        groups: pairs.iter().map(|pair| pair.agents().to_vec()).collect(),
        acts: Some(delegation),
        selection: Selection::Learned,
        reads: Reads::CommonKnowledgeAndMembers,
        explores: true,
        delegation_logit: 0.0,
        memory: Memory::Episode,
        survives: false,
        active: Vec::new(),
    }
}

fn alone(agents: usize) -> Level {
    Level {
        name: "agent_controller",
        groups: (0..agents).map(|agent| vec![AgentId::new(agent)]).collect(),
        divisions_gd: Vec::new(),
        divisions: 0,
        acts: Some(Delegation::Never),
        selection: Selection::Learned,
        reads: Reads::OwnObservation,
        explores: true,
        delegation_logit: 0.0,
        memory: Memory::Episode,
        survives: false,
        active: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use mackrl_env::Action;

    use super::*;

    fn sorted(declaration: &Declaration, division: &Division) -> Vec<usize> {
        let members = division
            .parts
            .iter()
            .flat_map(|part| declaration.members(*part));
        let mut members: Vec<usize> = members.map(|agent| agent.index()).collect();
        members.sort_unstable();
        members
    }

    #[test]
    fn every_division_of_every_group_is_a_partition_of_it() {
        let pairwise = |agents| {
            Declaration::pairwise(
                [agents, 3],
                PartitionSchedule::All,
                Selection::Learned,
                Delegation::Learned,
                1,
            )
        };
        for agents in 1..=8 {
            for declaration in [
                pairwise(agents).unwrap(),
                Declaration::fours([agents, 3], Selection::Learned, Delegation::Learned).unwrap(),
                Declaration::agents_alone([agents, 3]),
            ] {
                for (place, level) in declaration.levels().iter().enumerate() {
                    for (group, divisions) in level.divisions_gd.iter().enumerate() {
                        assert_eq!(
                            divisions.len(),
                            level.divisions,
                            "{} agents, {}",
                            agents,
                            level.name
                        );
                        let members: Vec<usize> = level.groups[group]
                            .iter()
                            .map(|agent| agent.index())
                            .collect();
                        for division in divisions {
                            assert_eq!(sorted(&declaration, division), members);
                            assert!(division.parts.iter().all(|part| part.level > place));
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_whole_team_has_one_controller_unless_its_joint_actions_are_too_many() {
        let declaration = Declaration::whole_team([3, 9]).unwrap();
        let [_, together] = declaration.levels() else {
            panic!("two levels");
        };
        assert_eq!((together.groups.len(), together.columns(9)), (1, 729));
        let actions: Vec<Action> = [2, 0, 5].map(Action::new).to_vec();
        assert_eq!(together.column(0, 9, &actions), Some(2 * 81 + 5));
        assert_eq!(Declaration::joint_actions([4, 8]), Some(4096));
        assert_eq!(Declaration::joint_actions([64, 9]), None);
        let refused = Declaration::whole_team([5, 11]).unwrap_err().to_string();
        assert!(refused.contains("expected at most 4096"), "{refused}");
    }

    #[test]
    fn eight_agents_have_35_divisions_into_fours_and_each_four_has_three() {
        let fours = Declaration::fours([8, 14], Selection::Learned, Delegation::Learned).unwrap();
        let levels = fours.levels();
        assert_eq!(
            levels
                .iter()
                .map(|level| level.groups.len())
                .collect::<Vec<_>>(),
            [1, 70, 28, 8]
        );
        assert_eq!(
            levels
                .iter()
                .map(|level| level.columns(14))
                .collect::<Vec<_>>(),
            [35, 3, 1 + 14 * 14, 14]
        );
        assert!(Declaration::fours([9, 2], Selection::Learned, Delegation::Learned).is_err());
    }

    #[test]
    fn columns_count_divisions_first_and_then_joint_actions() {
        let declaration =
            Declaration::fours([8, 14], Selection::Learned, Delegation::Learned).unwrap();
        let actions: Vec<Action> = (0..8).map(Action::new).collect();
        let [team, four, pair, agent] = declaration.levels() else {
            panic!("four levels");
        };
        assert_eq!(
            (team.column(0, 14, &actions), four.column(3, 14, &actions)),
            (None, None)
        );
        // Pair 1 is of agents 0 and 2.
        assert_eq!(pair.column(1, 14, &actions), Some(1 + 2));
        assert_eq!(agent.column(5, 14, &actions), Some(5));
    }
}
