//! What holds for every table, every partition and every relation of sight.

mod support;

use mackrl::{
    common_knowledge::common_knowledge,
    marginalisation::{MarginalGradient, pairwise, recursive, reference::Controller},
    partition::{Pair, PartitionBuffer, PartitionSchedule},
    policy::{Mode, Part, Path, PolicyTable, Sampler},
};
use mackrl_env::{Action, AgentId, EntitySet, EpisodeKey, Stream};
use proptest::prelude::*;
use support::{AGENTS, DELEGATE, MASKED, PAIRS, TEAM, Tables, assert_close, log_softmax};

/// Tables of 2 to 5 agents with few enough actions that all joint actions can be listed.
fn tables() -> impl Strategy<Value = Tables> {
    (any::<u64>(), 2..=5_usize, 2..=3_usize)
        .prop_map(|(seed, agents, actions)| Tables::random(seed, agents, actions))
}

/// Tables of team → fours → pairs → agents, of 4 to 6 agents with 2 actions each, and one of their joint actions.
fn fours_and_actions() -> impl Strategy<Value = (Tables, Vec<Action>)> {
    (any::<u64>(), 4..=6_usize, any::<prop::sample::Index>()).prop_map(|(seed, agents, index)| {
        let tables = Tables::random_fours(seed, agents, 2);
        let actions_n = index.get(&tables.joint_actions()).clone();
        (tables, actions_n)
    })
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
    let mut actions_n = vec![Action::default(); tables.agents()];
    let mut path = Path::default();
    sampler.walk(&tables.table(), None, &mut actions_n, &mut path);
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
        let reference = Controller::of_team(&tables.table()).probability(&actions_n);
        let found = tables.log_likelihood(&actions_n).exp();
        prop_assert!((found - reference).abs() < 1e-14, "{found} for {reference}");
    }

    #[test]
    fn a_masked_action_has_no_probability_and_no_gradient((tables, actions_n) in tables_and_actions()) {
        let impossible = (0..tables.agents())
            .any(|n| tables.agent_row(AgentId::new(n))[actions_n[n].index()] == MASKED);
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
        assert_close(gradient.levels[TEAM].division_gd.iter().sum(), 1.0, 1e-13);
        // Every agent's action has one cause: a pair that acted jointly, or the agent alone.
        let mut responsible_n = gradient.levels[AGENTS].joint_g.clone();
        for pair in mackrl::partition::Pairs::new(tables.agents()).iter() {
            for agent in pair.agents() {
                responsible_n[agent.index()] += gradient.levels[PAIRS].joint_g[pair.index()];
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
            let partition = &tables.partitions[path.division()];
            let asked = path.choices.iter().filter(|(part, _)| part.level == PAIRS);
            prop_assert_eq!(asked.count(), partition.pairs().len());
            for pair in partition.pairs() {
                let part = Part { level: PAIRS, group: pair.index() };
                let column = path.choice(part).expect("a pair of the chosen partition");
                prop_assert!(column == DELEGATE || column == tables.column(*pair, &actions_n));
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
            for agent in (0..tables.agents()).map(AgentId::new) {
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
        let new_of: Vec<usize> = order.into_iter().filter(|&a| a < tables.agents()).collect();
        let permuted = permute(&tables, &new_of);
        let mut permuted_actions_n = actions_n.clone();
        for (agent, &action) in actions_n.iter().enumerate() {
            permuted_actions_n[new_of[agent]] = action;
        }
        let (before, after) = (tables.log_likelihood(&actions_n), permuted.log_likelihood(&permuted_actions_n));
        prop_assert!((before.exp() - after.exp()).abs() < 1e-14, "{before} became {after}");
        let (before, after) = (tables.gradient(&actions_n), permuted.gradient(&permuted_actions_n));
        for (agent, &new) in new_of.iter().enumerate() {
            assert_close(after.levels[AGENTS].joint_g[new], before.levels[AGENTS].joint_g[agent], 1e-13);
        }
        for pair in mackrl::partition::Pairs::new(new_of.len()).iter() {
            let new = renamed(pair, &new_of);
            let [after, before] = [&after.levels[PAIRS], &before.levels[PAIRS]];
            assert_close(after.joint_g[new.index()], before.joint_g[pair.index()], 1e-13);
            assert_close(after.division_gd[new.index()], before.division_gd[pair.index()], 1e-13);
        }
    }

    #[test]
    fn gradients_equal_central_differences((tables, actions_n) in tables_and_possible_actions()) {
        check_gradient(&tables, &actions_n)?;
    }

    #[test]
    fn the_closed_form_is_the_recursion((tables, actions_n) in tables_and_actions()) {
        let (mut closed, mut recursed) = (MarginalGradient::default(), MarginalGradient::default());
        let table = tables.table();
        let found = pairwise::log_likelihood_with_gradient(&table, &actions_n, &mut closed);
        let expected = recursive::log_likelihood_with_gradient(&table, &actions_n, &mut recursed);
        prop_assert!(found == expected || (found - expected).abs() < 1e-12, "{found} for {expected}");
        let [closed, recursed] = [&closed, &recursed].map(|gradient| tables.dense(gradient, &actions_n));
        for (place, (found, expected)) in closed.into_iter().zip(recursed).enumerate() {
            prop_assert!((found - expected).abs() < 1e-12, "entry {place}: {found} for {expected}");
        }
    }

    #[test]
    fn the_recursion_over_fours_is_the_general_hierarchy((tables, actions_n) in fours_and_actions()) {
        let reference = Controller::of_team(&tables.table()).probability(&actions_n);
        let found = tables.log_likelihood(&actions_n).exp();
        prop_assert!((found - reference).abs() < 1e-12, "{found} for {reference}");
    }

    #[test]
    fn probabilities_of_all_joint_actions_of_fours_sum_to_one((tables, _) in fours_and_actions()) {
        let total: f64 = (tables.joint_actions().iter())
            .map(|actions_n| tables.log_likelihood(actions_n).exp())
            .sum();
        prop_assert!((total - 1.0).abs() < 1e-12, "total {total}");
    }

    #[test]
    fn gradients_of_fours_equal_central_differences((tables, actions_n) in fours_and_actions()) {
        prop_assume!(tables.log_likelihood(&actions_n) > MASKED);
        check_gradient(&tables, &actions_n)?;
    }

    #[test]
    fn agents_of_fours_that_ask_only_their_own_controllers_act_as_the_central_sampler(
        (tables, _) in fours_and_actions(),
        episode in 0..1_u64 << 40,
    ) {
        for mode in [Mode::Sampled, Mode::Greedy] {
            let sampler = sampler(episode, mode);
            let (actions_n, _) = sample(&tables, sampler);
            prop_assert!(tables.log_likelihood(&actions_n) > MASKED, "{actions_n:?} was sampled");
            for agent in (0..tables.agents()).map(AgentId::new) {
                prop_assert_eq!(act_alone(&tables, sampler, agent), actions_n[agent.index()]);
            }
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
        let columns = tables.columns(PAIRS);
        for row in tables.levels[AGENTS].chunks_mut(2) {
            row.copy_from_slice(&log_softmax(&[0.0, row[0].max(-3.0) - 200.0]));
        }
        for row in tables.levels[PAIRS].chunks_mut(columns) {
            let joint = row[DELEGATE] - 390.0;
            row.copy_from_slice(&[0.0, -500.0, -600.0, -700.0, joint]);
        }
        let actions_n = vec![Action::new(1); 24];
        let log_p = tables.log_likelihood(&actions_n);
        prop_assert!(log_p < -4_000.0 && log_p.is_finite(), "log p = {log_p}");
        let gradient = tables.gradient(&actions_n);
        assert_close(gradient.levels[TEAM].division_gd.iter().sum(), 1.0, 1e-11);
        let pairs = &gradient.levels[PAIRS];
        prop_assert!(
            pairs.joint_g.iter().chain(&pairs.division_gd).all(|x| (0.0..1.0 + 1e-11).contains(x)),
            "{gradient:?}"
        );
        prop_assert!(pairs.joint_g.iter().sum::<f64>() > 6.0, "the joint way is the likelier one");
    }
}

/// Compares the gradient of log p(u) with respect to every entry with central differences.
fn check_gradient(tables: &Tables, actions_n: &[Action]) -> Result<(), TestCaseError> {
    let step = 1e-5;
    let gradient = tables.dense_gradient(actions_n);
    for (index, &analytic) in gradient.iter().enumerate() {
        let moved = |by: f64| {
            let mut copy = tables.clone();
            *copy
                .entries_mut()
                .nth(index)
                .expect("an entry for each number") += by;
            copy.log_likelihood(actions_n)
        };
        let numeric = (moved(step) - moved(-step)) / (2.0 * step);
        prop_assert!(
            (analytic - numeric).abs() < 1e-8 * (1.0 + tables.log_likelihood(actions_n).abs()),
            "entry {index}: {analytic} for {numeric}"
        );
    }
    Ok(())
}

/// What one agent does that runs the controllers of the groups that it belongs to; all other rows are unreadable.
fn act_alone(tables: &Tables, sampler: Sampler, agent: AgentId) -> Action {
    let mut own = tables.clone();
    for (place, level) in tables.declaration.levels().iter().enumerate() {
        let columns = tables.columns(place);
        let rows = own.levels[place].chunks_mut(columns);
        for (members, row) in level.groups.iter().zip(rows) {
            if !members.contains(&agent) {
                row.fill(f64::NAN);
            }
        }
    }
    let mut actions_n = vec![Action::default(); tables.agents()];
    let table: PolicyTable<'_, f64> = own.table();
    sampler.walk(&table, Some(agent), &mut actions_n, &mut Path::default());
    actions_n[agent.index()]
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
    let (columns, actions) = (tables.columns(PAIRS), tables.actions());
    for (agent, &new) in new_of.iter().enumerate() {
        permuted.levels[AGENTS][new * actions..(new + 1) * actions]
            .copy_from_slice(tables.agent_row(AgentId::new(agent)));
    }
    for pair in mackrl::partition::Pairs::new(tables.agents()).iter() {
        let new = renamed(pair, new_of);
        let turned = new_of[pair.agents()[0].index()] > new_of[pair.agents()[1].index()];
        for (column, &log_p) in tables.pair_row(pair).iter().enumerate() {
            let new_column = match column.checked_sub(1) {
                Some(joint) if turned => 1 + joint % actions * actions + joint / actions,
                _ => column,
            };
            permuted.levels[PAIRS][new.index() * columns + new_column] = log_p;
        }
    }
    for (partition, &log_p) in tables.partitions.iter().zip(&tables.levels[TEAM]) {
        let mut pairs: Vec<Pair> = (partition.pairs().iter())
            .map(|&pair| renamed(pair, new_of))
            .collect();
        pairs.sort_unstable();
        let place = (tables.partitions.iter()).position(|other| other.pairs() == pairs);
        permuted.levels[TEAM][place.expect("all partitions are in force")] = log_p;
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
    check_frequencies(&Tables::random(23, 3, 3), 1_000_000);
}

#[test]
fn samples_of_fours_match_the_likelihood() {
    check_frequencies(&Tables::random_fours(29, 5, 2), 300_000);
}

/// Compares how often each joint action is sampled with its probability.
fn check_frequencies(tables: &Tables, samples: u64) {
    let joint_actions = tables.joint_actions();
    let mut counts = vec![0.0; joint_actions.len()];
    let mut actions_n = vec![Action::default(); tables.agents()];
    let mut path = Path::default();
    for episode in 0..samples {
        sampler(episode, Mode::Sampled).walk(&tables.table(), None, &mut actions_n, &mut path);
        let digits = actions_n.iter().rev();
        let number = digits.fold(0, |number, action| {
            number * tables.actions() + action.index()
        });
        counts[number] += 1.0;
    }
    let expected: Vec<f64> = (joint_actions.iter())
        .map(|actions_n| samples as f64 * tables.log_likelihood(actions_n).exp())
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
