//! The numbered equations of the paper, Lemma 1, Algorithm 1 and Table 1, each against its literal formula in `f64`.

mod support;

use std::collections::BTreeSet;

use mackrl::{
    common_knowledge::{common_knowledge, recursion::Recursion},
    marginalisation::reference::{Choice, Controller},
    partition::{Pairs, all_partitions},
    policy::{Mode, Part, Path, Sampler},
};
use mackrl_env::{Action, AgentId, Draw, EntityId, EntitySet, EpisodeKey, Stream};
use support::{
    AGENTS, DELEGATE, MASKED, Numbers, PAIRS, TEAM, Tables, actions, assert_close, ids, log_softmax,
};

type Entities = BTreeSet<usize>;

/// A state of sight: M^a as a plain set for each agent.
struct Sight {
    seen_n: Vec<Entities>,
}

impl Sight {
    /// Five agents and six other entities; the first `seeing` agents see each other.
    fn random(seed: u64, seeing: usize) -> Self {
        let mut numbers = Numbers::new(seed);
        let seen_n = (0..5)
            .map(|a| {
                (0..11)
                    .filter(|&e| e == a || a < seeing && e < seeing || numbers.uniform() < 0.6)
                    .collect()
            })
            .collect();
        Self { seen_n }
    }

    /// μ^a(s^a, s^e)
    fn sees(&self, a: usize, e: usize) -> bool {
        self.seen_n[a].contains(&e)
    }

    /// 𝓘^{a,m} by eqs. (1) and (2), word for word.
    fn knows(&self, group: &[usize], a: usize, m: usize) -> Entities {
        if m == 0 {
            return self.seen_n[a].clone();
        }
        group
            .iter()
            .map(|&b| {
                let known_to_b = self.knows(group, b, m - 1);
                known_to_b.into_iter().filter(|_| self.sees(a, b)).collect()
            })
            .reduce(|all: Entities, of_b: Entities| &all & &of_b)
            .expect("a group has members")
    }

    fn visible_n(&self) -> Vec<EntitySet> {
        self.seen_n.iter().map(entity_set).collect()
    }
}

fn entity_set(entities: &Entities) -> EntitySet {
    entities.iter().copied().map(EntityId::new).collect()
}

/// Groups and states of sight to try, half of them with some common knowledge.
fn sights() -> impl Iterator<Item = (Vec<usize>, Sight)> {
    let groups = [
        vec![2],
        vec![0, 1],
        vec![3, 1],
        vec![0, 1, 2],
        vec![2, 4, 0, 1],
    ];
    groups.into_iter().flat_map(|group| {
        (0..40).map(move |seed| {
            (
                group.clone(),
                Sight::random(seed, if seed % 2 == 0 { 5 } else { 2 }),
            )
        })
    })
}

#[test]
fn equation_1_common_knowledge_is_the_limit_of_the_levels() {
    for (group, sight) in sights() {
        let limit = Recursion::default().limit(&ids(&group), &sight.visible_n());
        for &a in &group {
            for m in limit.stable_from..=4 {
                assert_eq!(entity_set(&sight.knows(&group, a, m)), limit.known);
            }
        }
    }
}

#[test]
fn equation_2_each_level_is_what_all_members_in_sight_know_at_the_level_below() {
    for (group, sight) in sights() {
        let limit = Recursion::default().limit(&ids(&group), &sight.visible_n());
        // The levels reach the limit when the recursion says so, not earlier, and by level 3 as the paper proves.
        let first_common = (0..=4).find(|&m| {
            (group.iter()).all(|&a| entity_set(&sight.knows(&group, a, m)) == limit.known)
        });
        assert_eq!(first_common, Some(limit.stable_from));
        assert!(limit.stable_from <= 3, "level {}", limit.stable_from);
    }
}

#[test]
fn equation_3_lemma_1_common_knowledge_is_mutual_knowledge_of_those_who_see_each_other() {
    let mut known_something = 0;
    for (group, sight) in sights() {
        let all_see_all = (group.iter()).all(|&a| group.iter().all(|&b| sight.sees(a, b)));
        let mutual: Entities = (0..11)
            .filter(|&e| group.iter().all(|&a| sight.sees(a, e)))
            .collect();
        let expected = if all_see_all {
            entity_set(&mutual)
        } else {
            EntitySet::EMPTY
        };
        assert_eq!(common_knowledge(&ids(&group), &sight.visible_n()), expected);
        known_something += usize::from(all_see_all);
    }
    assert!(
        (100..200).contains(&known_something),
        "{known_something} of 200 groups"
    );
}

