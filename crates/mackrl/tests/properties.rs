//! What holds for every table, every partition and every relation of sight.

mod support;

use mackrl::{
    common_knowledge::common_knowledge,
    hierarchy::{PairChoice, Path, Sampler},
    marginalisation::reference::Controller,
    partition::{Pair, PartitionBuffer, PartitionSchedule},
    policy::{DELEGATE, Mode},
};
use mackrl_env::{Action, AgentId, EntitySet, EpisodeKey, Stream};
use proptest::prelude::*;
use support::{MASKED, Tables, assert_close, log_softmax};

/// Tables of 2 to 5 agents with few enough actions that all joint actions can be listed.
fn tables() -> impl Strategy<Value = Tables> {
    (any::<u64>(), 2..=5_usize, 2..=3_usize)
        .prop_map(|(seed, agents, actions)| Tables::random(seed, agents, actions))
}

/// A table and one of its joint actions, possible or not.
fn tables_and_actions() -> impl Strategy<Value = (Tables, Vec<Action>)> {
    (tables(), any::<prop::sample::Index>()).prop_map(|(tables, index)| {
        let actions_n = index.get(&tables.joint_actions()).clone();
        (tables, actions_n)
    })
}

/// A table and one of its possible joint actions.
fn tables_and_possible_actions() -> impl Strategy<Value = (Tables, Vec<Action>)> {
    (tables(), any::<prop::sample::Index>()).prop_map(|(tables, index)| {
        let mut possible = tables.joint_actions();
        possible.retain(|actions_n| tables.log_likelihood(actions_n) > MASKED);
        let actions_n = index.get(&possible).clone();
        (tables, actions_n)
    })
}

fn sampler(episode: u64, mode: Mode) -> Sampler {
    Sampler {
        key: EpisodeKey::new(19, Stream::Training, episode),
        step: 3,
        mode,
    }
}

