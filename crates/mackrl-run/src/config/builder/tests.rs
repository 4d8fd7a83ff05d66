use mackrl::algorithms::CentralV;
use mackrl_env::matrix_game::{Payoffs, payoff_text};
use mackrl_skirmish::SKIRMISH;
use proptest::prelude::*;

use super::*;
use crate::config::{AlgorithmConfig, STAR_CRAFT};

fn preset_with(name: &str, settings: &[&str]) -> ConfigBuilder {
    let preset = builder().preset(name).unwrap();
    let mut settings = settings.iter();
    (settings.try_fold(preset, |builder, setting| builder.set(setting))).unwrap()
}

fn builder() -> ConfigBuilder {
    ConfigBuilder::new(&Registry::built_in())
}

fn file(text: &str) -> Result<ConfigBuilder, ConfigError> {
    builder().file("run.toml", text)
}

/// What is said of these layers.
fn message(layers: Result<ConfigBuilder, ConfigError>) -> String {
    let built = layers.and_then(|builder| builder.build());
    built.unwrap_err().to_string()
}

fn float(value: f64) -> Option<toml::Value> {
    Some(toml::Value::Float(value))
}

fn text_value(value: &str) -> Option<toml::Value> {
    Some(value.into())
}

#[test]
fn later_layers_win_over_earlier_ones() {
    let builder = builder()
        .preset("paper-code")
        .unwrap()
        .file(
            "run.toml",
            "[algorithm]\noptimiser = \"adam\"\nlambda = 0.7\n",
        )
        .unwrap()
        .set("algorithm.lambda=0.6")
        .unwrap();
    let resolved = builder.resolve().unwrap();
    let config = resolved.config();
    assert_eq!(config.get("algorithm.common_knowledge"), text_value("thin"));
    assert_eq!(config.get("algorithm.optimiser"), text_value("adam"));
    assert_eq!(config.get("algorithm.lambda"), float(0.6));
    assert_eq!(
        resolved.origin("algorithm.optimiser").to_string(),
        "run.toml:2:13"
    );
    assert_eq!(
        resolved.origin("algorithm.lambda").to_string(),
        "--set algorithm.lambda=0.6"
    );
}

#[test]
fn an_unknown_key_is_named_with_its_place_and_its_neighbour() {
    assert_eq!(
        message(file("[algorithm]\ngamma = 0.9\ngama = 0.9\n")),
        "run.toml:3:1: unknown key `algorithm.gama`, did you mean `algorithm.gamma`?"
    );
    assert_eq!(
        message(builder().set("gamma=0.9")),
        "--set gamma=0.9: unknown key `gamma`, did you mean `algorithm.gamma`?"
    );
    assert_eq!(
        message(file("colour = 3")),
        "run.toml:1:1: unknown key `colour`"
    );
    assert_eq!(
        message(file("[algorithm.gamma]\nstart = 0.9")),
        "run.toml:2:1: unknown key `algorithm.gamma.start`, did you mean `algorithm.gamma`?"
    );
}

#[test]
fn a_wrong_type_is_named_with_its_place_and_what_was_expected() {
    assert_eq!(
        message(file("[algorithm]\ngamma = \"high\"\n")),
        "run.toml:2:9: `algorithm.gamma` is \"high\", expected a number in [0, 1]"
    );
    assert_eq!(
        message(file("algorithm = 3\n")),
        "run.toml:1:13: `algorithm` is 3, expected a table of settings"
    );
    assert_eq!(
        message(file("[algorithm]\nname = \"maddpg\"\n")),
        "run.toml:2:8: `algorithm.name` is \"maddpg\", expected `mackrl`, `central-v`, `jal`, `mackrl-ppo`, `mappo`, `ippo`, `iql`, `vdn`, `qmix`, `iac`, `coma` or `mackrl-coma`"
    );
    assert_eq!(
        message(builder().set("run.seed=-1")),
        "--set run.seed=-1: `run.seed` is -1, expected an integer in [0, 2^53]"
    );
}

#[test]
fn a_value_out_of_range_is_named_with_its_place() {
    assert_eq!(
        message(file("[algorithm]\ngamma = 1.5\n")),
        "run.toml:2:9: `algorithm.gamma` is 1.5, expected a number in [0, 1]"
    );
    assert_eq!(
        message(file("algorithm.learning_rate = nan")),
        "run.toml:1:27: `algorithm.learning_rate` is nan, expected a number in (0, 1]"
    );
    assert_eq!(
        message(file(
            "algorithm.name = \"mackrl\"\nalgorithm.exploration_finish = 0.9"
        )),
        "run.toml:2:32: `algorithm.exploration_finish` is 0.9, expected at most 0.5, which is algorithm.exploration_start"
    );
}