/// A random distribution over `count` choices.
fn distribution(numbers: &mut Numbers, count: usize) -> Vec<f64> {
    let logits: Vec<f64> = (0..count).map(|_| numbers.logit()).collect();
    log_softmax(&logits).into_iter().map(f64::exp).collect()
}

/// A hierarchy over three agents that may act at any level: as a team, as a pair beside a single, or alone.
struct Team {
    joint: Vec<f64>,
    /// Probability of the partition {agents in pair}, {the third}; one for each pair.
    split: Vec<f64>,
    /// Probability of the partition into singletons.
    scatter: f64,
    pair: Vec<Vec<f64>>,
    single: Vec<Vec<f64>>,
}

const A: usize = 2;
const TRIO_PAIRS: [([usize; 2], usize); 3] = [([0, 1], 2), ([0, 2], 1), ([1, 2], 0)];

impl Team {
    fn random(seed: u64) -> Self {
        let mut numbers = Numbers::new(seed);
        let mut top = distribution(&mut numbers, A * A * A + 4);
        let scatter = top.pop().expect("the last choice");
        let split = top.split_off(A * A * A);
        Self {
            joint: top,
            split,
            scatter,
            pair: (0..3)
                .map(|_| distribution(&mut numbers, 1 + A * A))
                .collect(),
            single: (0..3).map(|_| distribution(&mut numbers, A)).collect(),
        }
    }

    fn controller(&self) -> Controller {
        let single = |a: usize| {
            let choices = self.single[a].iter().enumerate();
            let choices = choices.map(|(u, &p)| {
                let alone = vec![(AgentId::new(a), Action::new(u))];
                (p, Choice::Act(alone))
            });
            Controller {
                choices: choices.collect(),
            }
        };
        let act = |members: &[usize], number: usize| {
            let digits =
                (0..members.len()).map(|i| number / A.pow(u32::try_from(i).expect("small")) % A);
            let actions = digits.map(Action::new);
            Choice::Act(ids(members).into_iter().zip(actions).collect())
        };
        let pair = |k: usize| {
            let members = TRIO_PAIRS[k].0;
            let delegate = (self.pair[k][0], Choice::Divide(members.map(single).into()));
            let joint = self.pair[k][1..].iter().enumerate();
            let joint = joint.map(|(number, &p)| (p, act(&members, number)));
            Controller {
                choices: std::iter::once(delegate).chain(joint).collect(),
            }
        };
        let joint = self.joint.iter().enumerate();
        let joint = joint.map(|(number, &p)| (p, act(&[0, 1, 2], number)));
        let split = (0..3).map(|k| {
            (
                self.split[k],
                Choice::Divide(vec![pair(k), single(TRIO_PAIRS[k].1)]),
            )
        });
        let scatter = (self.scatter, Choice::Divide((0..3).map(single).collect()));
        Controller {
            choices: joint.chain(split).chain([scatter]).collect(),
        }
    }

    /// p(u) written out.
    fn probability(&self, u: [usize; 3]) -> f64 {
        let single = |a: usize| self.single[a][u[a]];
        let split: f64 = (0..3)
            .map(|k| {
                let ([a, b], c) = TRIO_PAIRS[k];
                let pair =
                    self.pair[k][1 + u[a] + A * u[b]] + self.pair[k][0] * single(a) * single(b);
                self.split[k] * pair * single(c)
            })
            .sum();
        self.joint[u[0] + A * u[1] + A * A * u[2]]
            + split
            + self.scatter * single(0) * single(1) * single(2)
    }
}

#[test]
fn equation_4_a_controller_chooses_a_joint_action_or_any_partition_of_its_group() {
    for seed in 0..20 {
        let team = Team::random(seed);
        let controller = team.controller();
        let mut total = 0.0;
        for number in 0..A * A * A {
            let u = [number % A, number / A % A, number / (A * A)];
            let found = controller.probability(&actions(&u));
            assert_close(found, team.probability(u), 1e-15);
            total += found;
        }
        assert_close(total, 1.0, 1e-14);
    }
}

