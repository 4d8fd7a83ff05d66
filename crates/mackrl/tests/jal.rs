//! One controller of the whole team: what it computes, where it is refused, and that its agents need no messages.

mod support;

use mackrl::{
    Error,
    algorithms::{AlgorithmKind, Jal},
    common_knowledge::CommonKnowledgeFeatures,
    experience::PlaySettings,
    hierarchy::{HierarchySettings, NetworkStyle},
    policy::{Behaviour, Declaration, Recording},
};
use mackrl_env::{EpisodeKey, Stream};
use mackrl_run::{
    config::{Config, ConfigBuilder, registry},
    training::{Trainer, evaluate},
};
use support::{
    learner::{Run, assert_repeats},
    team::{Team, keys, norm, world},
};

const SMALL: &str = "hidden = 5\nenvironments = 4\n";

/// Battles in which everybody sees everything.
const OPEN: [&str; 2] = ["env.map=3m", "env.sight_range=64"];

fn team(settings: &[&str]) -> Team {
    let world = world(settings);
    let declaration = Declaration::whole_team([world.spec().agents, world.spec().actions]);
    let networks = HierarchySettings {
        common_knowledge: CommonKnowledgeFeatures::Complete,
        hidden: 5,
        networks: NetworkStyle::Plain,
    };
    Team::declared(world, declaration.expect("a small team"), networks)
}

/// Plays whole battles and compares log p(u) of every step, and its gradient, with the softmax of one table and with differences.
#[test]
fn the_joint_action_has_one_controller_until_nobody_lives() {
    let team = team(&OPEN);
    let parameters = team.initialise();
    let played = team.learnable(&parameters, &keys(3));
    let statistic = team.world.spec().statistic("dead_allies");
    let dead = statistic.expect("a statistic of battles");
    let deaths = played.episodes.iter().map(|e| e.statistics_s[dead]);
    assert!(deaths.sum::<f64>() >= 3.0, "hardly anybody dies");
    let shares = |t: usize| played.episodes[0].alive_t[t].len();
    assert!((0..played.episodes[0].steps()).any(|t| shares(t) == 2));
    let places = team.places("team_controller");
    assert_eq!(places.len(), parameters.len(), "nothing else learns");
    let gradient = played.gradient_at(&places);
    let length = norm(&gradient);
    assert!(length > 0.05, "hardly a gradient: {length}");
    let slope = |h: f64| {
        let [above, below] = [h, -h].map(|h| {
            let moved = parameters.iter().zip(&gradient);
            let moved = moved.map(|(&p, g)| mackrl::Real::from_f64(f64::from(p) + h * g / length));
            let moved: Vec<f32> = moved.collect();
            team.objective_of(&parameters, &keys(3), &moved)
        });
        (above - below) / (2.0 * h)
    };
    let slope = (4.0 * slope(5e-3) - slope(1e-2)) / 3.0;
    assert!((slope / length - 1.0).abs() < 0.01, "{slope} {length}");
}

#[test]
fn agents_on_their_own_play_what_the_team_plays_and_all_that_is_reported_is_explained() {
    for settings in [
        &OPEN[..],
        &["env.name=matrix-game", "env.common_knowledge=1"],
        &["env.name=sanity-coordinate", "env.common=1"],
    ] {
        let world = world(settings);
        let mut run = Run::new(&world, &Jal, [SMALL, ""], 1);
        run.assert_explained();
        run.assert_decentralised(&world, 0.3);
    }
}

#[test]
fn a_run_has_the_same_bits_on_any_number_of_threads_and_after_a_restoration() {
    let world = world(&OPEN);
    assert_repeats(&world, &Jal, [SMALL, "shards = 3"]);
}

#[test]
fn worlds_in_which_the_team_does_not_always_see_itself_are_refused_at_that_step() {
    for (settings, step) in [
        (
            &["env.name=matrix-game"][..],
            "at step 0 of an episode of matrix-game the 2",
        ),
        (
            &["env.map=3m", "env.sight_range=7"],
            "living agents do not all see each other",
        ),
    ] {
        let world = world(settings);
        let mut run = Run::new(&world, &Jal, [SMALL, ""], 1);
        let settings = PlaySettings {
            behaviour: Behaviour::sampled(1.0),
            recording: Recording::Off,
        };
        let parameters = run.algorithm.parameters();
        let refused = (0..20).find_map(|first| {
            let keys = [0, 1, 2, 3].map(|i| EpisodeKey::new(1, Stream::Training, 4 * first + i));
            run.collector.play(parameters, &keys, settings).err()
        });
        let refused = refused.expect("a step at which they do not");
        assert!(matches!(refused, Error::Config(_)), "{refused:?}");
        let message = refused.to_string();
        assert!(message.contains(step), "{message}");
        assert!(message.contains("expected a world in which they always do"));
    }
}

#[test]
fn teams_with_too_many_joint_actions_are_refused_with_their_number() {
    let refused = Config::with(&["algorithm.name=jal", "env.map=2s3z"]).unwrap_err();
    let message = refused.to_string();
    for part in ["algorithm.name", "11^5 joint actions", "at most 4096"] {
        assert!(message.contains(part), "{message}");
    }
    let large = world(&["env.map=2s3z"]);
    assert!(Jal.check(&Jal.defaults(), large.spec()).is_err());
}

#[test]
fn a_team_learns_to_act_jointly_on_what_it_commonly_knows() {
    for (world, statistic) in [
        (["env.name=sanity-coordinate", "env.common=1"], "success"),
        (
            ["env.name=matrix-game", "env.common_knowledge=1"],
            "best_payoff",
        ),
    ] {
        let settings = [
            "algorithm.name=jal",
            "algorithm.environments=32",
            "algorithm.learning_rate=0.002",
            "algorithm.critic_learning_rate=0.005",
            "algorithm.exploration_steps_env=10000",
            "run.steps_env=25000",
            "test.interval_steps_env=25000",
        ];
        let config = world
            .iter()
            .chain(&settings)
            .fold(ConfigBuilder::new(registry()), |builder, setting| {
                builder.set(setting).expect("a known setting")
            });
        let config = config.build().expect("settings within their ranges");
        let mut trainer = Trainer::new(&config, 2).expect("a run that can begin");
        while !trainer.finished() {
            trainer.update().expect("finite gradients");
        }
        let found = evaluate(&config, &trainer.weights(), 400, 1, 2).expect("its own weights");
        let reached = found.mean(statistic).expect("a statistic of this world");
        assert!(reached >= 0.95, "{}: {reached}", world[0]);
    }
}
