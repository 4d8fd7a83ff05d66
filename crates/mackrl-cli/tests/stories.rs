//! What a person types, and what they get.

use assert_cmd::Command;

/// A command line that was run, with what came back.
struct Story {
    typed: String,
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

/// Types `line`, of which words are separated by spaces, in an empty folder.
fn type_in(line: &str) -> Story {
    let folder = tempfile::tempdir().expect("a folder for the story");
    type_in_folder(line, folder.path())
}

fn type_in_folder(line: &str, folder: &std::path::Path) -> Story {
    outcome(line, program(line, folder))
}

fn program(line: &str, folder: &std::path::Path) -> Command {
    let mut program = Command::cargo_bin("mackrl").expect("the program is built");
    program
        .args(line.split_whitespace())
        .current_dir(folder)
        .env_remove("COLUMNS");
    program
}

fn outcome(line: &str, mut program: Command) -> Story {
    let output = program.output().expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("output is UTF-8");
    Story {
        typed: line.to_owned(),
        code: output.status.code(),
        stdout: text(output.stdout),
        stderr: text(output.stderr),
    }
}

impl Story {
    /// It went well; gives what stdout holds.
    fn succeeds(self) -> String {
        assert_eq!(self.code, Some(0), "`{}`: {}", self.typed, self.stderr);
        self.stdout
    }

    /// It failed with this exit code and nothing on stdout; gives what stderr holds.
    fn fails(self, code: i32) -> String {
        assert_eq!(self.code, Some(code), "`{}`: {}", self.typed, self.stderr);
        assert_eq!(self.stdout, "", "`{}`", self.typed);
        self.stderr
    }
}

#[test]
fn help_teaches_every_command() {
    let mut help = type_in("--help").succeeds();
    for command in [
        "train",
        "resume",
        "evaluate",
        "certify",
        "sweep",
        "plot",
        "report",
        "reproduce figure5",
        "reproduce figure6",
        "reproduce figure7",
        "reproduce ablations",
        "reproduce all",
        "reproduce ppo",
        "reproduce figure4-neurips",
        "reproduce calibration",
        "reproduce zoo",
        "play",
        "fidelity",
        "replay",
        "explain",
        "serve",
        "maps",
        "config",
        "completions",
        "man",
        "bench",
        "bench env",
        "bench update",
        "bench train",
    ] {
        help += &format!("\n$ mackrl {command} --help\n");
        help += &type_in(&format!("{command} --help")).succeeds();
    }
    insta::assert_snapshot!("help", help);
}

/// Types `line` where `MACKRL_SIMD` is `instructions`.
fn type_in_with(instructions: &str, line: &str, folder: &std::path::Path) -> Story {
    let mut program = program(line, folder);
    program.env("MACKRL_SIMD", instructions);
    outcome(line, program)
}

#[test]
fn instructions_that_cannot_be_had_are_refused_before_anything_else() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    for line in ["--version", "maps", "train --map 3m --steps 1"] {
        let error = type_in_with("avx1024", line, folder.path()).fails(64);
        let start = "error: MACKRL_SIMD=avx1024: expected scalar";
        assert!(error.starts_with(start), "{error}");
    }
    assert_eq!(
        std::fs::read_dir(folder.path()).expect("a folder").count(),
        0
    );
}

#[test]
fn the_instruction_set_is_named_wherever_speed_is_told() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let json = |text: &str| serde_json::from_str::<serde_json::Value>(text).expect("JSON");
    for set in mackrl::nn::InstructionSet::available().map(mackrl::nn::InstructionSet::name) {
        let tell = |line: &str| type_in_with(set, line, folder.path());
        let version = tell("--version").succeeds();
        assert_eq!(version.lines().nth(1), Some(&*format!("simd {set}")));
        for bench in [
            "update --rows 2 --steps 3",
            "env --map 3m --steps 5",
            "train --map 3m --steps 1",
        ] {
            let speed = json(&tell(&format!("bench {bench} --json")).succeeds());
            assert_eq!(speed["simd"], set, "bench {bench}");
        }
        let trained = tell(&format!("train --map 3m --steps 1 --threads 1 --out {set}"));
        let first = trained.stderr.lines().next();
        let expected =
            format!("mackrl-ppo (preset default) on 3m, computing with {set} on 1 thread");
        assert_eq!(first, Some(&*expected));
        let record = std::fs::read_to_string(folder.path().join(set).join("run.json"));
        assert_eq!(json(&record.expect("a record"))["simd"], set);
    }
}

