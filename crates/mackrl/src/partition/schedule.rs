//! Which partitions the pair selector may choose from, at every step of a run.

use std::collections::BTreeSet;

use mackrl_env::{AgentId, EpisodeKey};
use serde::{Deserialize, Serialize};

use super::{
    Pair, Pairs, Partition, all_partitions, partition_count, round_robin, sample::shuffle,
    sample_partitions,
};
use crate::Error;

/// How the set of partitions in force is made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum PartitionSchedule {
    /// All of them at every step, as in the paper; for at most [`Self::MOST_AGENTS_ENUMERATED`] agents.
    #[default]
    All,
    /// The same few at every step, drawn once from the run's seed.
    Sampled {
        /// How many distinct partitions, at least 1.
        count: usize,
    },
    /// One at a time: the rounds of a tournament between the agents, relabelled anew in every episode.
    RoundRobin,
}

impl PartitionSchedule {
    /// Agents up to which all partitions may be enumerated (8 have 105, 10 would have 945).
    pub const MOST_AGENTS_ENUMERATED: usize = 8;

    /// Prepares the schedule for a run with `agents` and the seed `seed`.
    ///
    /// # Errors
    /// [`Error::Config`] if there are no agents, too many to enumerate, or fewer partitions than the sample should have.
    pub fn plan(self, agents: usize, seed: u64) -> Result<Partitions, Error> {
        if agents == 0 {
            return Err(Error::Config(
                "a team has 0 agents, expected at least 1".into(),
            ));
        }
        let fixed = match self {
            Self::All if agents > Self::MOST_AGENTS_ENUMERATED => {
                return Err(Error::Config(format!(
                    "partition schedule `all` takes at most {} agents, found {agents} with {} partitions; \
                     set `algorithm.partitions` to `round-robin` or `sampled:K`",
                    Self::MOST_AGENTS_ENUMERATED,
                    partition_count(agents)
                )));
            }
            Self::All => all_partitions(agents),
            Self::Sampled { count } => sample_partitions(agents, count, seed)?,
            Self::RoundRobin => Vec::new(),
        };
        Ok(Partitions {
            pairs: Pairs::new(agents),
            fixed,
        })
    }
}

/// The partitions of one run: made once, asked at every step.
#[derive(Debug, Clone, PartialEq)]
pub struct Partitions {
    pairs: Pairs,
    /// The set in force at every step; empty if the set changes from step to step.
    fixed: Vec<Partition>,
}

/// Room for a set of partitions that changes from step to step; reused, it makes [`Partitions::in_force`] free of
/// allocation.
#[derive(Debug, Clone, Default)]
pub struct PartitionBuffer {
    relabelled_for: Option<EpisodeKey>,
    relabelled: Vec<AgentId>,
    order: Vec<AgentId>,
    round: Partition,
}

impl Partitions {
    /// The pairs of the team.
    #[must_use]
    pub const fn pairs(&self) -> &Pairs {
        &self.pairs
    }

    /// P: how many partitions are in force at every step.
    #[must_use]
    pub fn count(&self) -> usize {
        self.fixed.len().max(1)
    }

    /// The partitions in force at every step; none if they change from step to step.
    #[must_use]
    pub fn fixed(&self) -> &[Partition] {
        &self.fixed
    }

    /// Whether the same partitions are in force at every step, so that every possible pair can be formed at every step.
    #[must_use]
    pub const fn are_fixed(&self) -> bool {
        !self.fixed.is_empty()
    }

    /// The pairs that may be formed at some step, ascending by index.
    #[must_use]
    pub fn possible_pairs(&self) -> Vec<Pair> {
        if self.fixed.is_empty() {
            return self.pairs.iter().collect();
        }
        let formed: BTreeSet<Pair> = self
            .fixed
            .iter()
            .flat_map(|partition| partition.pairs().iter().copied())
            .collect();
        formed.into_iter().collect()
    }

    /// The P partitions in force at `step` of the episode named `key`: a pure function of the two and of the plan.
    #[must_use]
    pub fn in_force<'a>(
        &'a self,
        key: &EpisodeKey,
        step: usize,
        buffer: &'a mut PartitionBuffer,
    ) -> &'a [Partition] {
        if !self.fixed.is_empty() {
            return &self.fixed;
        }
        buffer.relabel(self.pairs.agents(), key);
        round_robin::write_round(&buffer.relabelled, step, &mut buffer.order);
        buffer.round.assign(&buffer.order);
        std::slice::from_ref(&buffer.round)
    }
}

impl PartitionBuffer {
    /// Draws who plays as which player in the tournament of the episode named `key`.
    fn relabel(&mut self, agents: usize, key: &EpisodeKey) {
        if self.relabelled_for == Some(*key) && self.relabelled.len() == agents {
            return;
        }
        self.relabelled.clear();
        self.relabelled.extend((0..agents).map(AgentId::new));
        shuffle(&mut self.relabelled, key, 0);
        self.relabelled_for = Some(*key);
    }
}

#[cfg(test)]
mod tests {
    use mackrl_env::Stream;

    use super::*;

    #[test]
    fn enumerating_a_large_team_is_refused_with_advice() {
        let error = PartitionSchedule::All
            .plan(10, 1)
            .expect_err("ten agents are too many");
        assert!(matches!(error, Error::Config(_)), "{error:?}");
        let message = error.to_string();
        assert!(
            message.contains("at most 8 agents, found 10 with 945 partitions"),
            "{message}"
        );
        assert!(PartitionSchedule::All.plan(8, 1).is_ok(), "eight are not");
        assert!(
            PartitionSchedule::All.plan(0, 1).is_err(),
            "none is no team"
        );
    }

    #[test]
    fn a_round_robin_depends_on_episode_and_step_but_not_on_the_buffer_s_past() {
        let plan = PartitionSchedule::RoundRobin
            .plan(7, 1)
            .expect("any team can play");
        assert_eq!(plan.count(), 1);
        let keys = [3, 4].map(|episode| EpisodeKey::new(5, Stream::Training, episode));
        let mut used = PartitionBuffer::default();
        let mut first = Vec::new();
        for step in 0..7 {
            for key in &keys {
                let expected = plan
                    .in_force(key, step, &mut PartitionBuffer::default())
                    .to_vec();
                assert_eq!(plan.in_force(key, step, &mut used), expected);
                assert_eq!(plan.in_force(key, step + 7, &mut used), expected);
                first.extend(expected);
            }
        }
        assert!(
            first.chunks(2).any(|both| both[0] != both[1]),
            "two episodes share their relabelling"
        );
    }

    #[test]
    fn a_schedule_is_written_in_kebab_case() {
        let text = serde_json::to_string(&[
            PartitionSchedule::All,
            PartitionSchedule::Sampled { count: 5 },
            PartitionSchedule::RoundRobin,
        ])
        .expect("plain data");
        assert_eq!(text, r#"["all",{"sampled":{"count":5}},"round-robin"]"#);
    }
}
