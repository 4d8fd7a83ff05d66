//! Random tables of one step, with masks, for the tests of sampling and marginalisation.
#![allow(
    dead_code,
    reason = "every test file includes this module and uses a part of it"
)]

pub(crate) mod team;

use mackrl::{
    marginalisation::{MarginalGradient, log_likelihood, log_likelihood_with_gradient},
    partition::{Pair, Partition, all_partitions},
    policy::{DELEGATE, PolicyShape, PolicyTable},
};
use mackrl_env::{Action, AgentId, Draw, EpisodeKey, Stream};

pub(crate) const MASKED: f64 = f64::NEG_INFINITY;

/// An owned table in `f64`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tables {
    pub(crate) shape: PolicyShape,
    pub(crate) partitions: Vec<Partition>,
    pub(crate) log_p_selector_p: Vec<f64>,
    pub(crate) log_p_pair_kc: Vec<f64>,
    pub(crate) log_p_agent_na: Vec<f64>,
}

/// Numbers that depend on a seed alone.
pub(crate) struct Numbers {
    key: EpisodeKey,
    next: usize,
}

impl Numbers {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            key: EpisodeKey::new(seed, Stream::Other, 1),
            next: 0,
        }
    }

    pub(crate) fn uniform(&mut self) -> f64 {
        self.next += 1;
        self.key.uniform(self.next, Draw::World(0))
    }

    pub(crate) fn logit(&mut self) -> f64 {
        self.next += 1;
        1.5 * self.key.normal(self.next, Draw::World(0))
    }

    /// Each of `count` with probability 0.7, but at least one.
    pub(crate) fn available(&mut self, count: usize) -> Vec<bool> {
        let place = self.uniform() * count as f64;
        let certain = (0..count).rfind(|&i| i as f64 <= place);
        (0..count)
            .map(|i| self.uniform() < 0.7 || certain == Some(i))
            .collect()
    }
}

impl Tables {
    /// Random policies for all partitions. Some actions are not available; of some pairs it is commonly known that fewer
    /// are, of others that none is.
    pub(crate) fn random(seed: u64, agents: usize, actions: usize) -> Self {
        Self::random_with(seed, actions, all_partitions(agents))
    }

    pub(crate) fn random_with(seed: u64, actions: usize, partitions: Vec<Partition>) -> Self {
        let agents = partitions[0].agents();
        let shape = PolicyShape { agents, actions };
        let mut numbers = Numbers::new(seed);
        let available_na: Vec<bool> = (0..agents)
            .flat_map(|_| numbers.available(actions))
            .collect();
        let log_p_agent_na = available_na
            .chunks(actions)
            .flat_map(|available_a| random_row(&mut numbers, available_a))
            .collect();
        let mut log_p_pair_kc = Vec::new();
        for a in 0..agents {
            for b in a + 1..agents {
                let blind = numbers.uniform() < 0.2;
                let mut known = |agent: usize, u: usize| {
                    available_na[agent * actions + u] && !blind && numbers.uniform() < 0.9
                };
                let known_a: Vec<bool> = (0..actions).map(|u| known(a, u)).collect();
                let known_b: Vec<bool> = (0..actions).map(|u| known(b, u)).collect();
                let joint = |column: usize| {
                    column == DELEGATE
                        || known_a[(column - 1) / actions] && known_b[(column - 1) % actions]
                };
                let mask_c: Vec<bool> = (0..shape.columns()).map(joint).collect();
                log_p_pair_kc.extend(random_row(&mut numbers, &mask_c));
            }
        }
        let log_p_selector_p = random_row(&mut numbers, &vec![true; partitions.len()]);
        Self {
            shape,
            partitions,
            log_p_selector_p,
            log_p_pair_kc,
            log_p_agent_na,
        }
    }

