//! One step of the hierarchy as log-probabilities: the one table that both the sampler and the marginal likelihood read.
//!
//! Had each of them its own way from network outputs to probabilities, the two could drift apart, and learning would
//! follow the gradient of a policy that nobody executes. The table is complete: masked (−∞) and with exploration mixed in.

use mackrl_env::Action;

use crate::{
    Error, Real,
    partition::{Pairs, Partition},
};

/// Column of a pair's table that stands for *delegate*; the joint actions follow.
pub const DELEGATE: usize = 0;

/// Numbers of agents and actions, which all sizes of a table follow from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PolicyShape {
    /// N: agents.
    pub agents: usize,
    /// A: actions of an agent.
    pub actions: usize,
}

impl PolicyShape {
    /// K: pairs of agents.
    #[must_use]
    pub const fn pairs(self) -> usize {
        Pairs::count_for(self.agents)
    }

    /// C = 1 + A·A: columns of a pair's table.
    #[must_use]
    pub const fn columns(self) -> usize {
        1 + self.actions * self.actions
    }

    /// The column of the joint action (`first`, `second`): `1 + u_a·A + u_b`.
    #[must_use]
    pub const fn column(self, first: Action, second: Action) -> usize {
        1 + first.index() * self.actions + second.index()
    }

    /// The joint action that stands in `column`; `None` for [`DELEGATE`].
    #[must_use]
    pub fn joint_action(self, column: usize) -> Option<[Action; 2]> {
        let joint = column.checked_sub(1)?;
        Some([joint / self.actions, joint % self.actions].map(Action::new))
    }
}

/// The policy of one environment at one step, borrowed from where it was computed.
///
/// Rows of pairs that no partition in force contains are never read and may hold anything.
#[derive(Debug, Clone, Copy)]
pub struct PolicyTable<'a, F> {
    shape: PolicyShape,
    partitions: &'a [Partition],
    log_p_selector_p: &'a [F],
    log_p_pair_kc: &'a [F],
    log_p_agent_na: &'a [F],
}

impl<'a, F: Real> PolicyTable<'a, F> {
    /// Puts a table together from the log-probabilities of the three levels.
    ///
    /// # Shapes
    /// `partitions` and `log_p_selector_p` \[P\], `log_p_pair_kc` \[K, 1 + A·A\], `log_p_agent_na` \[N, A\].
    ///
    /// # Errors
    /// [`Error::Data`] names the part whose size is wrong.
    pub fn new(
        shape: PolicyShape,
        partitions: &'a [Partition],
        log_p_selector_p: &'a [F],
        log_p_pair_kc: &'a [F],
        log_p_agent_na: &'a [F],
    ) -> Result<Self, Error> {
        let expected = [
            ("selector", log_p_selector_p.len(), partitions.len()),
            ("pair", log_p_pair_kc.len(), shape.pairs() * shape.columns()),
            ("agent", log_p_agent_na.len(), shape.agents * shape.actions),
        ];
        for (level, found, expected) in expected {
            if found != expected {
                return Err(Error::Data(format!(
                    "{level} table has {found} entries, expected {expected} for {} agents with {} actions",
                    shape.agents, shape.actions
                )));
            }
        }
        if partitions.is_empty() {
            return Err(Error::Data(
                "no partition is in force, expected at least 1".into(),
            ));
        }
        if let Some(other) = partitions.iter().find(|p| p.agents() != shape.agents) {
            return Err(Error::Data(format!(
                "a partition divides {} agents, expected {}",
                other.agents(),
                shape.agents
            )));
        }
        Ok(Self {
            shape,
            partitions,
            log_p_selector_p,
            log_p_pair_kc,
            log_p_agent_na,
        })
    }

    /// Numbers of agents and actions.
    #[must_use]
    pub const fn shape(&self) -> PolicyShape {
        self.shape
    }

    /// The partitions in force \[P\].
    #[must_use]
    pub const fn partitions(&self) -> &'a [Partition] {
        self.partitions
    }

    /// `log π_ps` \[P\].
    #[must_use]
    pub const fn selector(&self) -> &'a [F] {
        self.log_p_selector_p
    }

    /// `log π_pc` of the pair numbered `pair` \[1 + A·A\].
    #[must_use]
    pub fn pair(&self, pair: usize) -> &'a [F] {
        let columns = self.shape.columns();
        &self.log_p_pair_kc[pair * columns..(pair + 1) * columns]
    }

    /// `log π_a` of the agent numbered `agent` \[A\].
    #[must_use]
    pub fn agent(&self, agent: usize) -> &'a [F] {
        let actions = self.shape.actions;
        &self.log_p_agent_na[agent * actions..(agent + 1) * actions]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::all_partitions;

    #[test]
    fn columns_and_joint_actions_name_each_other() {
        let shape = PolicyShape {
            agents: 2,
            actions: 5,
        };
        assert_eq!(shape.joint_action(DELEGATE), None);
        for column in 1..shape.columns() {
            let [first, second] = shape.joint_action(column).expect("a joint action");
            assert_eq!(shape.column(first, second), column);
        }
        assert_eq!(shape.column(Action::new(1), Action::new(3)), 9);
    }

    #[test]
    fn a_table_of_the_wrong_size_is_refused() {
        let shape = PolicyShape {
            agents: 3,
            actions: 2,
        };
        let partitions = all_partitions(3);
        let (selector, pair, agent) = (vec![0.0; 3], vec![0.0; 15], vec![0.0; 6]);
        let check = |partitions: &[Partition], selector: &[f64], pair: &[f64], agent: &[f64]| {
            PolicyTable::new(shape, partitions, selector, pair, agent)
                .map(|_| ())
                .map_err(|error| error.to_string())
        };
        assert_eq!(check(&partitions, &selector, &pair, &agent), Ok(()));
        let short = check(&partitions, &selector, &pair[1..], &agent).expect_err("too short");
        assert!(
            short.starts_with("pair table has 14 entries, expected 15"),
            "{short}"
        );
        assert!(
            check(&partitions, &selector[1..], &pair, &agent).is_err(),
            "selector"
        );
        assert!(
            check(&partitions, &selector, &pair, &agent[1..]).is_err(),
            "agent"
        );
        assert!(check(&[], &[], &pair, &agent).is_err(), "no partition");
        let others = all_partitions(4);
        assert!(
            check(&others, &selector, &pair, &agent).is_err(),
            "another team"
        );
    }
}
