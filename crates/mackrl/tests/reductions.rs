//! Special cases of the hierarchy equal simpler algorithms.

mod support;

use mackrl::{
    marginalisation::{MarginalGradient, log_likelihood, log_likelihood_with_gradient},
    partition::{PartitionBuffer, PartitionSchedule, all_partitions},
    policy::PolicyTable,
};
use mackrl_env::{AgentId, EpisodeKey, Stream};
use support::{
    AGENTS, DELEGATE, MASKED, PAIRS, TEAM, Tables, assert_close,
    team::{Team, keys, norm, world_setting},
};

/// `Σ_a log π_a(u_a)`, in the order in which a partition names the agents.
fn independent(tables: &Tables, actions_n: &[mackrl_env::Action]) -> f64 {
    let agent = |n: usize| tables.agent_row(AgentId::new(n))[actions_n[n].index()];
    let partition = &tables.partitions[0];
    let pairs: f64 = partition
        .pairs()
        .iter()
        .map(|pair| {
            let [a, b] = pair.agents();
            agent(a.index()) + agent(b.index())
        })
        .sum();
    pairs + partition.singleton().map_or(0.0, |c| agent(c.index()))
}

#[test]
fn delegating_always_equals_independent_agents_exactly() {
    for agents in 1..=5 {
        for partition in all_partitions(agents) {
            let tables = Tables::random_with(3, 3, vec![partition]).always_delegating();
            for actions_n in tables.joint_actions() {
                let expected = independent(&tables, &actions_n);
                assert_eq!(tables.log_likelihood(&actions_n), expected);
                let gradient = tables.gradient(&actions_n);
                let weight = if expected > MASKED { 1.0 } else { 0.0 };
                let [agents, pairs] = [AGENTS, PAIRS].map(|level| &gradient.levels[level].joint_g);
                assert!(agents.iter().all(|&w| w == weight), "{gradient:?}");
                assert!(pairs.iter().all(|&w| w == 0.0), "{gradient:?}");
            }
        }
    }
}

#[test]
fn delegating_always_equals_independent_agents_whatever_the_selector_does() {
    for agents in 3..=5 {
        let tables = Tables::random(5, agents, 2).always_delegating();
        for actions_n in tables.joint_actions() {
            let expected = independent(&tables, &actions_n);
            if expected > MASKED {
                assert_close(tables.log_likelihood(&actions_n), expected, 1e-14);
                for &weight in &tables.gradient(&actions_n).levels[AGENTS].joint_g {
                    assert_close(weight, 1.0, 1e-14);
                }
            } else {
                assert_eq!(tables.log_likelihood(&actions_n), MASKED);
            }
        }
    }
}

#[test]
fn never_delegating_with_one_pair_equals_a_joint_learner_exactly() {
    let tables = Tables::random(7, 2, 5).never_delegating(11);
    for actions_n in tables.joint_actions() {
        let pair = tables.partitions[0].pairs()[0];
        assert_eq!(
            tables.log_likelihood(&actions_n),
            tables.pair_row(pair)[tables.column(pair, &actions_n)]
        );
        let gradient = tables.gradient(&actions_n);
        assert_eq!(gradient.levels[PAIRS].joint_g, [1.0]);
        assert_eq!(gradient.levels[PAIRS].division_gd, [0.0]);
        assert_eq!(gradient.levels[AGENTS].joint_g, [0.0, 0.0]);
    }
}

#[test]
fn a_team_of_one_acts_on_its_own_policy() {
    let tables = Tables::random(2, 1, 7);
    for actions_n in tables.joint_actions() {
        let expected = tables.levels[AGENTS][actions_n[0].index()];
        assert_eq!(tables.log_likelihood(&actions_n), expected);
    }
}

#[test]
fn one_partition_makes_the_likelihood_a_product_over_its_pairs() {
    let plan = PartitionSchedule::RoundRobin
        .plan(7, 1)
        .expect("any team can play");
    let key = EpisodeKey::new(1, Stream::Training, 3);
    let mut buffer = PartitionBuffer::default();
    for step in 0..7 {
        let partitions = plan.in_force(&key, step, &mut buffer).to_vec();
        let tables = Tables::random_with(step as u64, 2, partitions);
        for actions_n in tables.joint_actions() {
            let p = |n: usize| tables.agent_row(AgentId::new(n))[actions_n[n].index()].exp();
            let mut product = 1.0;
            for pair in tables.partitions[0].pairs() {
                let [a, b] = pair.agents().map(AgentId::index);
                let row = tables.pair_row(*pair);
                let joint = row[tables.column(*pair, &actions_n)].exp();
                product *= joint + row[DELEGATE].exp() * p(a) * p(b);
            }
            if let Some(alone) = tables.partitions[0].singleton() {
                product *= p(alone.index());
            }
            assert_close(tables.log_likelihood(&actions_n).exp(), product, 1e-14);
        }
    }
}

#[test]
fn a_pair_outside_every_partition_in_force_is_never_read() {
    let mut tables = Tables::random_with(3, 3, all_partitions(4)[..1].to_vec());
    let actions_n = (tables.joint_actions().into_iter())
        .find(|actions_n| tables.log_likelihood(actions_n) > MASKED)
        .expect("some joint action is possible");
    let expected = (
        tables.log_likelihood(&actions_n),
        tables.gradient(&actions_n),
    );
    let columns = tables.columns(PAIRS);
    let in_force: Vec<usize> = (tables.partitions[0].pairs().iter())
        .map(|pair| pair.index())
        .collect();
    for (k, row) in tables.levels[PAIRS].chunks_mut(columns).enumerate() {
        if !in_force.contains(&k) {
            row.fill(f64::NAN);
        }
    }
    let found = (
        tables.log_likelihood(&actions_n),
        tables.gradient(&actions_n),
    );
    assert_eq!(found, expected);
}