    pub(crate) fn table(&self) -> PolicyTable<'_, f64> {
        PolicyTable::new(
            self.shape,
            &self.partitions,
            &self.log_p_selector_p,
            &self.log_p_pair_kc,
            &self.log_p_agent_na,
        )
        .expect("the tables fit their shape")
    }

    pub(crate) fn log_likelihood(&self, actions_n: &[Action]) -> f64 {
        log_likelihood(&self.table(), actions_n)
    }

    pub(crate) fn gradient(&self, actions_n: &[Action]) -> MarginalGradient<f64> {
        let mut gradient = MarginalGradient::new(self.shape, self.partitions.len());
        log_likelihood_with_gradient(&self.table(), actions_n, &mut gradient);
        gradient
    }

    pub(crate) fn pair_row(&self, pair: Pair) -> &[f64] {
        self.table().pair(pair.index())
    }

    pub(crate) fn agent_row(&self, agent: AgentId) -> &[f64] {
        self.table().agent(agent.index())
    }

    /// Makes every pair delegate.
    pub(crate) fn always_delegating(mut self) -> Self {
        for row in self.log_p_pair_kc.chunks_mut(self.shape.columns()) {
            row.fill(MASKED);
            row[DELEGATE] = 0.0;
        }
        self
    }

    /// Makes no pair delegate: all joint actions of two available actions get a probability.
    pub(crate) fn never_delegating(mut self, seed: u64) -> Self {
        let mut numbers = Numbers::new(seed);
        for row in self.log_p_pair_kc.chunks_mut(self.shape.columns()) {
            let mut available = vec![true; row.len()];
            available[DELEGATE] = false;
            row.copy_from_slice(&random_row(&mut numbers, &available));
        }
        self
    }

    /// All A^N joint actions.
    pub(crate) fn joint_actions(&self) -> Vec<Vec<Action>> {
        let PolicyShape { agents, actions } = self.shape;
        let count = (0..agents).fold(1, |count, _| count * actions);
        (0..count)
            .map(|number| {
                let mut rest = number;
                (0..agents)
                    .map(|_| {
                        let action = Action::new(rest % actions);
                        rest /= actions;
                        action
                    })
                    .collect()
            })
            .collect()
    }

    /// The gradient of log p(u) with respect to every entry: selector, pairs and agents in one vector, as
    /// [`Self::entries_mut`] counts them.
    pub(crate) fn dense_gradient(&self, actions_n: &[Action]) -> Vec<f64> {
        let gradient = self.gradient(actions_n);
        let mut pair_kc = vec![0.0; self.log_p_pair_kc.len()];
        let mut agent_na = vec![0.0; self.log_p_agent_na.len()];
        let columns = self.shape.columns();
        for pair in mackrl::partition::Pairs::new(self.shape.agents).iter() {
            let k = pair.index();
            let [a, b] = pair.agents().map(|agent| actions_n[agent.index()]);
            pair_kc[k * columns + DELEGATE] = gradient.delegate_k[k];
            pair_kc[k * columns + self.shape.column(a, b)] = gradient.joint_k[k];
        }
        for (n, action) in actions_n.iter().enumerate() {
            agent_na[n * self.shape.actions + action.index()] = gradient.agent_n[n];
        }
        [gradient.selector_p, pair_kc, agent_na].concat()
    }

    /// Every entry of the three levels.
    pub(crate) fn entries_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        self.log_p_selector_p
            .iter_mut()
            .chain(&mut self.log_p_pair_kc)
            .chain(&mut self.log_p_agent_na)
    }
}

/// A log-softmax of random logits over what is available.
fn random_row(numbers: &mut Numbers, available: &[bool]) -> Vec<f64> {
    let logits: Vec<f64> = available
        .iter()
        .map(|&available| if available { numbers.logit() } else { MASKED })
        .collect();
    log_softmax(&logits)
}

pub(crate) fn log_softmax(logits: &[f64]) -> Vec<f64> {
    let largest = logits.iter().copied().fold(MASKED, f64::max);
    let total: f64 = logits.iter().map(|x| (x - largest).exp()).sum();
    logits.iter().map(|x| x - largest - total.ln()).collect()
}

pub(crate) fn ids(agents: &[usize]) -> Vec<AgentId> {
    agents.iter().copied().map(AgentId::new).collect()
}

pub(crate) fn actions(indices: &[usize]) -> Vec<Action> {
    indices.iter().copied().map(Action::new).collect()
}

/// Asserts that two numbers differ by at most `tolerance`, relative to 1 or to their size.
#[track_caller]
pub(crate) fn assert_close(found: f64, expected: f64, tolerance: f64) {
    let scale = expected.abs().max(1.0);
    assert!(
        (found - expected).abs() <= tolerance * scale,
        "found {found}, expected {expected}"
    );
}
