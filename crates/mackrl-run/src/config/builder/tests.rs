use mackrl_env::matrix_game::Payoffs;
use proptest::prelude::*;

use super::*;
use crate::config::{Algorithm, CommonKnowledgeFeatures, OptimiserKind, PartitionChoice};

fn file(text: &str) -> Result<ConfigBuilder, ConfigError> {
    ConfigBuilder::new().file("run.toml", text)
}

fn message(result: Result<impl std::fmt::Debug, ConfigError>) -> String {
    result.unwrap_err().to_string()
}

#[test]
fn later_layers_win_over_earlier_ones() {
    let builder = ConfigBuilder::new()
        .preset("paper-code")
        .unwrap()
        .file(
            "run.toml",
            "[learner]\noptimiser = \"adam\"\nlambda = 0.7\n",
        )
        .unwrap()
        .set("learner.lambda=0.6")
        .unwrap();
    let config = builder.build().unwrap();
    assert_eq!(
        config.policy.common_knowledge,
        CommonKnowledgeFeatures::Thin
    );
    assert_eq!(config.learner.optimiser, OptimiserKind::Adam);
    assert_eq!(config.learner.lambda, 0.6);
    assert_eq!(
        builder.origin("learner.optimiser").to_string(),
        "run.toml:2:13"
    );
    assert_eq!(
        builder.origin("learner.lambda").to_string(),
        "--set learner.lambda=0.6"
    );
}

#[test]
fn an_unknown_key_is_named_with_its_place_and_its_neighbour() {
    assert_eq!(
        message(file("[learner]\ngamma = 0.9\ngama = 0.9\n")),
        "run.toml:3:1: unknown key `learner.gama`, did you mean `learner.gamma`?"
    );
    assert_eq!(
        message(ConfigBuilder::new().set("gamma=0.9")),
        "--set gamma=0.9: unknown key `gamma`, did you mean `learner.gamma`?"
    );
    assert_eq!(
        message(file("colour = 3")),
        "run.toml:1:1: unknown key `colour`"
    );
    assert_eq!(
        message(file("[learner.gamma]\nstart = 0.9")),
        "run.toml:2:1: unknown key `learner.gamma.start`, did you mean `exploration.start`?"
    );
}

#[test]
fn a_wrong_type_is_named_with_its_place_and_what_was_expected() {
    assert_eq!(
        message(file("[learner]\ngamma = \"high\"\n")),
        "run.toml:2:9: `learner.gamma` is \"high\", expected a number in [0, 1]"
    );
    assert_eq!(
        message(file("learner = 3\n")),
        "run.toml:1:11: `learner` is 3, expected a table of settings"
    );
    assert_eq!(
        message(file("[policy]\nalgorithm = \"qmix\"\n")),
        "run.toml:2:13: `policy.algorithm` is \"qmix\", expected `mackrl` or `central-v`"
    );
    assert_eq!(
        message(ConfigBuilder::new().set("run.seed=-1")),
        "--set run.seed=-1: `run.seed` is -1, expected an integer in [0, 2^53]"
    );
}

#[test]
fn a_value_out_of_range_is_named_with_its_place() {
    let built = |text: &str| file(text).unwrap().build();
    assert_eq!(
        message(built("[learner]\ngamma = 1.5\n")),
        "run.toml:2:9: `learner.gamma` is 1.5, expected a number in [0, 1]"
    );
    assert_eq!(
        message(built("learner.learning_rate = nan")),
        "run.toml:1:25: `learner.learning_rate` is nan, expected a number in (0, 1]"
    );
    assert_eq!(
        message(built("exploration.finish = 0.9")),
        "run.toml:1:22: `exploration.finish` is 0.9, expected at most 0.5, which is exploration.start"
    );
}

#[test]
fn a_file_that_is_not_toml_is_named_with_line_and_column() {
    assert!(message(file("[learner]\ngamma 0.9\n")).starts_with("run.toml:2:7: "));
    assert_eq!(
        message(ConfigBuilder::new().set("learner.gamma")),
        "--set learner.gamma: expected key=value"
    );
}