#[test]
fn a_file_that_is_not_toml_is_named_with_line_and_column() {
    assert!(message(file("[algorithm]\ngamma 0.9\n")).starts_with("run.toml:2:7: "));
    assert_eq!(
        message(builder().set("algorithm.gamma")),
        "--set algorithm.gamma: expected key=value"
    );
}

#[test]
fn a_short_flag_is_named_as_it_was_typed() {
    assert_eq!(
        message(builder().flag("--steps 0", "run.steps_env=0")),
        "--steps 0: `run.steps_env` is 0, expected an integer in [1, 2^53]"
    );
}

#[test]
fn a_preset_that_is_not_shipped_names_its_neighbour() {
    assert_eq!(
        message(builder().preset("papers")),
        "unknown preset `papers`, expected default, fours, paper, paper-code, paper-figures, pymarl-iql, pymarl-vdn, pymarl-qmix, pymarl2-qmix, pymarl-coma, did you mean `paper`?"
    );
}

#[test]
fn settings_of_the_map_reach_it() {
    let config = Config::with(&["env.move_amount=5"]).unwrap();
    let (_, settings) = config.env.skirmish_settings().unwrap();
    assert_eq!(settings.move_amount, 5.0);
    let config = Config::with(&[
        "env.name=matrix-game",
        "env.common_knowledge=0.25",
        "env.payoffs=printed",
    ])
    .unwrap();
    assert_eq!(config.get("env.common_knowledge"), float(0.25));
    assert_eq!(config.env.data(), payoff_text(Payoffs::Printed));
    assert_eq!(
        message(
            builder()
                .map("--map matrix-game", "matrix-game")
                .set("env.common_knowledge=1.5")
        ),
        "--set env.common_knowledge=1.5: `env.common_knowledge` is 1.5, expected a number in [0, 1]"
    );
}

#[test]
fn a_map_is_chosen_by_its_name_and_so_is_a_world_without_maps() {
    let chosen = |layers: ConfigBuilder| {
        let config = layers.build().unwrap();
        let (kind, map) = (config.env.name().to_owned(), config.env.map().to_owned());
        (kind, map)
    };
    let of = |kind: &str, map: &str| (kind.to_owned(), map.to_owned());
    assert_eq!(chosen(builder().map("--map 8m", "8m")), of(SKIRMISH, "8m"));
    let game = builder().map("--map matrix-game", "matrix-game");
    assert_eq!(chosen(game.clone()), of("matrix-game", "matrix-game"));
    assert_eq!(
        chosen(game.map("--map 2s3z", "2s3z")),
        of(SKIRMISH, "2s3z"),
        "a later map brings its kind along"
    );
    let real = builder().set("env.name=sc2").unwrap();
    assert_eq!(
        chosen(real.map("--map 2s3z", "2s3z")),
        of(STAR_CRAFT, "2s3z"),
        "a kind that has maps stays"
    );
    assert_eq!(
        message(builder().set("env.map=matrix-game")),
        "--set env.map=matrix-game: `env.map` is \"matrix-game\", expected a map; a kind of world is chosen by env.name = \"matrix-game\""
    );
}

#[test]
fn a_setting_of_a_kind_that_is_not_chosen_is_named_with_its_owner() {
    assert_eq!(
        message(file("[env]\nname = \"matrix-game\"\nmove_amount = 3.0\n")),
        "run.toml:3:1: `env.move_amount` is a setting of `skirmish`, but `env.name` is `matrix-game`"
    );
    assert_eq!(
        message(file(
            "[algorithm]\nname = \"central-v\"\npartitions = \"all\"\n"
        )),
        "run.toml:3:1: `algorithm.partitions` is a setting of `mackrl`, but `algorithm.name` is `central-v`"
    );
}

#[test]
fn a_table_for_a_kind_holds_for_that_kind_alone_and_is_checked_for_any() {
    let text = "[env.skirmish]\nmove_amount = 3\n[env.sc2]\ngame_version = \"4.10\"\n\
                [env.matrix-game]\npayoffs = \"printed\"\n[algorithm.mackrl]\npartitions = \"round-robin\"\n";
    let value = |settings: &[&str], key: &str| {
        let layers = settings
            .iter()
            .try_fold(file(text).unwrap(), |builder, one| builder.set(one));
        layers.unwrap().build().unwrap().get(key)
    };
    assert_eq!(value(&[], "env.move_amount"), float(3.0));
    assert_eq!(value(&[], "env.payoffs"), None);
    assert_eq!(
        value(&["env.name=sc2"], "env.move_amount"),
        float(3.0),
        "the game plays by the settings of the simulator"
    );
    assert_eq!(
        value(&["env.name=sc2"], "env.game_version"),
        text_value("4.10")
    );
    assert_eq!(
        value(&["env.name=matrix-game"], "env.payoffs"),
        text_value("printed")
    );
    assert_eq!(
        value(&["algorithm.name=central-v"], "algorithm.partitions"),
        None
    );
    assert_eq!(
        message(file("[env.matrix-game]\npayofs = \"printed\"")),
        "run.toml:2:1: unknown key `env.matrix-game.payofs`, did you mean `env.matrix-game.payoffs`?"
    );
    assert_eq!(
        message(file("[env.matrix-game]\npayoffs = \"paper\"")),
        "run.toml:2:11: `env.matrix-game.payoffs` is \"paper\", expected `coded` or `printed`"
    );
}

