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
    /// What stands for the type of every unit.
    letters: Vec<String>,
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
        let kinds: Vec<String> = recruits
            .clone()
            .map(|recruit| printable(&profile(recruit.kind).name))
            .collect();
        Self {
            agents: skirmish.spec().agents,
            letters: kinds.iter().map(|kind| letters(kind, &kinds)).collect(),
            kinds,
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

    /// One or two letters that stand for the entity's type in this battle: M, or Me and Mn where several types begin with M.
    #[must_use]
    pub fn letters(&self, entity: EntityId) -> &str {
        self.letters.get(entity.index()).map_or("", String::as_str)
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

/// The first letter of `kind` and, if other kinds have the same, the first later one that none of these has in its place.
fn letters(kind: &str, kinds: &[String]) -> String {
    let mut own = kind.chars();
    let first: String = own
        .next()
        .into_iter()
        .flat_map(char::to_uppercase)
        .collect();
    let begins = |other: &&String| {
        *other != kind && other.to_uppercase().starts_with(&first) && !first.is_empty()
    };
    let rivals: Vec<&String> = kinds.iter().filter(begins).collect();
    if rivals.is_empty() {
        return first;
    }
    let second = own.enumerate().find(|(place, letter)| {
        let is_shared = |rival: &&String| rival.chars().nth(place + 1) == Some(*letter);
        !rivals.iter().any(is_shared)
    });
    first + &second.map_or_else(String::new, |(_, letter)| letter.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_that_begin_alike_have_two_letters() {
        let all = |kinds: &[&str]| -> Vec<String> {
            let kinds: Vec<String> = kinds.iter().map(|&kind| kind.to_owned()).collect();
            kinds.iter().map(|kind| letters(kind, &kinds)).collect()
        };
        assert_eq!(all(&["stalker", "zealot", "stalker"]), ["S", "Z", "S"]);
        assert_eq!(all(&["marine", "marauder", "medivac"]), ["Mn", "Ma", "Me"]);
        assert_eq!(all(&["", "ä"]), ["", "Ä"]);
    }
}