#[test]
fn equation_5_the_marginal_is_the_sum_over_partitions_and_delegations() {
    for agents in 2..=5 {
        let tables = Tables::random(31 + agents as u64, agents, 2);
        for actions_n in tables.joint_actions() {
            let literal: f64 = sum_over_paths(&tables, &actions_n);
            assert_close(tables.log_likelihood(&actions_n).exp(), literal, 1e-14);
        }
    }
}

/// `Σ_path p(u | path)·p(path)`: a path is a partition and, for each of its pairs, whether the pair delegated.
fn sum_over_paths(tables: &Tables, actions_n: &[Action]) -> f64 {
    let of_agent = |a: AgentId| tables.agent_row(a)[actions_n[a.index()].index()].exp();
    let mut total = 0.0;
    for (partition, log_p) in tables.partitions.iter().zip(&tables.levels[TEAM]) {
        for delegations in 0..1_usize << partition.pairs().len() {
            let mut path = log_p.exp();
            for (i, pair) in partition.pairs().iter().enumerate() {
                let row = tables.pair_row(*pair);
                let [a, b] = pair.agents();
                let joint = tables.column(*pair, actions_n);
                path *= if delegations >> i & 1 == 1 {
                    row[DELEGATE].exp() * of_agent(a) * of_agent(b)
                } else {
                    row[joint].exp()
                };
            }
            total += path * partition.singleton().map_or(1.0, of_agent);
        }
    }
    total
}

#[test]
fn equation_6_the_policy_gradient_is_the_advantage_times_the_gradient_of_log_p() {
    const ADVANTAGE: f64 = -1.7;
    const STEP: f64 = 1e-5;
    let tables = Tables::random(41, 5, 2);
    // The parameters θ are logits; each row of each level is their log-softmax.
    let rows = row_lengths(&tables);
    let theta: Vec<f64> = tables.clone().entries_mut().map(|entry| *entry).collect();
    let objective = |theta: &[f64], actions_n: &[Action]| {
        let mut moved = tables.clone();
        let entries = log_softmax_of_rows(theta, &rows);
        moved
            .entries_mut()
            .zip(entries)
            .for_each(|(entry, value)| *entry = value);
        ADVANTAGE * moved.log_likelihood(actions_n)
    };
    let possible = (tables.joint_actions().into_iter())
        .filter(|actions_n| tables.log_likelihood(actions_n) > MASKED);
    for actions_n in possible.step_by(3) {
        let gradient = through_log_softmax(&theta, &tables.dense_gradient(&actions_n), &rows);
        for (index, analytic) in gradient.into_iter().enumerate() {
            let at = |by: f64| {
                let mut moved = theta.clone();
                moved[index] += by;
                objective(&moved, &actions_n)
            };
            let numeric = (at(STEP) - at(-STEP)) / (2.0 * STEP);
            assert_close(ADVANTAGE * analytic, numeric, 1e-8);
        }
    }
}

/// Lengths of the rows that the entries of a table form, in their order.
fn row_lengths(tables: &Tables) -> Vec<usize> {
    let agents = tables.agents();
    let mut lengths = vec![tables.partitions.len()];
    lengths.extend(vec![tables.columns(PAIRS); agents * (agents - 1) / 2]);
    lengths.extend(vec![tables.actions(); agents]);
    lengths
}

fn split_rows<'a>(mut entries: &'a [f64], lengths: &[usize]) -> Vec<&'a [f64]> {
    (lengths.iter())
        .map(|&length| {
            entries
                .split_off(..length)
                .expect("the rows cover the entries")
        })
        .collect()
}

fn log_softmax_of_rows(logits: &[f64], lengths: &[usize]) -> Vec<f64> {
    split_rows(logits, lengths)
        .into_iter()
        .flat_map(log_softmax)
        .collect()
}

/// ∂/∂θ from ∂/∂log π for rows log π = log-softmax(θ): g − π·Σg; zero where masked.
fn through_log_softmax(log_p: &[f64], gradient: &[f64], lengths: &[usize]) -> Vec<f64> {
    (split_rows(log_p, lengths).into_iter())
        .zip(split_rows(gradient, lengths))
        .flat_map(|(log_p, gradient)| {
            let total: f64 = gradient.iter().sum();
            let through = move |(log_p, g): (&f64, &f64)| g - log_p.exp() * total;
            log_p.iter().zip(gradient).map(through).collect::<Vec<_>>()
        })
        .collect()
}

