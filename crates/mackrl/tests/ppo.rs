//! MACKRL-PPO, MAPPO and IPPO: the same objective as the marginal's, one algorithm a special case of the other, the same bits on
//! any number of threads and after a restoration, and teams that are decentralised.

mod support;

use mackrl::{
    Error, Real, Stopwatch,
    algorithms::{
        Algorithm, AlgorithmKind, Ippo, MackrlPpo, Mappo, Ppo, PpoSettings, Sight, Weighed,
    },
    common_knowledge::CommonKnowledgeFeatures,
    experience::{Piece, PlaySettings},
    hierarchy::{Factor, FactorTerm, FactorWorkspace, HierarchySettings, NetworkStyle, Weighing},
    partition::PartitionSchedule,
    policy::{Behaviour, Declaration, Memory, Parameters, Recording, Selection},
};
use support::{
    learner::{Run, Stored, assert_repeats, tensors},
    team::{Team, keys, world},
};

const SMALL: &str = "hidden = 5\ncritic_hidden = 7\nenvironments = 4\nepochs = 2\n";

fn round_robin(map: &str, hold: usize, memory: Memory) -> Team {
    let world = world(&[map]);
    let declaration = Declaration::pairwise(
        [world.spec().agents, world.spec().actions],
        PartitionSchedule::RoundRobin,
        Selection::Learned,
        Default::default(),
        1,
    );
    let declaration = declaration
        .expect("a small team")
        .with_partitions_held(hold, memory)
        .with_delegation_logit(1.0);
    let settings = HierarchySettings {
        common_knowledge: CommonKnowledgeFeatures::Complete,
        hidden: 5,
        networks: NetworkStyle::Normalised { gain: 1.0 },
    };
    Team::declared(world, declaration, settings)
}

/// `Σ_g log q_g` is the log p(u) that acting recorded, and where all groups of a step weigh alike the gradient is the marginal's,
/// of which exploration is a part.
#[test]
fn groups_together_are_the_marginal_of_the_team() {
    for (hold, memory, exploration) in [
        (1, Memory::WhileFormed, 0.0),
        (4, Memory::WhileFormed, 0.0),
        (1, Memory::Episode, 0.0),
        (1, Memory::WhileFormed, 0.3),
    ] {
        let team = round_robin("env.map=2s3z", hold, memory);
        let parameters = Parameters::new(team.initialise());
        let mut collector = team.collector(2, 1);
        let play = PlaySettings {
            behaviour: Behaviour::sampled(exploration),
            recording: Recording::ForLearning,
        };
        collector.play(&parameters, &keys(2), play).unwrap();
        let piece = collector.pieces().next().unwrap();
        let weights = support::team::weights(&piece.experience.episodes);
        let recorded: Vec<Vec<f32>> = (piece.experience.episodes.iter())
            .map(|episode| episode.log_p_t.clone())
            .collect();

        let mut expected = vec![0.0; parameters.values().len()];
        let (experience, activations) = team.hierarchy.evaluate(&parameters, piece).unwrap();
        team.hierarchy.backward(
            &parameters,
            experience,
            activations,
            &weights,
            &mut expected,
        );

        for weighing in [Weighing::Choosing, Weighing::Formed] {
            let (experience, activations) = team.hierarchy.networks(&parameters, piece).unwrap();
            let factors = team.hierarchy.factors(experience, weighing);
            assert!(
                factors.iter().any(|factor| factor.second.is_some()),
                "no pair"
            );
            let mut log_q = Vec::new();
            team.hierarchy.log_q(activations, &factors, &mut log_q);
            let mut sums: Vec<Vec<f64>> = recorded.iter().map(|t| vec![0.0; t.len()]).collect();
            for (factor, &log_q) in factors.iter().zip(&log_q) {
                sums[factor.episode][factor.step] += f64::from(log_q);
            }
            for (sum, &log_p) in sums.iter().flatten().zip(recorded.iter().flatten()) {
                assert!((sum - f64::from(log_p)).abs() < 1e-4, "{sum} {log_p}");
            }
            let d: Vec<f32> = (factors.iter())
                .map(|factor| weights[factor.episode][factor.step])
                .collect();
            let mut gradient = vec![0.0; parameters.values().len()];
            let term = FactorTerm {
                factors: &factors,
                d_log_q_i: &d,
                entropy_weight: (exploration == 0.0).then_some(0.0),
            };
            let entropy = team.hierarchy.backward_factors(
                &parameters,
                experience,
                activations,
                &[term],
                &mut FactorWorkspace::default(),
                &mut gradient,
            );
            assert_eq!(entropy > 0.0, exploration == 0.0);
            let largest = expected.iter().fold(0.0_f32, |most, x| most.max(x.abs()));
            for (found, expected) in gradient.iter().zip(&expected) {
                assert!(
                    (found - expected).abs() < 1e-4 * largest,
                    "{found} {expected}"
                );
            }
        }
    }
}

