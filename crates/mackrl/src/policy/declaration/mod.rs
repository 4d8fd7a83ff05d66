//! The hierarchy as a declaration: levels of groups, and what each group may choose.
//!
//! Eq. (4) lets the controller of a group 𝒢 choose from `𝓤_𝒢 = 𝓤_env^𝒢 ∪ 𝓟(𝒢)`: a joint action of its members, or a division
//! of 𝒢 into smaller groups that choose in turn. A [`Declaration`] says which groups there are, which of them act jointly and
//! how each may divide; everything else (the walk, the marginal, one agent alone, explanations) follows it. Groups of one
//! level share a network. A group divides into groups of *later* levels only, so level after level is an order from the root
//! to the leaves.
//!
//! Table 1 of the paper is [`Declaration::pairwise`]. Writing that one into the code instead, as three named controllers,
//! is shorter, and every other hierarchy is then a fork.

mod declared;

use mackrl_env::{Action, AgentId, Draw, EpisodeKey, declare_words};
use serde::Serialize;

use crate::partition::{Partition, PartitionBuffer, Partitions};

/// The level of the whole team: one group, the root.
pub const TEAM: usize = 0;
/// Most levels of a declaration.
pub const LEVELS_MAX: usize = 4;

declare_words! {
    /// How a group chooses between its divisions; anything but [`Selection::Learned`] is an ablation.
    pub enum Selection {
        /// A controller decides.
        #[default]
        Learned = "learned",
        /// Each division in force is as likely as any other, in greedy play too: a draw that all members share, and no choice.
        Uniform = "uniform",
    }
}

declare_words! {
    /// When a group that could act jointly may divide instead; anything but [`Delegation::Learned`] is an ablation.
    pub enum Delegation {
        /// Its controller decides.
        #[default]
        Learned = "learned",
        /// Always: the team is as good as independent agents with a central critic.
        Always = "always",
        /// Only where the group commonly knows no joint action.
        Never = "never",
    }
}

declare_words! {
    /// Into whose choices exploration is mixed.
    pub enum Exploring {
        /// Those of groups that may act: pairs and agents. Who chooses between divisions alone does not explore.
        #[default]
        Acting = "acting",
        /// Those of all groups.
        All = "all",
        /// Those of single agents.
        Agents = "agents",
    }
}

/// What the controllers of a level read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reads {
    /// What the group commonly knows.
    CommonKnowledge,
    /// What the group commonly knows, and who its members are.
    CommonKnowledgeAndMembers,
    /// Of a group of one: its own observation, who it is, and its last action.
    OwnObservation,
}

/// How long a group's controller remembers what it read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Memory {
    /// From the first step of the episode on, whether the group is chosen or not.
    #[default]
    Episode,
    /// As long as the group is formed: a group that was not formed at the step before begins anew. Groups that are not formed
    /// cost nothing, and under a partition that changes at every step a controller has no memory.
    WhileFormed,
}

/// A group of a later level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Part {
    /// Its level.
    pub level: usize,
    /// Its number within the level.
    pub group: usize,
}

/// One way to divide a group: disjoint groups that together are the group.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Division {
    /// The groups that it divides into.
    pub parts: Vec<Part>,
}

/// Groups whose controllers share a network.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// What its controllers are called, in files too: `pair_controller`.
    pub name: &'static str,
    /// Members of each group, ascending \[G\]\[members\]; all groups of a level have as many.
    pub groups: Vec<Vec<AgentId>>,
    /// The ways in which each group may divide \[G\]\[D\]; D is the same for all. Those of the team may change from step to
    /// step instead and are not listed here then.
    pub divisions_gd: Vec<Vec<Division>>,
    /// D: how many divisions a group chooses from at a step.
    pub divisions: usize,
    /// Whether a group may act jointly, and when it must.
    pub acts: Option<Delegation>,
    /// How it chooses. A group with one choice needs no network.
    pub selection: Selection,
    /// What it reads.
    pub reads: Reads,
    /// Whether exploration is mixed into its choices.
    pub explores: bool,
    /// Of groups that act jointly or divide instead: what is added to an untrained controller's logit of dividing.
    pub delegation_logit: f64,
    /// How long its controllers remember.
    pub memory: Memory,
    /// Whether a group goes on as its living members when others die: they know what the living commonly know, and what the dead would
    /// do counts as action 0. Otherwise a group with a dead member commonly knows nothing.
    pub survives: bool,
    /// Groups that some division of an earlier level contains, ascending.
    pub active: Vec<usize>,
}

/// Levels of groups: who may divide, who may act jointly, who acts alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Declaration {
    agents: usize,
    actions: usize,
    levels: Vec<Level>,
    /// The team's divisions where they change from step to step.
    rounds: Option<Partitions>,
    /// Steps for which a round stays in force; none if it does for the whole episode.
    hold: Option<usize>,
    is_pairwise: bool,
}

/// Room for divisions that change from step to step; reused, it makes [`Declaration::in_force`] free of allocation.
#[derive(Debug, Clone, Default)]
pub struct DivisionBuffer {
    partitions: PartitionBuffer,
    division: Division,
}

impl Level {
    /// Members of each group.
    #[must_use]
    pub fn size(&self) -> usize {
        self.groups.first().map_or(0, Vec::len)
    }

    /// C: columns of a group's row, the divisions first and then the joint actions, A to the power of its size.
    #[must_use]
    pub fn columns(&self, actions: usize) -> usize {
        self.divisions + self.joint_actions(actions)
    }

