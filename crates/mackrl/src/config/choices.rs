//! Settings that choose one of a few things.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use crate::partition::PartitionSchedule;

/// What learns.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Algorithm {
    /// Pairwise MACKRL: a pair selector, pair controllers and agent controllers.
    #[default]
    Mackrl,
    /// Central-V: the agent controllers alone, with the same central critic.
    CentralV,
}

/// What plays the battles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Engine {
    /// The built-in simulator.
    #[default]
    Simulator,
    /// StarCraft II itself, or a server that stands in for it.
    Sc2,
}

/// How parameters follow the gradient.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OptimiserKind {
    /// Adam (Kingma and Ba, 2015), as the paper says.
    #[default]
    Adam,
    /// `RMSprop`, as the authors' code.
    Rmsprop,
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
    /// This many partitions (at least 1), drawn once from the shared seed and kept for the whole run.
    Sampled(usize),
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
                .filter(|&count| count >= 1)
                .map(Self::Sampled)
                .ok_or_else(|| {
                    format!("`{text}` is not all, round-robin or sampled:K with K >= 1")
                }),
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
    fn a_sample_has_at_least_one_partition() {
        for text in ["sampled:0", "sampled:", "sampled:-1", "sampled", "some"] {
            assert!(text.parse::<PartitionChoice>().is_err(), "{text}");
        }
    }
}