#[test]
fn a_key_of_version_0_1_0_is_named_with_its_name_now() {
    for (key, new) in [
        ("learner.gamma", "algorithm.gamma"),
        ("policy.algorithm", "algorithm.name"),
        ("policy.partitions", "algorithm.partitions"),
        ("exploration.steps_env", "algorithm.exploration_steps_env"),
        ("env.engine", "env.name"),
        ("env.matrix_game.payoffs", "env.payoffs"),
    ] {
        assert_eq!(
            message(builder().set(&format!("{key}=1"))),
            format!("--set {key}=1: `{key}` is called `{new}` now")
        );
    }
}

/// What 0.1.0 wrote for `--map MAP` and the algorithm, with the settings of the paper's code.
fn recorded(map: &str, algorithm: &str) -> Config {
    let text = include_str!("recorded-0.1.0.toml")
        .replace("\"3m\"", &format!("{map:?}"))
        .replace(
            "algorithm = \"mackrl\"",
            &format!("algorithm = {algorithm:?}"),
        );
    let layers = builder().recorded("config.toml", &text).unwrap();
    layers.build().unwrap()
}

#[test]
fn what_version_0_1_0_recorded_is_read_as_it_was_meant() {
    for (map, algorithm) in [("2s3z", "mackrl"), ("3m", "central-v")] {
        let expected = builder()
            .preset("paper-code")
            .unwrap()
            .map("--map", map)
            .set(&format!("algorithm.name={algorithm}"))
            .unwrap()
            // The default of that time.
            .set("env.units=liberty")
            .unwrap();
        assert_eq!(recorded(map, algorithm), expected.build().unwrap());
    }
    let game = recorded("matrix-game", "mackrl");
    assert_eq!(game.env.name(), "matrix-game");
    assert_eq!(game.get("env.common_knowledge"), float(0.5));
    assert_eq!(game.get("env.move_amount"), None);
}

#[test]
fn a_setting_of_the_map_that_is_wrong_is_named_like_any_other() {
    assert_eq!(
        message(builder().set("env.move_amont=5")),
        "--set env.move_amont=5: unknown key `env.move_amont`, did you mean `env.move_amount`?"
    );
    assert_eq!(
        message(file("[env]\nmove_amount = \"far\"\n")),
        "run.toml:2:15: `env.move_amount` is \"far\", expected a number in (0, 32]"
    );
    assert_eq!(
        message(file("[env]\nmove_amount = 99.0\n")),
        "run.toml:2:15: `env.move_amount` is 99.0, expected a number in (0, 32]"
    );
    assert_eq!(
        message(builder().set("env.units=paper")),
        "--set env.units=paper: `env.units` is \"paper\", expected `liberty` or `lotv`"
    );
    assert_eq!(
        message(file("[env]\nshoot_range = 9.0\n")),
        "run.toml:2:15: `env.shoot_range` is 9.0, expected less than 9.0, which is sight_range: agents can only aim at what they see"
    );
    assert_eq!(
        message(builder().set("env.sight_range=6.0")),
        "--set env.sight_range=6.0: `env.sight_range` is 6.0, expected more than 6.0, which is shoot_range: agents can only aim at what they see",
        "the value that was written later is named"
    );
}

#[test]
fn a_team_without_the_partitions_that_are_asked_for_is_named_with_its_place() {
    let large = file("[env]\nmap = \"27m_vs_30m\"\n[algorithm.mackrl-ppo]\npartitions = \"all\"\n")
        .unwrap();
    assert_eq!(
        message(Ok(large.clone())),
        "run.toml:4:14: `algorithm.partitions` is \"all\", expected `round-robin` or `sampled:K` for the 27 agents of 27m_vs_30m"
    );
    assert_eq!(
        large.build_environment().unwrap().map(),
        "27m_vs_30m",
        "the world alone can be had"
    );
    large
        .set("algorithm.name=central-v")
        .unwrap()
        .build()
        .unwrap();
}

