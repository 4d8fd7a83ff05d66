//! What can be chosen about the hierarchy.

use std::{fmt, str::FromStr};

use mackrl_env::{
    EnvironmentSpec, declare_settings, declare_words,
    settings::{Accepts, SettingsError, WrongSetting},
};
use serde::{Deserialize, Serialize};

use crate::{
    Error,
    common_knowledge::CommonKnowledgeFeatures,
    partition::{PartitionSchedule, partition_count},
    policy::{Declaration, Delegation, Exploring, Selection},
};

declare_words! {
    /// The levels of groups between the team and single agents.
    pub enum Levels {
        /// Pairs, as in the paper.
        #[default]
        Pairs = "pairs",
        /// Groups of four, which divide into pairs.
        Fours = "fours",
    }
}

declare_settings! {
    /// The controllers of the hierarchy.
    pub struct MackrlSettings {
        /// Which features of commonly known entities the controllers read: all of them, or those of the authors' code.
        common_knowledge: CommonKnowledgeFeatures = CommonKnowledgeFeatures::Complete, CommonKnowledgeFeatures::ACCEPTS;
        /// The levels of groups between the team and single agents: pairs, as in the paper, or fours that divide into pairs. A four
        /// chooses among its three partitions on what *it* commonly knows, which is more than what the whole team does; for at
        /// most 8 agents.
        levels: Levels = Levels::Pairs, Levels::ACCEPTS;
        /// Which partitions into pairs the pair selector chooses from, where the team divides into pairs. More than 8 agents have too many to take all; they take
        /// `round-robin` unless something else is asked for.
        partitions: PartitionChoice = PartitionChoice::All, PartitionChoice::ACCEPTS;
        /// How a partition is chosen: the pair selector decides, or, as an ablation, all are equally likely.
        selector: Selection = Selection::Learned, Selection::ACCEPTS;
        /// When pairs delegate: their controllers decide, or, as ablations, always, or only where no joint action is commonly known.
        delegation: Delegation = Delegation::Learned, Delegation::ACCEPTS;
        /// What is added to the logit of delegating, of an untrained pair controller: 0 is the authors' choice; an untrained pair
        /// delegates about as often as it takes one certain joint action then.
        delegation_logit: f64 = 0.0, Accepts::within(-1000.0, 1000.0);
        /// Into whose choices ε is mixed: those of pairs and agents, as in the authors' experiments; those of the pair selector as well;
        /// or those of agents alone.
        exploration_levels: Exploring = Exploring::Acting, Exploring::ACCEPTS;
    }
}

impl Levels {
    /// Checks that the team of `spec` has such groups, and these partitions if it divides into pairs.
    ///
    /// # Errors
    /// [`SettingsError::Wrong`] if it is too large for fours, or has not these partitions.
    pub(in crate::algorithms) fn check(
        self,
        partitions: PartitionChoice,
        spec: &EnvironmentSpec,
    ) -> Result<(), SettingsError> {
        let most = PartitionSchedule::MOST_AGENTS_ENUMERATED;
        if self == Self::Pairs {
            return partitions.check(spec);
        }
        if spec.agents <= most {
            return Ok(());
        }
        Err(SettingsError::Wrong(WrongSetting {
            name: "levels".to_owned(),
            found: format!("\"{}\"", self.word()),
            expected: format!(
                "\"pairs\" for the {} agents of {}: only teams of at most {most} divide into fours",
                spec.agents, spec.name
            ),
            nearest: None,
        }))
    }

    /// The hierarchy of a team of N agents with A actions each; sampled partitions are drawn from `seed`.
    ///
    /// # Errors
    /// [`Error::Config`] if the team is too large for the partitions.
    pub(in crate::algorithms) fn declaration(
        self,
        partitions: PartitionChoice,
        (selector, delegation): (Selection, Delegation),
        team: [usize; 2],
        seed: u64,
    ) -> Result<Declaration, Error> {
        match self {
            Self::Pairs => {
                Declaration::pairwise(team, partitions.into(), selector, delegation, seed)
            }
            Self::Fours => Declaration::fours(team, selector, delegation),
        }
    }
}

impl MackrlSettings {
    /// The hierarchy of a team of N agents with A actions each; sampled partitions are drawn from `seed`.
    ///
    /// # Errors
    /// [`Error::Config`] if the team is too large for the partitions.
    pub fn declaration(&self, team: [usize; 2], seed: u64) -> Result<Declaration, Error> {
        let how = (self.selector, self.delegation);
        let declaration = self.levels.declaration(self.partitions, how, team, seed)?;
        Ok(declaration
            .with_exploration(self.exploration_levels)
            .with_delegation_logit(self.delegation_logit))
    }
}

