//! Random tables of one step, with masks, for the tests of sampling and marginalisation.
#![allow(
    dead_code,
    reason = "every test file includes this module and uses a part of it"
)]

pub(crate) mod learner;
pub(crate) mod team;

use mackrl::{
    marginalisation::{MarginalGradient, log_likelihood, log_likelihood_with_gradient},
    partition::{Pair, Partition, PartitionSchedule, all_partitions},
    policy::{Declaration, Delegation, Division, Part, PolicyTable, Selection},
};
use mackrl_env::{Action, AgentId, Draw, EpisodeKey, Stream};

pub(crate) use mackrl::{marginalisation::pairwise::DELEGATE, policy::TEAM};

/// The levels of the pairwise hierarchy below the team.
pub(crate) const PAIRS: usize = 1;
pub(crate) const AGENTS: usize = 2;

pub(crate) const MASKED: f64 = f64::NEG_INFINITY;

/// An owned table in `f64`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tables {
    pub(crate) declaration: Declaration,
    /// The partitions in force, of the pairwise hierarchy.
    pub(crate) partitions: Vec<Partition>,
    /// The divisions of the team in force.
    pub(crate) in_force: Vec<Division>,
    /// The rows of each level, \[G, C\].
    pub(crate) levels: Vec<Vec<f64>>,
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
        let all = declaration(agents, actions, PartitionSchedule::All);
        let tables = Self::random_of(seed, all, all_partitions(agents));
        assert_eq!(
            tables.in_force,
            tables.declaration.levels()[TEAM].divisions_gd[0],
            "divisions in force"
        );
        tables
    }

    /// The same for some partitions, with a selector that chooses among them.
    pub(crate) fn random_with(seed: u64, actions: usize, partitions: Vec<Partition>) -> Self {
        let agents = partitions[0].agents();
        let any = declaration(agents, actions, PartitionSchedule::RoundRobin);
        Self::random_of(seed, any, partitions)
    }

    fn random_of(seed: u64, declaration: Declaration, partitions: Vec<Partition>) -> Self {
        let mut numbers = Numbers::new(seed);
        let [agents, pairs] = small_groups(&mut numbers, &declaration, PAIRS);
        let selector = random_row(&mut numbers, &vec![true; partitions.len()]);
        Self {
            in_force: partitions.iter().map(Division::from).collect(),
            declaration,
            partitions,
            levels: vec![selector, pairs, agents],
        }
    }

    /// Random policies for team → fours → pairs → agents. Some divisions are impossible.
    pub(crate) fn random_fours(seed: u64, agents: usize, actions: usize) -> Self {
        let declaration =
            Declaration::fours([agents, actions], Selection::Learned, Delegation::Learned);
        let declaration = declaration.expect("a small team");
        let mut numbers = Numbers::new(seed);
        let [alone, pairs] = small_groups(&mut numbers, &declaration, PAIRS + 1);
        let mut divided = |level: usize| -> Vec<f64> {
            let level = &declaration.levels()[level];
            let rows = level.groups.iter().flat_map(|_| {
                let available = numbers.available(level.divisions);
                random_row(&mut numbers, &available)
            });
            rows.collect()
        };
        let levels = vec![divided(TEAM), divided(1), pairs, alone];
        Self {
            in_force: declaration.levels()[TEAM].divisions_gd[0].clone(),
            declaration,
            partitions: Vec::new(),
            levels,
        }
    }

    pub(crate) fn agents(&self) -> usize {
        self.declaration.agents()
    }

    pub(crate) fn actions(&self) -> usize {
        self.declaration.actions()
    }

    pub(crate) fn table(&self) -> PolicyTable<'_, f64> {
        let levels: Vec<&[f64]> = self.levels.iter().map(Vec::as_slice).collect();
        PolicyTable::new(&self.declaration, &self.in_force, &levels)
            .expect("the tables fit their declaration")
    }

    pub(crate) fn log_likelihood(&self, actions_n: &[Action]) -> f64 {
        log_likelihood(&self.table(), actions_n)
    }

    pub(crate) fn gradient(&self, actions_n: &[Action]) -> MarginalGradient<f64> {
        let mut gradient = MarginalGradient::default();
        log_likelihood_with_gradient(&self.table(), actions_n, &mut gradient);
        gradient
    }

    /// The column of a pair's joint action.
    pub(crate) fn column(&self, pair: Pair, actions_n: &[Action]) -> usize {
        let level = &self.declaration.levels()[PAIRS];
        let column = level.column(pair.index(), self.actions(), actions_n);
        column.expect("pairs act jointly")
    }

    pub(crate) fn pair_row(&self, pair: Pair) -> &[f64] {
        self.table().row(Part {
            level: PAIRS,
            group: pair.index(),
        })
    }

    pub(crate) fn agent_row(&self, agent: AgentId) -> &[f64] {
        self.table().row(Part {
            level: self.declaration.alone(),
            group: agent.index(),
        })
    }

    /// Length of a row of this level.
    pub(crate) fn columns(&self, level: usize) -> usize {
        match level {
            TEAM => self.in_force.len(),
            _ => self.declaration.levels()[level].columns(self.actions()),
        }
    }

    /// Makes every pair delegate.
    pub(crate) fn always_delegating(mut self) -> Self {
        let columns = self.columns(PAIRS);
        for row in self.levels[PAIRS].chunks_mut(columns) {
            row.fill(MASKED);
            row[DELEGATE] = 0.0;
        }
        self
    }

    /// Makes no pair delegate: all joint actions of two available actions get a probability.
    pub(crate) fn never_delegating(mut self, seed: u64) -> Self {
        let mut numbers = Numbers::new(seed);
        let columns = self.columns(PAIRS);
        for row in self.levels[PAIRS].chunks_mut(columns) {
            let mut available = vec![true; row.len()];
            available[DELEGATE] = false;
            row.copy_from_slice(&random_row(&mut numbers, &available));
        }
        self
    }

    /// All A^N joint actions.
    pub(crate) fn joint_actions(&self) -> Vec<Vec<Action>> {
        let [agents, actions] = [self.agents(), self.actions()];
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

    /// The gradient of log p(u) with respect to every entry: all levels in one vector, as [`Self::entries_mut`] counts them.
    pub(crate) fn dense_gradient(&self, actions_n: &[Action]) -> Vec<f64> {
        self.dense(&self.gradient(actions_n), actions_n)
    }

    /// The same of a gradient that was computed elsewhere.
    pub(crate) fn dense(&self, gradient: &MarginalGradient<f64>, actions_n: &[Action]) -> Vec<f64> {
        let mut dense = Vec::new();
        for (place, level) in self.declaration.levels().iter().enumerate() {
            for group in 0..level.groups.len() {
                let part = Part {
                    level: place,
                    group,
                };
                let mut row = vec![0.0; self.columns(place)];
                let divided = gradient.divisions(part);
                row[..divided.len()].copy_from_slice(divided);
                if let Some(column) = level.column(group, self.actions(), actions_n) {
                    row[column] = gradient.joint(part);
                }
                dense.extend(row);
            }
        }
        dense
    }

    /// Every entry of all levels.
    pub(crate) fn entries_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        self.levels.iter_mut().flatten()
    }
}

fn declaration(agents: usize, actions: usize, schedule: PartitionSchedule) -> Declaration {
    let (selection, delegation) = (Selection::Learned, Delegation::Learned);
    Declaration::pairwise([agents, actions], schedule, selection, delegation, 1)
        .expect("a team that is small enough")
}

/// The rows of single agents and of pairs; a joint action is possible only if both of its actions are.
fn small_groups(numbers: &mut Numbers, declaration: &Declaration, pairs: usize) -> [Vec<f64>; 2] {
    let [agents, actions] = [declaration.agents(), declaration.actions()];
    let available_na: Vec<bool> = (0..agents)
        .flat_map(|_| numbers.available(actions))
        .collect();
    let alone = available_na
        .chunks(actions)
        .flat_map(|available_a| random_row(numbers, available_a))
        .collect();
    let columns = declaration.levels()[pairs].columns(actions);
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
            let mask_c: Vec<bool> = (0..columns).map(joint).collect();
            log_p_pair_kc.extend(random_row(numbers, &mask_c));
        }
    }
    [alone, log_p_pair_kc]
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