/// The index at which the cumulative probability exceeds `uniform`.
fn invert(log_p: &[f64], uniform: f64) -> usize {
    let mut cumulative = 0.0;
    (log_p.iter())
        .position(|log_p| {
            cumulative += log_p.exp();
            cumulative > uniform
        })
        .expect("the total is 1")
}

#[test]
fn algorithm_1_samples_a_partition_then_its_pairs_then_those_who_are_left() {
    let tables = Tables::random(43, 5, 3);
    let mut jointly = 0;
    for episode in 0..500 {
        let key = EpisodeKey::new(7, Stream::Training, episode);
        let step = 11;
        let partition = invert(&tables.levels[TEAM], key.uniform(step, Draw::Selector));
        let mut expected_n = vec![None; 5];
        for pair in tables.partitions[partition].pairs() {
            let draw = key.uniform(step, Draw::Pair(pair.index()));
            let column = invert(tables.pair_row(*pair), draw);
            if column == DELEGATE {
                continue;
            }
            // u_d comes first, then 𝓤^a × 𝓤^a' with the actions of the higher agent side by side.
            let chosen = [(column - 1) / 3, (column - 1) % 3].map(Action::new);
            for (agent, action) in pair.agents().into_iter().zip(chosen) {
                expected_n[agent.index()] = Some(action);
                jointly += 1;
            }
        }
        for (agent, action) in expected_n.iter_mut().enumerate() {
            let draw = key.uniform(step, Draw::Agent(agent));
            let row = tables.agent_row(AgentId::new(agent));
            action.get_or_insert_with(|| Action::new(invert(row, draw)));
        }
        let mut actions_n = vec![Action::default(); 5];
        let mut path = Path::default();
        let sampler = Sampler {
            key,
            step,
            mode: Mode::Sampled,
        };
        sampler.walk(&tables.table(), None, &mut actions_n, &mut path);
        assert_eq!(path.division(), partition);
        assert_eq!(
            actions_n.into_iter().map(Some).collect::<Vec<_>>(),
            expected_n
        );
    }
    assert!(
        (200..2_300).contains(&jointly),
        "{jointly} of 2 500 actions were joint"
    );
}

#[test]
fn algorithm_1_in_general_samples_each_joint_action_as_often_as_equation_5_says() {
    const SAMPLES: usize = 100_000;
    let team = Team::random(3);
    let controller = team.controller();
    let mut numbers = Numbers::new(47);
    let mut counts = [0.0; A * A * A];
    for _ in 0..SAMPLES {
        let mut u = [0; 3];
        for (agent, action) in controller.sample(&mut || numbers.uniform()) {
            u[agent.index()] = action.index();
        }
        counts[u[0] + A * u[1] + A * A * u[2]] += 1.0;
    }
    for (number, count) in counts.into_iter().enumerate() {
        let p = team.probability([number % A, number / A % A, number / (A * A)]);
        let deviation = (SAMPLES as f64 * p * (1.0 - p)).sqrt();
        let z: f64 = (count - SAMPLES as f64 * p) / deviation;
        assert!(z.abs() < 4.0, "joint action {number}: z = {z}");
    }
}

#[test]
fn table_1_three_agents_have_one_selector_three_pair_controllers_and_three_agent_controllers() {
    let tables = Tables::random(53, 3, 5);
    let table = tables.table();
    let row = |level: usize, group: usize| table.row(Part { level, group });
    assert_eq!(
        row(TEAM, 0).len(),
        3,
        "the selector chooses among three partitions"
    );
    assert_eq!(Pairs::new(3).count(), 3);
    let groups = tables.declaration.levels().iter();
    let groups: Vec<usize> = groups.map(|level| level.groups.len()).collect();
    assert_eq!(groups, [1, 3, 3]);
    for (partition, alone) in all_partitions(3).iter().zip(ids(&[0, 1, 2])) {
        assert_eq!(partition.pairs().len(), 1);
        assert_eq!(partition.singleton(), Some(alone));
    }
    for pair in Pairs::new(3).iter() {
        assert_eq!(
            row(PAIRS, pair.index()).len(),
            1 + 5 * 5,
            "u_d beside U^a × U^a'"
        );
    }
    for agent in 0..3 {
        assert_eq!(row(AGENTS, agent).len(), 5);
    }
}