#[test]
fn single_precision_gives_the_same_numbers_with_fewer_digits() {
    let tables = Tables::random(13, 5, 3);
    let single =
        |row: &[f64]| -> Vec<f32> { row.iter().map(|&x| mackrl::Real::from_f64(x)).collect() };
    let (selector, pair, agent) = (
        single(&tables.levels[TEAM]),
        single(&tables.levels[PAIRS]),
        single(&tables.levels[AGENTS]),
    );
    let levels = [&selector[..], &pair, &agent];
    let table = PolicyTable::new(&tables.declaration, &tables.in_force, &levels)
        .expect("as in double precision");
    let mut gradient = MarginalGradient::default();
    for actions_n in tables.joint_actions() {
        let expected = tables.log_likelihood(&actions_n);
        let log_p = log_likelihood_with_gradient(&table, &actions_n, &mut gradient);
        assert_eq!(log_p, log_likelihood(&table, &actions_n));
        if expected == MASKED {
            assert_eq!(log_p, f32::NEG_INFINITY);
            continue;
        }
        assert_close(f64::from(log_p), expected, 1e-6);
        let found = gradient.levels[AGENTS].joint_g.iter();
        for (found, expected) in found.zip(&tables.gradient(&actions_n).levels[AGENTS].joint_g) {
            assert_close(f64::from(*found), *expected, 1e-5);
        }
    }
}

/// A hierarchy and a Central-V team with the same agent controllers, and their parameters.
fn hierarchy_and_central_v(world: &[&str], delegation: &str) -> [(Team, Vec<f32>); 2] {
    let mackrl = Team::mackrl(world, &format!("hidden = 11\n{delegation}"));
    let central = Team::central_v(world, "hidden = 11");
    let parameters = mackrl.initialise();
    let agents = mackrl.places("agent_controller");
    let own = agents.iter().map(|&place| parameters[place]).collect();
    [(mackrl, parameters), (central, own)]
}

#[test]
fn the_hierarchy_that_always_delegates_is_central_v() {
    for map in ["3m", "2s3z", "matrix-game"] {
        let map = world_setting(map);
        let [(mackrl, parameters), (central, own)] =
            hierarchy_and_central_v(&[&map], r#"delegation = "always""#);
        let found = mackrl.learnable(&parameters, &keys(5));
        let expected = central.learnable(&own, &keys(5));
        assert_eq!(found.episodes, expected.episodes, "{map}");
        assert_close(found.objective, expected.objective, 1e-5);
        let agents = found.gradient_at(&mackrl.places("agent_controller"));
        let places: Vec<usize> = (0..own.len()).collect();
        let central_gradient = expected.gradient_at(&places);
        let difference: Vec<f64> = (agents.iter().zip(&central_gradient))
            .map(|(found, expected)| found - expected)
            .collect();
        let scale = norm(&central_gradient);
        assert!(scale > 0.1, "{map}: nothing was learnt, |g| = {scale}");
        assert!(norm(&difference) < 1e-5 * scale, "{map}: agents differ");
        for upper in ["pair_selector", "pair_controller"] {
            let gradient = found.gradient_at(&mackrl.places(upper));
            assert!(norm(&gradient) < 1e-5 * scale, "{map}: {upper} learns");
        }
    }
}

#[test]
fn never_delegating_two_who_see_each_other_is_a_joint_learner() {
    let world = ["env.name=matrix-game", "env.common_knowledge=1.0"];
    let team = Team::mackrl(&world, "hidden = 7\ndelegation = \"never\"");
    assert!(team.places("pair_selector").is_empty(), "one partition");
    let agents = team.places("agent_controller");
    let mut parameters = team.initialise();
    let played = team.learnable(&parameters, &keys(13));
    assert!(norm(&played.gradient_at(&agents)) == 0.0, "agents learn");
    assert!(
        norm(&played.gradient_at(&team.places("pair_controller"))) > 0.1,
        "the pair does not learn"
    );
    for place in agents {
        parameters[place] += 1.0;
    }
    let again = team.learnable(&parameters, &keys(13));
    assert_eq!(played.episodes, again.episodes);
    assert_eq!(played.objective, again.objective);
}

#[test]
fn never_delegating_without_common_knowledge_is_central_v() {
    let settings = ["env.name=matrix-game", "env.common_knowledge=0.0"];
    let [(mackrl, parameters), (central, own)] =
        hierarchy_and_central_v(&settings, r#"delegation = "never""#);
    let found = mackrl.learnable(&parameters, &keys(13));
    let expected = central.learnable(&own, &keys(13));
    assert_eq!(found.episodes, expected.episodes);
    assert_close(found.objective, expected.objective, 1e-6);
    assert!(norm(&found.gradient_at(&mackrl.places("pair_controller"))) == 0.0);
}

#[test]
fn two_agents_have_one_partition_whatever_the_schedule() {
    let play = |partitions: &str| {
        let settings = format!("hidden = 7\npartitions = {partitions:?}");
        let team = Team::mackrl(&["env.name=matrix-game"], &settings);
        let played = team.learnable(&team.initialise(), &keys(11));
        (played.episodes, played.objective, played.gradient)
    };
    let all = play("all");
    assert_eq!(all, play("round-robin"));
    assert_eq!(all, play("sampled:1"));
}