fn sample(tables: &Tables, sampler: Sampler) -> (Vec<Action>, Path) {
    let mut actions_n = vec![Action::default(); tables.shape.agents];
    let mut path = Path::default();
    sampler.sample(&tables.table(), &mut actions_n, &mut path);
    (actions_n, path)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn probabilities_of_all_joint_actions_sum_to_one(tables in tables()) {
        let total: f64 = (tables.joint_actions().iter())
            .map(|actions_n| tables.log_likelihood(actions_n).exp())
            .sum();
        prop_assert!((total - 1.0).abs() < 1e-12, "total {total}");
    }

    #[test]
    fn the_pairwise_marginal_equals_the_general_hierarchy((tables, actions_n) in tables_and_actions()) {
        let reference = Controller::pairwise(&tables.table()).probability(&actions_n);
        let found = tables.log_likelihood(&actions_n).exp();
        prop_assert!((found - reference).abs() < 1e-14, "{found} for {reference}");
    }

    #[test]
    fn a_masked_action_has_no_probability_and_no_gradient((tables, actions_n) in tables_and_actions()) {
        let impossible = (0..tables.shape.agents)
            .any(|n| tables.table().agent(n)[actions_n[n].index()] == MASKED);
        let log_p = tables.log_likelihood(&actions_n);
        prop_assert!(!impossible || log_p == MASKED, "p = {}", log_p.exp());
        let mut copy = tables.clone();
        for (entry, gradient) in copy.entries_mut().zip(tables.dense_gradient(&actions_n)) {
            prop_assert!((0.0..=1.0 + 1e-14).contains(&gradient), "gradient {gradient}");
            prop_assert!(*entry > MASKED || gradient == 0.0, "gradient {gradient} of a masked entry");
        }
    }

    #[test]
    fn posterior_weights_sum_to_one((tables, actions_n) in tables_and_possible_actions()) {
        let gradient = tables.gradient(&actions_n);
        assert_close(gradient.selector_p.iter().sum(), 1.0, 1e-13);
        // Every agent's action has one cause: a pair that acted jointly, or the agent alone.
        let mut responsible_n = gradient.agent_n.clone();
        for pair in mackrl::partition::Pairs::new(tables.shape.agents).iter() {
            for agent in pair.agents() {
                responsible_n[agent.index()] += gradient.joint_k[pair.index()];
            }
        }
        for responsible in responsible_n {
            assert_close(responsible, 1.0, 1e-13);
        }
    }

    #[test]
    fn a_sampled_joint_action_is_possible(tables in tables(), episode in 0..1_u64 << 40) {
        for mode in [Mode::Sampled, Mode::Greedy] {
            let (actions_n, path) = sample(&tables, sampler(episode, mode));
            prop_assert!(tables.log_likelihood(&actions_n) > MASKED, "{actions_n:?} was sampled");
            let partition = &tables.partitions[path.partition];
            prop_assert_eq!(path.delegated.len(), partition.pairs().len());
            for (pair, &delegated) in partition.pairs().iter().zip(&path.delegated) {
                let [a, b] = pair.agents().map(|agent| actions_n[agent.index()]);
                let column = if delegated { DELEGATE } else { tables.shape.column(a, b) };
                prop_assert!(tables.pair_row(*pair)[column] > MASKED, "{pair:?} chose a masked column");
            }
        }
    }

    #[test]
    fn agents_that_ask_only_their_own_controllers_act_as_the_central_sampler(
        tables in tables(),
        episode in 0..1_u64 << 40,
    ) {
        for mode in [Mode::Sampled, Mode::Greedy] {
            let sampler = sampler(episode, mode);
            let (actions_n, _) = sample(&tables, sampler);
            for agent in (0..tables.shape.agents).map(AgentId::new) {
                prop_assert_eq!(act_alone(&tables, sampler, agent), actions_n[agent.index()]);
            }
        }
    }

    #[test]
    fn permuting_agents_permutes_results(
        (tables, actions_n) in tables_and_actions(),
        order in Just((0..5_usize).collect::<Vec<_>>()).prop_shuffle(),
    ) {
        // `new_of[a]` is the new name of agent a.
        let new_of: Vec<usize> = order.into_iter().filter(|&a| a < tables.shape.agents).collect();
        let permuted = permute(&tables, &new_of);
        let mut permuted_actions_n = actions_n.clone();
        for (agent, &action) in actions_n.iter().enumerate() {
            permuted_actions_n[new_of[agent]] = action;
        }
        let (before, after) = (tables.log_likelihood(&actions_n), permuted.log_likelihood(&permuted_actions_n));
        prop_assert!((before.exp() - after.exp()).abs() < 1e-14, "{before} became {after}");
        let (before, after) = (tables.gradient(&actions_n), permuted.gradient(&permuted_actions_n));
        for (agent, &new) in new_of.iter().enumerate() {
            assert_close(after.agent_n[new], before.agent_n[agent], 1e-13);
        }
        for pair in mackrl::partition::Pairs::new(new_of.len()).iter() {
            let new = renamed(pair, &new_of);
            assert_close(after.joint_k[new.index()], before.joint_k[pair.index()], 1e-13);
            assert_close(after.delegate_k[new.index()], before.delegate_k[pair.index()], 1e-13);
        }
    }

    #[test]
    fn gradients_equal_central_differences((tables, actions_n) in tables_and_possible_actions()) {
        let step = 1e-5;
        let gradient = tables.dense_gradient(&actions_n);
        for (index, &analytic) in gradient.iter().enumerate() {
            let moved = |by: f64| {
                let mut copy = tables.clone();
                *copy.entries_mut().nth(index).expect("an entry for each number") += by;
                copy.log_likelihood(&actions_n)
            };
            let numeric = (moved(step) - moved(-step)) / (2.0 * step);
            prop_assert!(
                (analytic - numeric).abs() < 1e-8 * (1.0 + tables.log_likelihood(&actions_n).abs()),
                "entry {index}: {analytic} for {numeric}"
            );
        }
    }

    #[test]
    fn common_knowledge_is_symmetric_seen_by_all_and_shrinks_as_the_group_grows(
        seen_n in prop::collection::vec(any::<u128>(), 7),
        mutual in any::<bool>(),
        group in Just((0..7_usize).collect::<Vec<_>>()).prop_shuffle(),
        size in 1..7_usize,
    ) {
        let visible_n: Vec<EntitySet> = seen_n
            .iter()
            .enumerate()
            .map(|(a, &bits)| EntitySet::from_bits(bits | if mutual { 0x7F } else { 1 << a }))
            .collect();
        let ordered = support::ids(&group[..size]);
        let known = common_knowledge(&ordered, &visible_n);
        let reversed: Vec<AgentId> = ordered.iter().rev().copied().collect();
        prop_assert_eq!(known, common_knowledge(&reversed, &visible_n));
        for member in &ordered {
            prop_assert!(known.is_subset_of(visible_n[member.index()]), "{member} does not see all");
        }
        let larger = support::ids(&group[..=size]);
        prop_assert!(common_knowledge(&larger, &visible_n).is_subset_of(known), "a larger group knows more");
    }

    #[test]
    fn every_schedule_gives_distinct_partitions_of_the_whole_team(
        agents in 1..28_usize,
        seed in any::<u64>(),
        step in 0..200_usize,
    ) {
        let count = if agents < 3 { 1 } else { 3 };
        let mut schedules = vec![PartitionSchedule::Sampled { count }, PartitionSchedule::RoundRobin];
        if agents <= PartitionSchedule::MOST_AGENTS_ENUMERATED {
            schedules.push(PartitionSchedule::All);
        }
        let key = EpisodeKey::new(seed, Stream::Training, 0);
        for schedule in schedules {
            let plan = schedule.plan(agents, seed).expect("the team is small enough");
            let mut buffer = PartitionBuffer::default();
            let partitions = plan.in_force(&key, step, &mut buffer);
            prop_assert_eq!(partitions.len(), plan.count());
            for (i, partition) in partitions.iter().enumerate() {
                let mut members: Vec<usize> = (partition.pairs().iter())
                    .flat_map(|pair| pair.agents())
                    .chain(partition.singleton())
                    .map(AgentId::index)
                    .collect();
                members.sort_unstable();
                prop_assert_eq!(members, (0..agents).collect::<Vec<_>>());
                prop_assert!(!partitions[..i].contains(partition), "a partition is in force twice");
            }
        }
    }

    #[test]
    fn likelihoods_of_a_large_team_survive_far_below_the_smallest_number(seed in any::<u64>()) {
        let plan = PartitionSchedule::Sampled { count: 13 }.plan(24, seed).expect("24 agents have enough");
        let partitions = plan.in_force(&EpisodeKey::new(0, Stream::Other, 0), 0, &mut PartitionBuffer::default()).to_vec();
        let mut tables = Tables::random_with(seed, 2, partitions);
        // Action 1 of every agent, and every joint action with it, has a probability of about e⁻²⁰⁰.
        let columns = tables.shape.columns();
        for row in tables.log_p_agent_na.chunks_mut(2) {
            row.copy_from_slice(&log_softmax(&[0.0, row[0].max(-3.0) - 200.0]));
        }
        for row in tables.log_p_pair_kc.chunks_mut(columns) {
            let joint = row[DELEGATE] - 390.0;
            row.copy_from_slice(&[0.0, -500.0, -600.0, -700.0, joint]);
        }
        let actions_n = vec![Action::new(1); 24];
        let log_p = tables.log_likelihood(&actions_n);
        prop_assert!(log_p < -4_000.0 && log_p.is_finite(), "log p = {log_p}");
        let gradient = tables.gradient(&actions_n);
        assert_close(gradient.selector_p.iter().sum(), 1.0, 1e-11);
        prop_assert!(
            gradient.joint_k.iter().chain(&gradient.delegate_k).all(|x| (0.0..1.0 + 1e-11).contains(x)),
            "{gradient:?}"
        );
        prop_assert!(gradient.joint_k.iter().sum::<f64>() > 6.0, "the joint way is the likelier one");
    }
}