/// The entropy's part of the gradient, against differences of Σ H(q) over the parameters' largest slopes.
#[test]
fn the_gradient_of_the_entropy_is_that_of_the_networks() {
    let team = round_robin("env.map=3m", 1, Memory::WhileFormed);
    let initial = team.initialise();
    let parameters = Parameters::new(initial.clone());
    let mut collector = team.collector(1, 1);
    let play = PlaySettings {
        behaviour: Behaviour::sampled(0.0),
        recording: Recording::ForLearning,
    };
    collector.play(&parameters, &keys(1), play).unwrap();
    let piece = collector.pieces().next().unwrap();
    let mut run = |values: &[f32]| {
        let parameters = Parameters::new(values.to_vec());
        let (experience, activations) = team.hierarchy.networks(&parameters, piece).unwrap();
        let factors = team.hierarchy.factors(experience, Weighing::Choosing);
        let d = vec![0.0; factors.len()];
        let mut gradient = vec![0.0; values.len()];
        let term = FactorTerm {
            factors: &factors,
            d_log_q_i: &d,
            entropy_weight: Some(1.0),
        };
        let entropy = team.hierarchy.backward_factors(
            &parameters,
            experience,
            activations,
            &[term],
            &mut FactorWorkspace::default(),
            &mut gradient,
        );
        (entropy, gradient)
    };
    let (_, gradient) = run(&initial);
    let mut order: Vec<usize> = (0..gradient.len()).collect();
    order.sort_by(|a, b| gradient[*b].abs().total_cmp(&gradient[*a].abs()));
    for &place in &order[..20] {
        let [above, below] = [3e-3, -3e-3].map(|step: f32| {
            let mut moved = initial.clone();
            moved[place] += step;
            run(&moved).0
        });
        let slope = (above - below) / 6e-3;
        let found = f64::from(gradient[place]);
        assert!(
            (found - slope).abs() < 0.01 * slope.abs(),
            "{place}: {found} {slope}"
        );
    }
}

/// What the private loss adds to the gradient, against the formula: with values of 0 and without discounting what comes later, an
/// advantage is the reward, normalised over living agents.
#[test]
fn the_private_loss_trains_agents_as_if_their_pairs_had_delegated() {
    let team = round_robin("env.map=3m", 1, Memory::WhileFormed);
    let prior = team.world.prior();
    let settings = PpoSettings {
        critic_hidden: 3,
        gamma: 0.0,
        epochs: 1,
        environments: 4,
        shards: 1,
        ..PpoSettings::default()
    };
    let mut collector = team.collector(4, 1);
    let mut gradient_with = |private: f64| {
        let own = mackrl::algorithms::Team {
            spec: team.world.spec(),
            prior: &prior,
            seed: 1,
            threads: 1,
        };
        let weighed = Weighed {
            private,
            ..Weighed::default()
        };
        let hierarchy = team.hierarchy.clone();
        let mut learner = Ppo::new(hierarchy, settings.clone(), weighed, Sight::State, own);
        let mut state = learner.state();
        for (layout, values) in &mut state.tensors {
            if layout.tensors()[0].name.starts_with("critic.") {
                values.fill(0.0);
            }
        }
        learner.restore(&Stored(state)).unwrap();
        let parameters = Parameters::new(learner.parameters().values().to_vec());
        let play = PlaySettings {
            behaviour: Behaviour::sampled(0.0),
            recording: Recording::ForLearning,
        };
        collector.play(&parameters, &keys(4), play).unwrap();
        let mut batch: Vec<_> = collector.pieces().collect();
        let learnt = learner.learn(&mut batch, &mut Stopwatch::default());
        learnt.unwrap();
        let piece = collector.pieces().next().unwrap();
        let expected = literal_private_gradient(&team, &parameters, piece);
        (learner.gradient().to_vec(), expected)
    };
    let (without, expected) = gradient_with(0.0);
    let (with, _) = gradient_with(0.5);
    let largest = expected.iter().fold(0.0_f32, |most, x| most.max(x.abs()));
    assert!(largest > 0.0);
    for ((with, without), expected) in with.iter().zip(&without).zip(&expected) {
        let found = with - without;
        assert!(
            (found - 0.5 * expected).abs() < 1e-4 * largest,
            "{found} {expected}"
        );
    }
}