#[test]
fn a_short_flag_is_named_as_it_was_typed() {
    assert_eq!(
        message(
            ConfigBuilder::new()
                .flag("--steps 0", "run.steps_env=0")
                .unwrap()
                .build()
        ),
        "--steps 0: `run.steps_env` is 0, expected an integer in [1, 2^53]"
    );
}

#[test]
fn a_preset_that_is_not_shipped_names_its_neighbour() {
    assert_eq!(
        message(ConfigBuilder::new().preset("papers")),
        "unknown preset `papers`, expected default, paper, paper-code, did you mean `paper`?"
    );
}

#[test]
fn settings_of_the_map_reach_it() {
    let config = ConfigBuilder::new()
        .set("env.move_amount=5")
        .unwrap()
        .build()
        .unwrap();
    assert_eq!(config.env.settings.move_amount, 5.0);
    let config = ConfigBuilder::new()
        .set("env.matrix_game.common_knowledge=0.25")
        .unwrap()
        .set("env.matrix_game.payoffs=printed")
        .unwrap()
        .build()
        .unwrap();
    assert_eq!(config.env.matrix_game.common_knowledge, 0.25);
    assert_eq!(config.env.matrix_game.payoffs, Payoffs::Printed);
    assert_eq!(
        message(
            ConfigBuilder::new()
                .set("env.matrix_game.common_knowledge=1.5")
                .unwrap()
                .build()
        ),
        "--set env.matrix_game.common_knowledge=1.5: `env.matrix_game.common_knowledge` is 1.5, expected a number in [0, 1]"
    );
}

#[test]
fn a_setting_of_the_map_that_is_wrong_is_named_like_any_other() {
    assert_eq!(
        message(ConfigBuilder::new().set("env.move_amont=5")),
        "--set env.move_amont=5: unknown key `env.move_amont`, did you mean `env.move_amount`?"
    );
    assert_eq!(
        message(file("[env]\nmove_amount = \"far\"\n")),
        "run.toml:2:15: `env.move_amount` is \"far\", expected a number in (0, 32]"
    );
    assert_eq!(
        message(file("[env]\nmove_amount = 99.0\n").unwrap().build()),
        "run.toml:2:15: `env.move_amount` is 99.0, expected a number in (0, 32]"
    );
    assert_eq!(
        message(ConfigBuilder::new().set("env.units=paper")),
        "--set env.units=paper: `env.units` is \"paper\", expected `liberty` or `lotv`"
    );
    assert_eq!(
        message(file("[env]\nshoot_range = 9.0\n").unwrap().build()),
        "run.toml:2:15: `env.shoot_range` is 9.0, expected less than 9.0, which is env.sight_range: agents can only aim at what they see"
    );
    assert_eq!(
        message(
            ConfigBuilder::new()
                .set("env.sight_range=6.0")
                .unwrap()
                .build()
        ),
        "--set env.sight_range=6.0: `env.sight_range` is 6.0, expected more than 6.0, which is env.shoot_range: agents can only aim at what they see",
        "the value that was written later is named"
    );
}

#[test]
fn a_team_without_the_partitions_that_are_asked_for_is_named_with_its_place() {
    let large = file("[env]\nmap = \"27m_vs_30m\"\n[policy]\npartitions = \"all\"\n").unwrap();
    assert_eq!(
        message(large.build()),
        "run.toml:4:14: `policy.partitions` is \"all\", expected `round-robin` or `sampled:K` for the 27 agents of 27m_vs_30m"
    );
    assert_eq!(
        large.build_environment().unwrap().map,
        "27m_vs_30m",
        "the world alone can be had"
    );
    large
        .set("policy.algorithm=central-v")
        .unwrap()
        .build()
        .unwrap();
}

#[test]
fn an_unknown_map_is_named_with_its_place_and_its_neighbour() {
    assert_eq!(
        message(file("env.map = \"2s3x\"").unwrap().build()),
        "run.toml:1:11: unknown map `2s3x`, did you mean `2s3z`?"
    );
}