/// Which partitions of the agents into pairs the pair selector chooses from; written `all`, `round-robin` or `sampled:K`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum PartitionChoice {
    /// Every partition; for teams of at most 8 agents (105 partitions).
    #[default]
    All,
    /// One partition a step, by the circle method on a relabelling drawn from the shared seed.
    RoundRobin,
    /// This many partitions (1 to [`Self::SAMPLED_MAX`]), drawn once from the shared seed and kept for the whole run.
    Sampled(usize),
}

impl PartitionChoice {
    /// The largest sample: the selector has an output for each, so more would cost memory and time without use.
    pub const SAMPLED_MAX: usize = 9999;

    /// What can be written.
    pub const ACCEPTS: Accepts = Accepts::Text {
        expects: "`all`, `round-robin` or `sampled:K` with K in [1, 9999]",
        pattern: Some("^(all|round-robin|sampled:[1-9][0-9]{0,3})$"),
    };

    /// Checks that the team of `spec` has these partitions.
    ///
    /// # Errors
    /// [`SettingsError::Wrong`] if it has not.
    fn check(self, spec: &EnvironmentSpec) -> Result<(), SettingsError> {
        let Some(expected) = self.expected_of(spec.agents) else {
            return Ok(());
        };
        Err(SettingsError::Wrong(WrongSetting {
            name: "partitions".to_owned(),
            found: format!("\"{self}\""),
            expected: format!("{expected} for the {} agents of {}", spec.agents, spec.name),
            nearest: None,
        }))
    }

    /// What could be chosen instead, if a team of so many agents has not the partitions that this asks for.
    fn expected_of(self, agents: usize) -> Option<String> {
        match self {
            Self::All if agents > PartitionSchedule::MOST_AGENTS_ENUMERATED => {
                Some("`round-robin` or `sampled:K`".to_owned())
            }
            Self::Sampled(count) if count as u128 > partition_count(agents) => Some(format!(
                "`all` or `sampled:K` with K <= {}",
                partition_count(agents)
            )),
            _ => None,
        }
    }
}

impl From<PartitionChoice> for PartitionSchedule {
    fn from(choice: PartitionChoice) -> Self {
        match choice {
            PartitionChoice::All => Self::All,
            PartitionChoice::RoundRobin => Self::RoundRobin,
            PartitionChoice::Sampled(count) => Self::Sampled { count },
        }
    }
}

impl fmt::Display for PartitionChoice {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::All => formatter.write_str("all"),
            Self::RoundRobin => formatter.write_str("round-robin"),
            Self::Sampled(count) => write!(formatter, "sampled:{count}"),
        }
    }
}

impl FromStr for PartitionChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "all" => Ok(Self::All),
            "round-robin" => Ok(Self::RoundRobin),
            _ => text
                .strip_prefix("sampled:")
                .and_then(|count| count.parse().ok())
                .filter(|count| (1..=Self::SAMPLED_MAX).contains(count))
                .map(Self::Sampled)
                .ok_or_else(|| format!("`{text}` is not {}", Self::ACCEPTS)),
        }
    }
}

impl TryFrom<String> for PartitionChoice {
    type Error = String;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        text.parse()
    }
}

impl From<PartitionChoice> for String {
    fn from(choice: PartitionChoice) -> Self {
        choice.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partition_choices_are_read_as_they_are_written() {
        for choice in [
            PartitionChoice::All,
            PartitionChoice::RoundRobin,
            PartitionChoice::Sampled(5),
        ] {
            assert_eq!(choice.to_string().parse(), Ok(choice));
        }
    }

    #[test]
    fn a_team_is_not_asked_for_partitions_that_it_does_not_have() {
        assert_eq!(PartitionChoice::All.expected_of(8), None);
        assert!(PartitionChoice::All.expected_of(9).is_some());
        assert_eq!(PartitionChoice::RoundRobin.expected_of(27), None);
        assert_eq!(PartitionChoice::Sampled(3).expected_of(3), None);
        assert_eq!(
            PartitionChoice::Sampled(4).expected_of(3).as_deref(),
            Some("`all` or `sampled:K` with K <= 3")
        );
    }

    #[test]
    fn a_sample_has_at_least_one_partition_and_not_too_many() {
        for text in [
            "sampled:0",
            "sampled:",
            "sampled:-1",
            "sampled:10000",
            "sampled",
            "some",
        ] {
            assert!(text.parse::<PartitionChoice>().is_err(), "{text}");
        }
    }
}
