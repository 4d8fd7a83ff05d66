//! Partitions of a team into pairs with at most one singleton.
//!
//! The pair selector chooses one [`Partition`] a step. Which partitions it may choose from is a
//! [`PartitionSchedule`]: up to [`PartitionSchedule::MOST_AGENTS_ENUMERATED`] agents all of them, as in the paper. Ten
//! agents have 945 and 27 have 2·10¹⁴, so larger teams use a seeded sample or a tournament's rounds, neither of which
//! enumerates anything. Either way the set in force is known to every agent before the selector chooses, so the
//! probability of a joint action stays exact for the policy that is executed.

mod enumeration;
mod pairs;
mod round_robin;
mod sample;
mod schedule;

pub use enumeration::{all_partitions, partition_count, ways_to_divide};
pub use pairs::{Pair, Pairs};
pub use sample::sample_partitions;
pub use schedule::{PartitionBuffer, PartitionSchedule, Partitions};

use mackrl_env::{AgentId, EntitySet};

/// A division of N agents into disjoint pairs, plus one singleton if N is odd.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Partition {
    pairs: Vec<Pair>,
    singleton: Option<AgentId>,
}

impl Partition {
    /// Pairs the first agent of `order` with the second, the third with the fourth and so on; the last of an odd number
    /// stays alone. Every partition arises from some order, and every order gives a partition.
    ///
    /// # Panics
    /// If `order` does not name each of the agents 0..N once.
    #[must_use]
    pub fn from_order(order: &[AgentId]) -> Self {
        let mut partition = Self::default();
        partition.assign(order);
        partition
    }

    /// Becomes [`Self::from_order`] of `order` without allocating, if it held as many agents before.
    ///
    /// # Panics
    /// As [`Self::from_order`].
    pub fn assign(&mut self, order: &[AgentId]) {
        let agents = order.len();
        let named: EntitySet = order.iter().copied().collect();
        assert!(
            named == EntitySet::first(agents),
            "an order of {agents} agents names each of them once"
        );
        let couples = order.chunks_exact(2);
        self.singleton = couples.remainder().first().copied();
        self.pairs.clear();
        self.pairs
            .extend(couples.map(|couple| Pair::among(agents, couple[0], couple[1])));
        self.pairs.sort_unstable();
    }

    /// The pairs, ascending by index.
    #[must_use]
    pub fn pairs(&self) -> &[Pair] {
        &self.pairs
    }

    /// The agent that is in no pair; there is one exactly if N is odd.
    #[must_use]
    pub const fn singleton(&self) -> Option<AgentId> {
        self.singleton
    }

    /// N: number of agents.
    #[must_use]
    pub fn agents(&self) -> usize {
        2 * self.pairs.len() + usize::from(self.singleton.is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_is_paired_from_left_to_right() {
        let order = [4, 1, 0, 3, 2].map(AgentId::new);
        let partition = Partition::from_order(&order);
        let members: Vec<_> = partition.pairs().iter().map(|pair| pair.agents()).collect();
        assert_eq!(members, [[0, 3], [1, 4]].map(|pair| pair.map(AgentId::new)));
        assert_eq!(partition.singleton(), Some(AgentId::new(2)));
        assert_eq!(partition.agents(), 5);
    }

    #[test]
    #[should_panic(expected = "names each of them once")]
    fn an_order_that_repeats_an_agent_is_refused() {
        let _ = Partition::from_order(&[0, 1, 1].map(AgentId::new));
    }
}