/// Choices that every team has.
fn choice() -> impl Strategy<Value = PartitionChoice> {
    prop_oneof![
        Just(PartitionChoice::RoundRobin),
        Just(PartitionChoice::Sampled(1)),
    ]
}

prop_compose! {
    fn any_config()(
        (gamma, lambda, rate, critic_rate) in (0.0..=1.0f64, 0.0..=1.0f64, 1e-9..=1.0f64, 1e-9..=1.0f64),
        (start, share) in (0.0..=1.0f64, 0.0..=1.0f64),
        (steps_env, seed) in (1u64..=1 << 53, 0u64..=1 << 53),
        (partitions, thin, central_v, rmsprop) in (choice(), any::<bool>(), any::<bool>(), any::<bool>()),
        map in prop::sample::select(mackrl_skirmish::map_names()),
        move_amount in 0.1f32..=32.0,
    ) -> Config {
        let mut config = Config::default();
        config.learner.gamma = gamma;
        config.learner.lambda = lambda;
        config.learner.learning_rate = rate;
        config.learner.critic_learning_rate = critic_rate;
        config.exploration.start = start;
        config.exploration.finish = start * share;
        config.run.steps_env = steps_env;
        config.run.seed = seed;
        config.policy.partitions = partitions;
        if thin { config.policy.common_knowledge = CommonKnowledgeFeatures::Thin; }
        if central_v { config.policy.algorithm = Algorithm::CentralV; }
        if rmsprop { config.learner.optimiser = OptimiserKind::Rmsprop; }
        config.env.map = map.to_owned();
        config.env.settings.move_amount = move_amount;
        config
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn a_configuration_is_read_as_it_was_written(config in any_config()) {
        prop_assert_eq!(config.validate(), Ok(()));
        let read = file(&config.to_toml()).unwrap().build().unwrap();
        prop_assert_eq!(read, config);
    }

    #[test]
    fn no_text_makes_reading_panic(text in "[a-z=.\\[\\]0-9\" \n]{0,60}") {
        if let Ok(builder) = file(&text) {
            let _ = builder.build();
        }
        if let Ok(builder) = ConfigBuilder::new().set(&text) {
            let _ = builder.build();
        }
    }
}

#[test]
fn large_teams_take_turns_unless_something_else_is_asked_for() {
    let partitions = |settings: &[&str]| {
        let builder = ConfigBuilder::new().preset("paper").unwrap();
        let builder = (settings.iter()).try_fold(builder, |builder, setting| builder.set(setting));
        let builder = builder.unwrap();
        let origin = builder.origin("policy.partitions").to_string();
        (builder.build().unwrap().policy.partitions, origin)
    };
    let (large, origin) = partitions(&["env.map=27m_vs_30m"]);
    assert_eq!(large, PartitionChoice::RoundRobin);
    assert!(origin.starts_with("automatic: "), "{origin}");
    let (small, origin) = partitions(&["env.map=8m"]);
    assert_eq!(small, PartitionChoice::All);
    assert!(origin.starts_with("preset paper:"), "{origin}");
    let asked = partitions(&["env.map=10m_vs_11m", "policy.partitions=sampled:5"]).0;
    assert_eq!(asked, PartitionChoice::Sampled(5));
    let too_many = ConfigBuilder::new()
        .set("env.map=10m_vs_11m")
        .and_then(|builder| builder.set("policy.partitions=all"))
        .unwrap();
    assert!(
        too_many.build().is_err(),
        "whoever asks for all is told why not"
    );
}

#[test]
fn numbers_of_single_precision_read_as_they_are_written() {
    let scatter = Config::default().get("env.spawn_scatter");
    assert_eq!(scatter, Some(toml::Value::Float(0.02)));
    let set = ConfigBuilder::new().set("env.spawn_scatter=0.3").unwrap();
    assert_eq!(set.build().unwrap().env.settings.spawn_scatter, 0.3);
}