/// What one agent does that runs the selector, the pair controllers that it belongs to and its own.
fn act_alone(tables: &Tables, sampler: Sampler, agent: AgentId) -> Action {
    let partition = &tables.partitions[sampler.choose_partition(&tables.log_p_selector_p)];
    let own_pair = (partition.pairs().iter()).find(|pair| pair.partner_of(agent).is_some());
    if let Some(&pair) = own_pair
        && let PairChoice::Joint([first, second]) =
            sampler.choose_pair(pair, tables.shape, tables.pair_row(pair))
    {
        return if pair.agents()[0] == agent {
            first
        } else {
            second
        };
    }
    sampler.choose_action(agent, tables.agent_row(agent))
}

fn renamed(pair: Pair, new_of: &[usize]) -> Pair {
    let [a, b] = pair
        .agents()
        .map(|agent| AgentId::new(new_of[agent.index()]));
    Pair::among(new_of.len(), a, b)
}

/// The same team under new names.
fn permute(tables: &Tables, new_of: &[usize]) -> Tables {
    let mut permuted = tables.clone();
    let shape = tables.shape;
    let (columns, actions) = (shape.columns(), shape.actions);
    for (agent, &new) in new_of.iter().enumerate() {
        permuted.log_p_agent_na[new * actions..(new + 1) * actions]
            .copy_from_slice(tables.table().agent(agent));
    }
    for pair in mackrl::partition::Pairs::new(shape.agents).iter() {
        let new = renamed(pair, new_of);
        let turned = new_of[pair.agents()[0].index()] > new_of[pair.agents()[1].index()];
        for (column, &log_p) in tables.pair_row(pair).iter().enumerate() {
            let new_column = match shape.joint_action(column) {
                Some([first, second]) if turned => shape.column(second, first),
                _ => column,
            };
            permuted.log_p_pair_kc[new.index() * columns + new_column] = log_p;
        }
    }
    for (partition, &log_p) in tables.partitions.iter().zip(&tables.log_p_selector_p) {
        let mut pairs: Vec<Pair> = (partition.pairs().iter())
            .map(|&pair| renamed(pair, new_of))
            .collect();
        pairs.sort_unstable();
        let place = (tables.partitions.iter()).position(|other| other.pairs() == pairs);
        permuted.log_p_selector_p[place.expect("all partitions are in force")] = log_p;
    }
    permuted
}

