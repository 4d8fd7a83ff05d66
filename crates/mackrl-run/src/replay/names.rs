//! What agents, other entities and actions are called.

use mackrl_env::{Action, AgentId, EntityId, Environment};
use mackrl_skirmish::Skirmish;

/// First action that has a target.
const TARGETS_FROM: usize = 6;

/// Names in the paper's manner: agents are A, B, C, …, enemies e0, e1, …
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Names {
    agents: usize,
    /// Name of the type of every unit.
    kinds: Vec<String>,
    heals: Vec<bool>,
}

impl Names {
    /// Names for the units of a battle.
    #[must_use]
    pub fn new(skirmish: &Skirmish) -> Self {
        let scenario = skirmish.scenario();
        let profiles = &scenario.field.profiles;
        let profile = |kind: u8| &profiles[usize::from(kind)];
        let recruits = scenario.recruits.iter();
        Self {
            agents: skirmish.spec().agents,
            kinds: recruits
                .clone()
                .map(|recruit| printable(&profile(recruit.kind).name))
                .collect(),
            heals: recruits
                .map(|recruit| profile(recruit.kind).care.is_some())
                .collect(),
        }
    }

    /// A, B, …, Z, A1, B1, …
    #[must_use]
    pub fn agent(&self, agent: AgentId) -> String {
        let (round, letter) = (agent.index() / 26, agent.index() % 26);
        let letter = char::from(b'A' + u8::try_from(letter).unwrap_or_default());
        if round == 0 {
            letter.to_string()
        } else {
            format!("{letter}{round}")
        }
    }

    /// An agent's letter, or e and an enemy's number.
    #[must_use]
    pub fn entity(&self, entity: EntityId) -> String {
        match entity.index().checked_sub(self.agents) {
            Some(enemy) => format!("e{enemy}"),
            None => self.agent(AgentId::new(entity.index())),
        }
    }

    /// The name of the entity's type.
    #[must_use]
    pub fn kind(&self, entity: EntityId) -> &str {
        self.kinds.get(entity.index()).map_or("", String::as_str)
    }

    /// What `agent` does by `action`.
    #[must_use]
    pub fn action(&self, agent: AgentId, action: Action) -> String {
        let plain = ["none (dead)", "stop", "north", "south", "east", "west"];
        match action.index().checked_sub(TARGETS_FROM) {
            None => plain[action.index()].to_owned(),
            Some(target) if self.heals.get(agent.index()) == Some(&true) => {
                format!("heal {}", self.agent(AgentId::new(target)))
            }
            Some(target) => format!("attack e{target}"),
        }
    }
}

/// A name that somebody wrote, without what would change a terminal or break a document.
fn printable(name: &str) -> String {
    name.chars().filter(|c| !c.is_control()).collect()
}
