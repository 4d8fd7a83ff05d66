//! The pairs of a team and their numbering.
//!
//! Pairs (a, b) with a < b are numbered lexicographically: (0,1), (0,2), …, (0,N−1), (1,2), … The number is the pair's row
//! in every table with the axis K and the name of its random draw.

use mackrl_env::AgentId;

/// Two agents, the lower one first, with their place on the axis K.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pair {
    index: usize,
    agents: [AgentId; 2],
}

impl Pair {
    /// The pair of agents `a` and `b`, in either order, in a team of `agents`.
    ///
    /// # Panics
    /// If `a` and `b` are the same or not in the team.
    #[must_use]
    pub fn among(agents: usize, a: AgentId, b: AgentId) -> Self {
        let (first, second) = (a.min(b), a.max(b));
        let (low, high) = (first.index(), second.index());
        assert!(
            low < high && high < agents,
            "agents {a} and {b} are no pair in a team of {agents}"
        );
        Self {
            index: low * (2 * agents - low - 1) / 2 + high - low - 1,
            agents: [first, second],
        }
    }

    /// Place on the axis K.
    #[must_use]
    pub const fn index(self) -> usize {
        self.index
    }

    /// The members, lower one first.
    #[must_use]
    pub const fn agents(self) -> [AgentId; 2] {
        self.agents
    }

    /// The other member of the pair, if `agent` is one.
    #[must_use]
    pub fn partner_of(self, agent: AgentId) -> Option<AgentId> {
        match self.agents {
            [first, second] if agent == first => Some(second),
            [first, second] if agent == second => Some(first),
            _ => None,
        }
    }
}

/// All N(N−1)/2 pairs of a team, in the order of their indices.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pairs {
    agents: usize,
    pairs: Vec<Pair>,
}

impl Pairs {
    /// The pairs of a team of `agents`.
    #[must_use]
    pub fn new(agents: usize) -> Self {
        let pairs = (0..agents)
            .flat_map(|a| (a + 1..agents).map(move |b| (AgentId::new(a), AgentId::new(b))))
            .map(|(a, b)| Pair::among(agents, a, b))
            .collect();
        Self { agents, pairs }
    }

    /// K: number of pairs in a team of `agents`.
    #[must_use]
    pub const fn count_for(agents: usize) -> usize {
        agents * agents.saturating_sub(1) / 2
    }

    /// N: number of agents.
    #[must_use]
    pub const fn agents(&self) -> usize {
        self.agents
    }

    /// K: number of pairs.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.pairs.len()
    }

    /// The pair numbered `index`.
    ///
    /// # Panics
    /// If `index` is not below [`Self::count`].
    #[must_use]
    pub fn get(&self, index: usize) -> Pair {
        self.pairs[index]
    }

    /// The number of the pair of `a` and `b`, in either order.
    ///
    /// # Panics
    /// If `a` and `b` are the same or not in the team.
    #[must_use]
    pub fn index_of(&self, a: AgentId, b: AgentId) -> usize {
        Pair::among(self.agents, a, b).index
    }

    /// All pairs, ascending by index.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Pair> + '_ {
        self.pairs.iter().copied()
    }

    /// The N − 1 pairs that `agent` belongs to, ascending by index.
    pub fn with_member(&self, agent: AgentId) -> impl Iterator<Item = Pair> + '_ {
        self.iter()
            .filter(move |pair| pair.partner_of(agent).is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_count_the_pairs_in_lexicographic_order() {
        for agents in 0..=11 {
            let pairs = Pairs::new(agents);
            assert_eq!(pairs.count(), Pairs::count_for(agents));
            let mut expected = 0;
            for a in 0..agents {
                for b in a + 1..agents {
                    let (a, b) = (AgentId::new(a), AgentId::new(b));
                    assert_eq!(pairs.index_of(a, b), expected);
                    assert_eq!(pairs.index_of(b, a), expected);
                    assert_eq!(pairs.get(expected).index(), expected);
                    assert_eq!(pairs.get(expected).agents(), [a, b]);
                    expected += 1;
                }
            }
        }
    }

    #[test]
    fn an_agent_belongs_to_one_pair_with_each_other() {
        let pairs = Pairs::new(7);
        let three = AgentId::new(3);
        let partners: Vec<_> = pairs
            .with_member(three)
            .filter_map(|pair| pair.partner_of(three))
            .collect();
        assert_eq!(partners, [0, 1, 2, 4, 5, 6].map(AgentId::new));
    }
}