/// `−1/choices Σ π_a π_b / q · A (∇ log π_a + ∇ log π_b)` over the pairs that could act jointly, A being the normalised reward.
fn literal_private_gradient(team: &Team, parameters: &Parameters, piece: &mut Piece) -> Vec<f32> {
    let mut choices = Vec::new();
    for episode in &piece.experience.episodes {
        for (reward, alive) in episode.reward_t.iter().zip(&episode.alive_t) {
            choices.extend(alive.iter().map(|_| f64::from(*reward)));
        }
    }
    let count = choices.len() as f64;
    let mean = choices.iter().sum::<f64>() / count;
    let variance = choices.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
    let networks = team.hierarchy.networks(parameters, piece);
    let (experience, activations) = networks.expect("a piece of this team");
    let mut factors = Vec::new();
    let mut d = Vec::new();
    for factor in team.hierarchy.factors(experience, Weighing::Choosing) {
        let Some(members) = factor.apart() else {
            continue;
        };
        let log_q = |factors: &[Factor]| {
            let mut log_q = Vec::new();
            team.hierarchy.log_q(activations, factors, &mut log_q);
            log_q.iter().map(|x| f64::from(*x)).sum::<f64>()
        };
        let ratio = (log_q(&members) - log_q(&[factor])).exp();
        let reward = f64::from(experience.episodes[factor.episode].reward_t[factor.step]);
        let advantage = (reward - mean) / (variance.sqrt() + 1e-5);
        for member in members {
            factors.push(member);
            d.push(f32::from_f64(-ratio * advantage / count));
        }
    }
    let term = FactorTerm {
        factors: &factors,
        d_log_q_i: &d,
        entropy_weight: None,
    };
    let mut gradient = vec![0.0; parameters.values().len()];
    team.hierarchy.backward_factors(
        parameters,
        experience,
        activations,
        &[term],
        &mut FactorWorkspace::default(),
        &mut gradient,
    );
    gradient
}

#[test]
fn mackrl_ppo_that_always_delegates_is_mappo_to_the_bit() {
    let world = world(&["env.map=2s3z"]);
    let mut mappo = Run::new(&world, &Mappo::default(), [SMALL, ""], 1);
    let mut mackrl = Run::new(&world, &MackrlPpo, [SMALL, "delegation = \"always\""], 1);
    mackrl.share(&mappo);
    for update in 0..3 {
        mappo.update();
        mackrl.update();
        let states = [&mappo, &mackrl].map(|run| run.algorithm.state());
        for name in [
            "agent_controller",
            "critic.",
            "opt.adam.m.agent",
            "critic_scale",
        ] {
            let [a, b] = states.each_ref().map(|state| tensors(state, name));
            assert!(!a.is_empty() && a == b, "{name} after update {update}");
        }
    }
}

/// A second minibatch is weighed against what acted, not against what the first one made of it.
#[test]
fn ratios_are_those_to_what_acted() {
    let world = world(&["env.map=3m"]);
    for partitions in ["round-robin", "all"] {
        let divergence = |minibatches: usize| {
            let settings =
                format!("partitions = \"{partitions}\"\nepochs = 1\nminibatches = {minibatches}");
            let tally = Run::new(&world, &MackrlPpo, [SMALL, &settings], 1).update();
            let mut means = tally.means();
            let divergence = means.find(|(name, _)| *name == "divergence");
            divergence.expect("a metric of the learner").1
        };
        assert_eq!(divergence(1), 0.0, "{partitions}");
        assert!(divergence(2) > 0.0, "{partitions}");
    }
}

#[test]
fn a_run_has_the_same_bits_on_any_number_of_threads_and_after_a_restoration() {
    let world = world(&["env.map=3m"]);
    let kinds: [(&dyn AlgorithmKind, &str); 8] = [
        (&MackrlPpo, "shards = 3"),
        (&MackrlPpo, "shards = 4\nminibatches = 3"),
        (&MackrlPpo, "partitions = \"all\""),
        (&MackrlPpo, "levels = \"fours\""),
        (&MackrlPpo, "private_weight = 0.5"),
        (&MackrlPpo, "hold_steps_env = 0\ngroups = \"formed\""),
        (
            &Mappo::default(),
            "learning_rate_finish = 0.1\nschedule_steps_env = 200",
        ),
        (&Ippo::default(), ""),
    ];
    for (kind, settings) in kinds {
        assert_repeats(&world, kind, [SMALL, settings]);
    }
}

#[test]
fn every_metric_that_is_reported_is_explained() {
    let world = world(&["env.map=3m"]);
    let kinds: [(&dyn AlgorithmKind, &str); 3] = [
        (&MackrlPpo, ""),
        (&MackrlPpo, "partitions = \"all\""),
        (&Ippo::default(), ""),
    ];
    for (kind, settings) in kinds {
        let mut run = Run::new(&world, kind, [SMALL, settings], 1);
        run.assert_explained();
    }
}

#[test]
fn experience_that_is_not_finite_is_refused() {
    let world = world(&["env.map=3m"]);
    let mut run = Run::new(&world, &MackrlPpo, [SMALL, ""], 1);
    run.update();
    let piece = run.collector.pieces().next().unwrap();
    piece.experience.episodes[1].reward_t[2] = f32::NAN;
    let mut batch: Vec<_> = run.collector.pieces().collect();
    let refused = run.algorithm.learn(&mut batch, &mut Stopwatch::default());
    assert!(matches!(refused, Err(Error::NotFinite(_))), "{refused:?}");
}

#[test]
fn agents_on_their_own_play_what_a_trained_team_plays() {
    let world = world(&["env.map=2s3z"]);
    for settings in [
        "",
        "hold_steps_env = 3",
        "hold_steps_env = 0",
        "pair_memory = \"episode\"",
        "levels = \"fours\"",
    ] {
        let mut run = Run::new(&world, &MackrlPpo, [SMALL, settings], 1);
        run.update();
        run.assert_decentralised(&world, 0.0);
    }
}