    /// The column of the joint action that is `action_of` each member, if the group may act jointly:
    /// `D + (…(u_1·A + u_2)·A + …)`.
    #[must_use]
    pub fn column(&self, group: usize, actions: usize, action_n: &[Action]) -> Option<usize> {
        self.acts?;
        let members = self.groups[group].iter();
        let joint = members.fold(0, |joint, member| {
            joint * actions + action_n[member.index()].index()
        });
        Some(self.divisions + joint)
    }

    /// Whether a network decides.
    #[must_use]
    pub fn is_learned(&self) -> bool {
        self.selection == Selection::Learned
            && !self.groups.is_empty()
            && (self.acts.is_some() || self.divisions > 1)
    }

    /// Whether a group may act jointly, or divide instead.
    #[must_use]
    pub const fn delegates(&self) -> bool {
        self.acts.is_some() && self.divisions > 0
    }

    /// Whether a group with a dead member has no choice left: it knows nothing in common and divides in one way, or it is the
    /// dead agent.
    #[must_use]
    pub const fn is_forced_by_death(&self) -> bool {
        self.divisions <= 1 && !self.survives
    }

    /// The name of the random number that decides for `group`.
    pub(crate) fn draw(&self, level: usize, group: usize) -> Draw {
        match (level, self.size()) {
            (TEAM, _) => Draw::Selector,
            (_, 1) => Draw::Agent(group),
            (_, 2) => Draw::Pair(group),
            (level, _) => Draw::Group(level, group),
        }
    }

    fn joint_actions(&self, actions: usize) -> usize {
        match self.acts {
            Some(_) => (0..self.size()).fold(1, |product, _| product * actions),
            None => 0,
        }
    }
}

impl Declaration {
    /// N: agents.
    #[must_use]
    pub const fn agents(&self) -> usize {
        self.agents
    }

    /// A: actions of an agent.
    #[must_use]
    pub const fn actions(&self) -> usize {
        self.actions
    }

    /// The levels, from the team to single agents.
    #[must_use]
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The last level: that of single agents, or the whole team's where no agent acts by itself.
    #[must_use]
    pub const fn alone(&self) -> usize {
        self.levels.len() - 1
    }

    /// Whether this is [`Declaration::pairwise`], whose marginal has a closed form.
    #[must_use]
    pub const fn is_pairwise(&self) -> bool {
        self.is_pairwise
    }

    /// Whether the team may divide in the same ways at every step, so that every active group can be asked at every step.
    #[must_use]
    pub const fn is_fixed(&self) -> bool {
        self.rounds.is_none()
    }

    /// The same hierarchy with each round of its partitions in force for `hold` steps (at least 1), or for the whole episode if
    /// that is 0, and pair controllers that remember for so long.
    ///
    /// # Panics
    /// If its partitions do not take turns.
    #[must_use]
    pub fn with_partitions_held(mut self, hold: usize, memory: Memory) -> Self {
        assert!(!self.is_fixed(), "partitions that take turns");
        self.hold = (hold > 0).then_some(hold);
        let alone = self.alone();
        for level in &mut self.levels[TEAM + 1..alone] {
            level.memory = memory;
        }
        self
    }

    /// The same hierarchy with exploration mixed into the choices of other levels.
    #[must_use]
    pub fn with_exploration(mut self, exploring: Exploring) -> Self {
        let alone = self.alone();
        for (place, level) in self.levels.iter_mut().enumerate() {
            level.explores = match exploring {
                Exploring::Acting => level.acts.is_some(),
                Exploring::All => true,
                Exploring::Agents => place == alone,
            };
        }
        self
    }

    /// The same hierarchy with `logit` added to the logit of dividing, in untrained controllers of groups that act jointly or divide
    /// instead.
    #[must_use]
    pub fn with_delegation_logit(mut self, logit: f64) -> Self {
        for level in &mut self.levels {
            level.delegation_logit = if level.delegates() { logit } else { 0.0 };
        }
        self
    }

    /// The ways in which the team may divide at `step` of the episode named `key`: a pure function of the two.
    #[must_use]
    pub fn in_force<'a>(
        &'a self,
        key: &EpisodeKey,
        step: usize,
        buffer: &'a mut DivisionBuffer,
    ) -> &'a [Division] {
        let Some(rounds) = &self.rounds else {
            return &self.levels[TEAM].divisions_gd[0];
        };
        let DivisionBuffer {
            partitions,
            division,
        } = buffer;
        let round = self.hold.map_or(0, |hold| step / hold);
        let [partition, ..] = rounds.in_force(key, round, partitions) else {
            unreachable!("a round robin has one partition at a step");
        };
        division.assign(partition);
        std::slice::from_ref(division)
    }

    /// The divisions of a group, `in_force` being those of the team.
    #[must_use]
    pub fn divisions<'a>(&'a self, part: Part, in_force: &'a [Division]) -> &'a [Division] {
        if part.level == TEAM {
            in_force
        } else {
            self.levels[part.level]
                .divisions_gd
                .get(part.group)
                .map_or(&[], Vec::as_slice)
        }
    }

    /// The members of a group.
    #[must_use]
    pub fn members(&self, part: Part) -> &[AgentId] {
        &self.levels[part.level].groups[part.group]
    }
}

/// A partition as a division of the pairwise hierarchy: its pairs and, of an odd team, the agent that stays alone.
impl From<&Partition> for Division {
    fn from(partition: &Partition) -> Self {
        let mut division = Self::default();
        division.assign(partition);
        division
    }
}

impl Division {
    /// Becomes the division of `partition`, without allocating if it had as many parts before.
    fn assign(&mut self, partition: &Partition) {
        let pairs = partition.pairs().iter().map(|pair| Part {
            level: 1,
            group: pair.index(),
        });
        let alone = partition.singleton().map(|agent| Part {
            level: 2,
            group: agent.index(),
        });
        self.parts.clear();
        self.parts.extend(pairs.chain(alone));
    }
}