#[test]
fn an_unknown_map_is_named_with_its_place_and_its_neighbour() {
    assert_eq!(
        message(file("env.map = \"2s3x\"")),
        "run.toml:1:11: unknown map `2s3x`, did you mean `2s3z`?"
    );
}

prop_compose! {
    fn any_config()(
        (gamma, lambda, rate, critic_rate) in (0.0..=1.0f64, 0.0..=1.0f64, 1e-9..=1.0f64, 1e-9..=1.0f64),
        (start, share) in (0.0..=1.0f64, 0.0..=1.0f64),
        (steps_env, seed) in (1u64..=1 << 53, 0u64..=1 << 53),
        // Choices that every team has.
        partitions in prop::sample::select(&["round-robin", "sampled:1"][..]),
        (thin, central_v, rmsprop) in (any::<bool>(), any::<bool>(), any::<bool>()),
        map in prop::sample::select(mackrl_skirmish::map_names()),
        move_amount in 0.1f64..=32.0,
    ) -> Config {
        let mut config = Config::with(&["algorithm.name=mackrl"]).unwrap();
        if central_v {
            config.algorithm = AlgorithmConfig::new(Arc::new(CentralV));
        } else {
            config.algorithm.set("partitions", partitions).unwrap();
            if thin { config.algorithm.set("common_knowledge", "thin").unwrap(); }
        }
        for (name, value) in [
            ("gamma", gamma),
            ("lambda", lambda),
            ("learning_rate", rate),
            ("critic_learning_rate", critic_rate),
            ("exploration_start", start),
            ("exploration_finish", start * share),
        ] {
            config.algorithm.set(name, value).unwrap();
        }
        if rmsprop { config.algorithm.set("optimiser", "rmsprop").unwrap(); }
        config.run.steps_env = steps_env;
        config.run.seed = seed;
        config.env.set("map", map).unwrap();
        config.env.set("move_amount", move_amount).unwrap();
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
        if let Ok(builder) = builder().set(&text) {
            let _ = builder.build();
        }
    }
}

#[test]
fn large_teams_take_turns_unless_something_else_is_asked_for() {
    let partitions = |settings: &[&str]| {
        let resolved = preset_with("paper", settings).resolve().unwrap();
        let origin = resolved.origin("algorithm.partitions").to_string();
        (resolved.config().get("algorithm.partitions"), origin)
    };
    let (large, origin) = partitions(&["env.map=27m_vs_30m"]);
    assert_eq!(large, text_value("round-robin"));
    assert!(origin.starts_with("automatic: "), "{origin}");
    let (small, origin) = partitions(&["env.map=8m"]);
    assert_eq!(small, text_value("all"));
    assert!(origin.starts_with("preset paper:"), "{origin}");
    let asked = partitions(&["env.map=10m_vs_11m", "algorithm.partitions=sampled:5"]).0;
    assert_eq!(asked, text_value("sampled:5"));
    let too_many = builder()
        .set("env.map=10m_vs_11m")
        .and_then(|builder| builder.set("algorithm.partitions=all"))
        .unwrap();
    assert!(
        too_many.build().is_err(),
        "a user who asks for all is told why not"
    );
}

#[test]
fn outnumbered_teams_take_careful_steps_unless_something_else_is_asked_for() {
    let learning = |settings: &[&str]| {
        let config = preset_with("default", settings).build().unwrap();
        ["algorithm.clip", "algorithm.schedule_steps_env"].map(|key| config.get(key).unwrap())
    };
    let (usual, careful) = ([0.2.into(), 200_000.into()], [0.1.into(), 1_000_000.into()]);
    for algorithm in ["mackrl-ppo", "mappo", "ippo"] {
        let named = format!("algorithm.name={algorithm}");
        assert_eq!(learning(&[&named, "env.map=8m"]), usual);
        assert_eq!(learning(&[&named, "env.map=5m_vs_6m"]), careful);
        assert_eq!(learning(&[&named, "env.map=2m_vs_1z"]), usual);
    }
    let asked = learning(&["env.map=5m_vs_6m", "algorithm.clip=0.2"]);
    assert_eq!(asked, [usual[0].clone(), careful[1].clone()]);
}

#[test]
fn numbers_of_single_precision_read_as_they_are_written() {
    let scatter = Config::default().get("env.spawn_scatter");
    assert_eq!(scatter, Some(toml::Value::Float(0.02)));
    let set = builder().set("env.spawn_scatter=0.3").unwrap();
    let config = set.build().unwrap();
    assert_eq!(config.get("env.spawn_scatter"), float(0.3));
    let (_, settings) = config.env.skirmish_settings().unwrap();
    assert_eq!(settings.spawn_scatter, 0.3);
}