/// χ² of `counts` against `expected`, beside its degrees of freedom.
fn chi_square(counts: &[f64], expected: &[f64]) -> (f64, f64) {
    let cells: Vec<f64> = (counts.iter().zip(expected))
        .filter(|(_, expected)| **expected > 0.0)
        .map(|(count, expected)| (count - expected).powi(2) / expected)
        .collect();
    (cells.iter().sum(), cells.len() as f64 - 1.0)
}

#[test]
fn a_million_samples_match_the_likelihood() {
    const SAMPLES: u64 = 1_000_000;
    let tables = Tables::random(23, 3, 3);
    let joint_actions = tables.joint_actions();
    let mut counts = vec![0.0; joint_actions.len()];
    let mut actions_n = vec![Action::default(); 3];
    let mut path = Path::default();
    for episode in 0..SAMPLES {
        sampler(episode, Mode::Sampled).sample(&tables.table(), &mut actions_n, &mut path);
        let [a, b, c] = [0, 1, 2].map(|n| actions_n[n].index());
        counts[a + 3 * b + 9 * c] += 1.0;
    }
    let expected: Vec<f64> = (joint_actions.iter())
        .map(|actions_n| SAMPLES as f64 * tables.log_likelihood(actions_n).exp())
        .collect();
    for (count, expected) in counts.iter().zip(&expected) {
        assert!(
            *expected > 0.0 || *count == 0.0,
            "an impossible joint action was sampled"
        );
    }
    let (chi_square, freedom) = chi_square(&counts, &expected);
    assert!(freedom >= 7.0, "too few joint actions are possible");
    // Mean `freedom`, standard deviation √(2·freedom); four of them are exceeded once in some ten thousand seeds.
    let bound = freedom + 4.0 * (2.0 * freedom).sqrt();
    assert!(
        chi_square < bound,
        "χ² = {chi_square} with {freedom} degrees of freedom"
    );
}