#[test]
fn settings_that_follow_from_the_map_are_told() {
    let trained = type_in("train --map 5m_vs_6m --steps 1 --set algorithm.clip=0.3");
    let told: Vec<&str> = (trained.stderr.lines())
        .filter(|line| line.starts_with("algorithm."))
        .collect();
    let expected = "algorithm.schedule_steps_env = 1000000, as the team is outnumbered";
    assert_eq!(told, [expected]);
    trained.succeeds();
}

#[test]
fn an_unknown_flag_is_a_usage_error() {
    insta::assert_snapshot!(type_in("maps --jsom").fails(2), @r"
    error: unexpected argument '--jsom' found

      tip: a similar argument exists: '--json'

    Usage: mackrl maps --json [MAP]

    For more information, try '--help'.
    ");
}

#[test]
fn an_unknown_setting_names_its_neighbour() {
    insta::assert_snapshot!(type_in("config --set algorithm.gama=0.9").fails(64), @r"
    error: --set algorithm.gama=0.9: unknown key `algorithm.gama`, did you mean `algorithm.gamma`?
    hint: `mackrl config --print` lists every setting, `mackrl config --explain KEY` explains one
    ");
}

#[test]
fn a_value_out_of_range_says_what_is_expected() {
    insta::assert_snapshot!(type_in("config --set algorithm.gamma=2").fails(64), @r"
    error: --set algorithm.gamma=2: `algorithm.gamma` is 2.0, expected a number in [0, 1]
    hint: algorithm.gamma: Discount γ of one environment step.
    ");
    insta::assert_snapshot!(type_in("config --algorithm maddpg").fails(64), @r#"
    error: --algorithm maddpg: `algorithm.name` is "maddpg", expected `mackrl`, `central-v`, `jal`, `mackrl-ppo`, `mappo`, `ippo`, `iql`, `vdn`, `qmix`, `iac`, `coma` or `mackrl-coma`
    hint: algorithm.name: What learns; which other settings `algorithm` has depends on it.
    "#);
}

#[test]
fn a_setting_of_version_0_1_0_is_told_by_its_name_now() {
    insta::assert_snapshot!(type_in("config --set learner.gamma=0.5").fails(64), @r"
    error: --set learner.gamma=0.5: `learner.gamma` is called `algorithm.gamma` now
    hint: `mackrl config --print` lists every setting, `mackrl config --explain KEY` explains one
    ");
    insta::assert_snapshot!(type_in("config --map matrix-game --set env.move_amount=5").fails(64), @r"
    error: --set env.move_amount=5: `env.move_amount` is a setting of `skirmish`, but `env.name` is `matrix-game`
    hint: `mackrl config --print` lists every setting, `mackrl config --explain KEY` explains one
    ");
}

#[test]
fn an_unknown_preset_names_its_neighbour() {
    insta::assert_snapshot!(type_in("config --preset papre").fails(64), @"error: unknown preset `papre`, expected default, fours, paper, paper-code, paper-figures, pymarl-iql, pymarl-vdn, pymarl-qmix, pymarl2-qmix, pymarl-coma, did you mean `paper`?");
}

#[test]
fn an_error_in_a_file_names_file_line_and_column() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let text = "[algorithm]\ngamma = 0.9\nlearning_rate = \"fast\"\n";
    std::fs::write(folder.path().join("mine.toml"), text).expect("the folder can be written");
    let story = type_in_folder("config --config mine.toml", folder.path());
    insta::assert_snapshot!(story.fails(64), @r#"
    error: mine.toml:3:17: `algorithm.learning_rate` is "fast", expected a number in (0, 1]
    hint: algorithm.learning_rate: Step size of the controllers.
    "#);
}

#[test]
fn a_file_that_is_not_there_is_an_input_error() {
    insta::assert_snapshot!(type_in("config --config none.toml").fails(74), @"error: cannot read none.toml: No such file or directory (os error 2)");
}

#[test]
fn the_printed_configuration_can_be_read_back() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let printed = type_in("config --print --preset paper-code --seed 7").succeeds();
    std::fs::write(folder.path().join("mine.toml"), &printed).expect("the folder can be written");
    let again = type_in_folder("config --config mine.toml", folder.path()).succeeds();
    let values = |text: &str| -> Vec<String> {
        text.lines()
            .map(|line| {
                line.split('#')
                    .next()
                    .unwrap_or_default()
                    .trim_end()
                    .to_owned()
            })
            .collect()
    };
    assert_eq!(values(&printed), values(&again));
    assert!(again.contains("seed = 7"), "{again}");
}

#[test]
fn a_setting_is_explained_with_its_value_everywhere() {
    insta::assert_snapshot!(type_in("config --explain algorithm.lambda --set algorithm.lambda=0.5").succeeds(), @r#"
    algorithm.lambda
      λ of the generalised advantages: 0 looks one step ahead, 1 to the end of the episode.
      takes              a number in [0, 1]
      built-in           0.9
      preset default     0.9  of the generalised advantages
      preset fours       0.8
      preset paper       0.8  "TD-lambda of 0.8"
      preset paper-code  0.8
      preset paper-figures  0.8
      preset pymarl-iql  0.9  td_lambda: targets look one step ahead
      preset pymarl-vdn  0.9  td_lambda: targets look one step ahead
      preset pymarl-qmix  0.9  td_lambda: targets look one step ahead
      preset pymarl2-qmix  0.9  td_lambda
      preset pymarl-coma  0.9  td_lambda
      here               0.5  --set algorithm.lambda=0.5
    "#);
    let section = type_in("config --explain test --json").succeeds();
    let section: Vec<serde_json::Value> = serde_json::from_str(&section).expect("a JSON array");
    let keys: Vec<_> = section.iter().map(|setting| &setting["key"]).collect();
    assert_eq!(keys, ["test.interval_steps_env", "test.episodes"]);
    insta::assert_snapshot!(type_in("config --explain lambada").fails(64), @r"
    error: --explain lambada: unknown key `lambada`, did you mean `algorithm.lambda`?
    hint: `mackrl config --print` lists every setting, `mackrl config --explain KEY` explains one
    ");
    assert!(
        type_in("config --explain run --schema")
            .fails(2)
            .contains("cannot be used with")
    );
}

#[test]
fn metrics_are_explained() {
    let text = type_in("config --metrics --algorithm central-v").succeeds();
    for line in [
        "explained_variance",
        "saturation_agent_controller",
        "test_distinct_openings",
    ] {
        assert!(text.lines().any(|found| found == line), "{line}");
    }
    assert!(!text.contains("pair_controller"), "{text}");
    let json = type_in("config --metrics --algorithm mackrl --json").succeeds();
    let json: Vec<serde_json::Value> = serde_json::from_str(&json).expect("a JSON array");
    assert!(
        json.iter()
            .any(|metric| metric["name"] == "entropy_share_pair_controller")
    );
}

#[test]
fn the_schema_is_json_and_every_printed_value_has_its_origin() {
    let schema = type_in("config --schema").succeeds();
    let schema: serde_json::Value = serde_json::from_str(&schema).expect("a JSON object");
    let gamma = &schema["properties"]["algorithm"]["properties"]["gamma"];
    assert_eq!(gamma["maximum"], 1.0, "{schema}");
    let printed = type_in("config --print --json --seed 5").succeeds();
    let printed: Vec<serde_json::Value> = serde_json::from_str(&printed).expect("a JSON array");
    let seed = printed.iter().find(|setting| setting["key"] == "run.seed");
    let seed = seed.expect("every setting is printed");
    assert_eq!(
        (&seed["value"], &seed["origin"]),
        (&5.into(), &"--seed 5".into())
    );
}

#[test]
fn an_unknown_map_points_to_the_list() {
    insta::assert_snapshot!(type_in("bench env --map nowhere").fails(64), @r"
    error: --map nowhere: unknown map `nowhere`
    hint: `mackrl maps` lists every map; the name of a scenario file ends in .toml
    ");
}

#[test]
fn every_measurement_says_what_it_measured() {
    let measured = |line: &str| -> serde_json::Value {
        serde_json::from_str(&type_in(line).succeeds()).expect("a JSON object")
    };
    let environment = measured("bench env --map 3m --steps 500 --threads 3 --json");
    assert_eq!(
        (&environment["steps"], &environment["threads"]),
        (&500.into(), &3.into())
    );
    assert!(
        environment["env_steps_per_s"].as_f64() > Some(0.0),
        "{environment}"
    );
    let update = measured("bench update --rows 5 --steps 7 --updates 3 --json");
    assert!(update["min_ms"].as_f64() > Some(0.0), "{update}");
    assert!(
        update["median_ms"].as_f64() >= update["min_ms"].as_f64(),
        "{update}"
    );
    for algorithm in ["mackrl", "central-v", "mackrl-ppo", "ippo", "qmix"] {
        let line =
            format!("bench train --steps 300 --algorithm {algorithm} --set test.episodes=3 --json");
        let training = measured(&line);
        assert_eq!(training["algorithm"], algorithm);
        assert!(training["steps"].as_u64() >= Some(300), "{training}");
        let shares = training["shares"].as_object().expect("an object of shares");
        let total: f64 = shares.values().filter_map(serde_json::Value::as_f64).sum();
        assert!((total - 1.0).abs() < 1e-9, "{training}");
        let finds_knowledge = shares["common_knowledge"].as_f64() > Some(0.0);
        assert_eq!(
            finds_knowledge,
            algorithm.starts_with("mackrl"),
            "{training}"
        );
    }
}

#[test]
fn measuring_nothing_is_a_usage_error() {
    insta::assert_snapshot!(type_in("bench update --rows 0").fails(2), @r"
    error: invalid value '0' for '--rows <B>': expected a whole number from 1 to 10000, such as 20000, 20_000 or 2e4

    For more information, try '--help'.
    ");
    let unknown = type_in("bench train --map nowhere").fails(64);
    assert!(unknown.contains("unknown map `nowhere`"), "{unknown}");
}

#[test]
fn the_table_of_maps_has_a_line_for_each_and_then_says_what_else_there_is() {
    let table = type_in("maps").succeeds();
    let lines: Vec<&str> = table.lines().collect();
    let json: Vec<serde_json::Value> =
        serde_json::from_str(&type_in("maps --json").succeeds()).expect("a JSON array");
    for (line, map) in lines[1..].iter().zip(&json) {
        let name = map["name"].as_str().expect("a map has a name");
        assert_eq!(line.split(' ').next(), Some(name));
    }
    assert_eq!(lines[json.len() + 1], "");
    let also = lines[json.len() + 2..].join("\n");
    assert!(
        also.contains("difficulty: ") && also.contains("matrix-game"),
        "{table}"
    );
}

#[test]
fn a_map_is_shown_with_a_picture_and_the_matrix_game_without() {
    insta::assert_snapshot!("map_2m_vs_1z", type_in("maps 2m_vs_1z").succeeds());
    insta::assert_snapshot!(type_in("maps matrix-game").succeeds(), @r"
    matrix-game: 2 agents earn the entry of a payoff matrix that they choose together, in 1 step

    n_actions   5
    obs_size    5
    state_size  12

    Settings: env.payoffs, env.distribution and env.common_knowledge; `mackrl reproduce figure5` is the paper's experiment.
    ");
    insta::assert_snapshot!(type_in("maps 2m_vs_2z").fails(64), @r"
    error: maps 2m_vs_2z: unknown map `2m_vs_2z`, did you mean `2m_vs_1z`?
    hint: `mackrl maps` lists every map; the name of a scenario file ends in .toml
    ");
    insta::assert_snapshot!(type_in("maps 3m --check my.toml").fails(2), @r"
    error: the argument '[MAP]' cannot be used with '--check <FILE>'

    Usage: mackrl maps <MAP>

    For more information, try '--help'.
    ");
}

/// A copy of the commented example in a folder of its own.
fn folder_with_example() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let example = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/scenarios/sniper-alley.toml"
    );
    std::fs::copy(example, folder.path().join("my.toml")).expect("the folder can be written");
    folder
}

fn spoil(folder: &tempfile::TempDir, file: &str, from: &str, to: &str) {
    let path = folder.path().join(file);
    let text = std::fs::read_to_string(&path).expect("the file is there");
    assert!(text.contains(from), "{file} has no `{from}`");
    std::fs::write(&path, text.replacen(from, to, 1)).expect("the folder can be written");
}

#[test]
fn scripted_teams_play_to_the_same_numbers_on_any_number_of_threads() {
    let play = |threads: u32| {
        let line =
            format!("play --map 3m --policy all --episodes 20 --seed 3 --json --threads {threads}");
        type_in(&line).succeeds()
    };
    let rows: Vec<serde_json::Value> = serde_json::from_str(&play(1)).expect("a JSON array");
    assert_eq!(rows.len(), 5, "one row for each policy");
    assert_eq!(play(1), play(3));
    for key in [
        "battle_won",
        "return",
        "ep_length",
        "dead_allies",
        "dead_enemies",
    ] {
        for suffix in ["mean", "sem"] {
            let key = format!("{key}_{suffix}");
            assert!(rows[0][&key].is_number(), "{key} is missing");
        }
    }
}

#[test]
fn a_report_is_the_same_on_any_number_of_threads_and_names_its_command() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let command = "mackrl play --map 3m --policy all --episodes 7 --seed 5 --out reports/mine";
    let read = |name: &str| {
        let file = folder.path().join("reports/mine").join(name);
        std::fs::read_to_string(file).expect("a file of the report")
    };
    let mut reports = ["1", "3"].map(|threads| {
        let line = command.replacen("mackrl ", "", 1) + " --threads " + threads;
        type_in_folder(&line, folder.path()).succeeds();
        [read("scripted.json"), read("README.md")]
    });
    assert_eq!(reports[0], reports[1]);
    let [json, page] = std::mem::take(&mut reports[0]);
    assert!(page.contains(&format!("\n{command}\n")), "{page}");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["command"], command);
    let rows = json["rows"].as_array().expect("an array");
    let heading = "| map | random | idle | nearest | focus-fire | kite |\n";
    assert_eq!((rows.len(), page.matches(heading).count()), (5, 2));
    let won = rows[4]["battle_won_mean"].as_f64().expect("a number");
    let line = page.lines().find(|line| line.starts_with("| `3m` |"));
    assert!(
        line.expect("a row").contains(&format!("| {won:.3} ± ")),
        "{page}"
    );
}

#[test]
fn a_scenario_of_ones_own_is_checked_played_and_trained_on() {
    let folder = folder_with_example();
    let story = |line: &str| type_in_folder(line, folder.path());
    insta::assert_snapshot!(story("maps --check my.toml").succeeds(), @r"
    name  sides  races  kind  steps  difficulty  scripted  trained
    my    3 v 8  T v Z          150
    ");
    story("play --map ./my.toml --episodes 3 --policy kite").succeeds();
    story("train --map ./my.toml --steps 100 --set test.episodes=2 --seed 2").succeeds();
    // The run holds all that it depends on.
    std::fs::remove_file(folder.path().join("my.toml")).expect("the file is there");
    story("evaluate runs/my-mackrl-ppo-seed2 --episodes 2").succeeds();
}

#[test]
fn a_broken_scenario_names_file_line_and_column() {
    let folder = folder_with_example();
    spoil(&folder, "my.toml", "count = 8", "count = 800");
    let check = type_in_folder("maps --check my.toml", folder.path()).fails(64);
    insta::assert_snapshot!(check, @r"
    error: my.toml:58:32: count is 800, expected an integer in [1, 100]
    hint: examples/scenarios/sniper-alley.toml explains every line of a scenario
    ");
    let play = type_in_folder("play --map my.toml", folder.path()).fails(64);
    assert_eq!(check, play);
}

#[test]
fn what_is_no_scenario_is_refused_at_once_whatever_it_is() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let place = |name: &str| folder.path().join(name);
    std::fs::create_dir(place("folder.toml")).expect("writable");
    std::fs::write(place("binary.toml"), [0, 159, 146, 150]).expect("writable");
    std::fs::write(place("empty.toml"), "").expect("writable");
    let sparse = std::fs::File::create(place("sparse.toml")).expect("writable");
    sparse.set_len(1 << 40).expect("files may have holes");
    let mut cases = vec![
        ("folder", 74, "it is a folder, expected a file"),
        ("binary", 64, "not UTF-8 text at byte 1"),
        (
            "empty",
            64,
            "empty.toml:1:1: found an empty file, expected a scenario",
        ),
        ("sparse", 65, "is too long, expected at most 262144 bytes"),
        ("nothing", 74, "No such file"),
    ];
    // A pipe without a writer: whoever opens it waits for ever.
    let mkfifo = std::process::Command::new("mkfifo")
        .arg(place("pipe.toml"))
        .status();
    if mkfifo.is_ok_and(|status| status.success()) {
        cases.push(("pipe", 74, "it is a pipe or a device, expected a file"));
    }
    for (name, code, words) in cases {
        for command in ["maps --check", "maps", "play --map", "train --map"] {
            let error = type_in_folder(&format!("{command} {name}.toml"), folder.path());
            let error = error.fails(code);
            assert!(error.contains(words), "{command}: {error}");
        }
    }
}

#[test]
fn a_scenario_may_be_called_like_a_world_of_ours() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let map = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../mackrl-skirmish/maps/2m_vs_1z.toml"
    );
    std::fs::copy(map, folder.path().join("matrix-game.toml")).expect("writable");
    let checked = type_in_folder("maps --check matrix-game.toml --json", folder.path());
    let checked: serde_json::Value =
        serde_json::from_str(&checked.succeeds()).expect("a JSON array");
    assert_eq!(checked[0]["n_enemies"], 1);
}
