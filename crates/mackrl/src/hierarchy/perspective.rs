//! Whose eyes the controllers look through: those of all agents, in the central run, or those of one agent alone.
//!
//! Both give the same bits for every group that the one agent belongs to; that is what common knowledge means, and what
//! the certificate compares.

use mackrl_env::{Action, AgentId, KnownEntities, LocalView, Observations, PriorKnowledge};

use crate::common_knowledge::{common_knowledge, common_knowledge_from_view};

/// What controllers may look at.
#[derive(Clone, Copy)]
pub(crate) enum Perspective<'a> {
    /// The local views of all agents, of all environments.
    Everybody(&'a Observations),
    /// The local view of one agent, and what it knew before the game.
    One(LocalView<'a>, &'a dyn PriorKnowledge),
}

impl<'a> Perspective<'a> {
    /// The view of `agent` in environment `b`.
    pub(crate) fn view(self, b: usize, agent: AgentId) -> LocalView<'a> {
        match self {
            Self::Everybody(observations) => observations.local_view(b, agent),
            Self::One(view, _) => view,
        }
    }

    /// Whether `agent` acts in environment `b`, as far as can be told. One agent alone does not always see whether another
    /// lives; it goes on computing for groups whose other members are dead, which can only divide.
    pub(crate) fn acts(self, b: usize, agent: AgentId) -> bool {
        match self {
            Self::Everybody(observations) => is_alive(observations.local_view(b, agent)),
            Self::One(..) => true,
        }
    }

    /// What `group` commonly knows in environment `b`.
    pub(crate) fn common_knowledge(self, b: usize, group: &[AgentId]) -> KnownEntities<'a> {
        match self {
            Self::Everybody(observations) => {
                let known = common_knowledge(group, observations.visible(b));
                let member = observations.local_view(b, group[0]);
                member.seen().restricted_to(known)
            }
            Self::One(view, prior) => {
                let known = common_knowledge_from_view(group, view.seen(), prior);
                view.seen().restricted_to(known)
            }
        }
    }

    /// What those members of `group` commonly know that live in environment `b`. To one agent alone, whoever is out of its sight is
    /// dead, which is true where the living always see each other.
    pub(crate) fn common_knowledge_of_living(
        self,
        b: usize,
        group: &[AgentId],
    ) -> KnownEntities<'a> {
        let lives = |agent: AgentId| match self {
            Self::Everybody(observations) => is_alive(observations.local_view(b, agent)),
            Self::One(view, _) => view.seen().set().contains(agent),
        };
        let members = group.iter().copied();
        let living: Vec<AgentId> = members.filter(|&agent| lives(agent)).collect();
        self.common_knowledge(b, if living.is_empty() { group } else { &living })
    }
}

/// Whether the agent still acts. The dead see nothing, not even themselves; their one available action needs no network.
pub(crate) fn is_alive(view: LocalView<'_>) -> bool {
    !view.seen().set().is_empty()
}

/// The only action of an agent that no longer acts.
pub(crate) fn forced_action(view: LocalView<'_>) -> Action {
    let first = view.available().iter().position(|&available| available);
    Action::new(first.unwrap_or_default())
}
