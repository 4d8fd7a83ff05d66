//! From the tables of one step to what a person wants to see of them.

use mackrl_env::{Action, AgentId, EntitySet};

use super::Path;
use crate::{
    marginalisation::MarginalGradient,
    partition::{Pair, Partition},
    policy::{
        AgentThought, Choice, DELEGATE, JointOption, PairThought, PartitionThought, PolicyTable,
        Thought, most_probable,
    },
};

/// One step of one environment, decided.
#[derive(Debug)]
pub(super) struct Subject<'a> {
    pub(super) table: PolicyTable<'a, f32>,
    pub(super) path: &'a Path,
    /// Common knowledge of every pair \[K\].
    pub(super) known_k: &'a [EntitySet],
    pub(super) alive_n: &'a [bool],
    pub(super) action_n: &'a [Action],
}

/// Describes a decided step; `marginal` is log p(u) with its gradient, whose entries are posteriors.
pub(super) fn describe(
    subject: &Subject<'_>,
    pairs: &[Pair],
    (log_p, posterior): (f32, &MarginalGradient<f32>),
) -> Thought {
    let table = &subject.table;
    let partitions = table.partitions().iter().zip(table.selector());
    let living = pairs.iter().filter(|pair| subject.lives(**pair));
    let agents = (0..subject.alive_n.len()).filter(|&agent| subject.alive_n[agent]);
    Thought {
        partitions: partitions
            .zip(&posterior.selector_p)
            .map(|((partition, log_p), posterior)| PartitionThought {
                groups: groups(partition),
                probability: log_p.exp(),
                posterior: *posterior,
            })
            .collect(),
        chosen: Some(subject.path.partition),
        pairs: living.map(|pair| subject.pair(*pair, posterior)).collect(),
        agents: agents
            .map(|n| AgentThought::new(AgentId::new(n), table.agent(n), subject.action_n[n]))
            .collect(),
        log_p_path: subject.log_p_path(),
        log_p: f64::from(log_p),
    }
}

impl Subject<'_> {
    fn lives(&self, pair: Pair) -> bool {
        let mut members = pair.agents().into_iter();
        members.all(|agent| self.alive_n[agent.index()])
    }

    fn chosen(&self) -> &Partition {
        &self.table.partitions()[self.path.partition]
    }

    /// What `pair` chose, if the chosen partition contains it.
    fn choice(&self, pair: Pair) -> Option<Choice> {
        let place = self.chosen().pairs().iter().position(|own| *own == pair)?;
        Some(if self.path.delegated[place] {
            Choice::Delegate
        } else {
            Choice::Joint
        })
    }

    fn column(&self, pair: Pair) -> usize {
        let [first, second] = pair.agents().map(|agent| self.action_n[agent.index()]);
        self.table.shape().column(first, second)
    }

    fn pair(&self, pair: Pair, posterior: &MarginalGradient<f32>) -> PairThought {
        let log_p_c = self.table.pair(pair.index());
        let shape = self.table.shape();
        let joint = most_probable(&log_p_c[DELEGATE + 1..], self.column(pair) - 1);
        PairThought {
            members: pair.agents(),
            known: self.known_k[pair.index()].iter().collect(),
            delegate: log_p_c[DELEGATE].exp(),
            joint: joint
                .into_iter()
                .filter_map(|(index, probability)| {
                    let actions = shape.joint_action(index + 1)?;
                    Some(JointOption {
                        actions,
                        probability,
                    })
                })
                .collect(),
            choice: self.choice(pair),
            posterior_joint: posterior.joint_k[pair.index()],
            posterior_delegate: posterior.delegate_k[pair.index()],
        }
    }

    /// The sum of the logarithms of all choices on the way.
    fn log_p_path(&self) -> f64 {
        let alone = |agent: AgentId| {
            let action = self.action_n[agent.index()];
            f64::from(self.table.agent(agent.index())[action.index()])
        };
        let pairs = self.chosen().pairs().iter().map(|pair| {
            let log_p_c = self.table.pair(pair.index());
            match self.choice(*pair) {
                Some(Choice::Delegate) => {
                    f64::from(log_p_c[DELEGATE]) + pair.agents().map(alone).iter().sum::<f64>()
                }
                _ => f64::from(log_p_c[self.column(*pair)]),
            }
        });
        f64::from(self.table.selector()[self.path.partition])
            + pairs.sum::<f64>()
            + self.chosen().singleton().map_or(0.0, alone)
    }
}

fn groups(partition: &Partition) -> Vec<Vec<AgentId>> {
    let pairs = partition.pairs().iter().map(|pair| pair.agents().to_vec());
    pairs
        .chain(partition.singleton().map(|agent| vec![agent]))
        .collect()
}
