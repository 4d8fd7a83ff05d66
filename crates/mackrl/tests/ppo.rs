//! MACKRL-PPO, MAPPO and IPPO: the same objective as the marginal's, one algorithm a special case of the other, the same bits on
//! any number of threads and after a restoration, and teams that are decentralised.

mod support;

use mackrl::{
    Error, Stopwatch,
    algorithms::{AlgorithmKind, Ippo, MackrlPpo, Mappo},
    common_knowledge::CommonKnowledgeFeatures,
    experience::PlaySettings,
    hierarchy::{FactorWorkspace, HierarchySettings, NetworkStyle, Weighing},
    partition::PartitionSchedule,
    policy::{Behaviour, Declaration, Memory, Parameters, Recording, Selection},
};
use support::{
    learner::{Run, Stored, tensors},
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
            let entropy = team.hierarchy.backward_factors(
                &parameters,
                experience,
                activations,
                (&factors, &d, 0.0),
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
        let entropy = team.hierarchy.backward_factors(
            &parameters,
            experience,
            activations,
            (&factors, &d, 1.0),
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
    let kinds: [(&dyn AlgorithmKind, &str); 6] = [
        (&MackrlPpo, "shards = 3"),
        (&MackrlPpo, "shards = 4\nminibatches = 3"),
        (&MackrlPpo, "partitions = \"all\""),
        (&MackrlPpo, "hold_steps_env = 0\ngroups = \"formed\""),
        (
            &Mappo::default(),
            "learning_rate_finish = 0.1\nschedule_steps_env = 200",
        ),
        (&Ippo::default(), ""),
    ];
    for (kind, settings) in kinds {
        let mut whole = Run::new(&world, kind, [SMALL, settings], 1);
        let mut threads = Run::new(&world, kind, [SMALL, settings], 3);
        let initial = whole.algorithm.parameters().values().to_vec();
        for _ in 0..2 {
            assert_eq!(whole.update(), threads.update());
        }
        assert_ne!(whole.algorithm.parameters().values(), initial);
        let stored = Stored(whole.algorithm.state());
        assert_eq!(threads.algorithm.state(), stored.0, "{}", kind.name());
        let mut resumed = Run::new(&world, kind, [SMALL, settings], 2);
        resumed.algorithm.restore(&stored).unwrap();
        resumed.episodes = whole.episodes;
        assert_eq!(whole.update(), resumed.update());
        assert_eq!(whole.algorithm.state(), resumed.algorithm.state());
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
    ] {
        let mut run = Run::new(&world, &MackrlPpo, [SMALL, settings], 1);
        run.update();
        run.assert_decentralised(&world, 0.0);
    }
}
