//! What a person does with trained teams: play elsewhere, look at single battles, train on from them; and what the program says.

mod support;

use std::{fs, path::Path, process::Command};

use serde_json::Value;
use support::{exits, mackrl, outcome, train};

/// Three marines against three, as on 3m, that start further apart.
const APART: &str = r#"
episode_limit = 60
terrain = """
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
................................
"""

[allies]
race = "terran"
groups = [{ unit = "marine", count = 3, at = [5, 16] }]

[enemies]
race = "terran"
order = { attack-move = [5, 16] }
groups = [{ unit = "marine", count = 3, at = [27, 16] }]
"#;

/// Types the words, of which the run's folder is the last but the flags.
fn prints(command: &mut Command) -> String {
    let output = command.output().expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn on(run: &Path, words: &[&str]) -> Command {
    let mut command = mackrl(&words[..1]);
    command.arg(run).args(&words[1..]);
    command
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

/// A small run of 3m, and a folder for what is made of it.
fn trained() -> (tempfile::TempDir, std::path::PathBuf) {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    exits(train(&run, &["run.steps_env=300"]), 0);
    (parent, run)
}

#[test]
fn an_evaluation_can_be_had_episode_by_episode_and_on_a_map_of_the_same_sizes() {
    let (parent, run) = trained();
    let rows = parent.path().join("episodes.jsonl");
    let rows_out = rows.to_string_lossy().into_owned();
    let words = [
        "evaluate",
        "--episodes",
        "5",
        "--episodes-out",
        &rows_out,
        "--json",
    ];
    let found = json(&prints(&mut on(&run, &words)));
    let text = fs::read_to_string(&rows).expect("rows were written");
    let rows: Vec<Value> = text.lines().map(json).collect();
    assert_eq!(rows.len(), 5);
    for name in ["battle_won", "return", "ep_length", "dead_allies"] {
        let values = rows.iter().map(|row| row[name].as_f64().expect(name));
        let mean = values.sum::<f64>() / 5.0;
        let told = found[format!("test_{name}_mean")].as_f64().expect(name);
        assert!((mean - told).abs() < 1e-12, "{name}: {mean}, {told}");
    }
    assert_eq!(rows[4]["episode"], 4);

    let text = prints(&mut on(&run, &["evaluate", "--episodes", "3"]));
    assert!(text.starts_with("won "), "{text}");
    assert!(!text.contains("test_"), "{text}");

    let scenario = parent.path().join("apart.toml");
    fs::write(&scenario, APART).expect("the folder can be written");
    let apart = scenario.to_string_lossy().into_owned();
    let elsewhere = json(&prints(&mut on(
        &run,
        &["evaluate", "--episodes", "5", "--map", &apart, "--json"],
    )));
    assert_eq!(elsewhere["trained_on"], "3m");
    let data = |evaluation: &Value| evaluation["provenance"]["map_sha256"].clone();
    assert_ne!(data(&elsewhere), data(&found));
    let map = elsewhere["provenance"]["map"].as_str().expect("a map");
    assert!(map.ends_with("apart.toml"), "{map}");

    let stderr = exits(on(&run, &["evaluate", "--map", "8m"]), 2);
    assert!(
        stderr.contains("trained on 3m and sizes differ: 8 agents, not 3, 16 units, not 6"),
        "{stderr}"
    );
}

#[test]
fn a_run_can_begin_with_the_weights_of_another() {
    let (parent, run) = trained();
    let begin = |out: &str, flags: &[&str]| {
        let mut command = mackrl(&["train", "--threads", "1", "--from"]);
        command.arg(&run).args(flags);
        command.arg("--out").arg(parent.path().join(out));
        command
    };
    exits(begin("next", &["--steps", "4e2", "--seed", "9"]), 0);
    let next = parent.path().join("next");
    let initial = fs::read(next.join("initial.safetensors")).expect("weights to begin with");
    let weights = fs::read(run.join("weights.safetensors")).expect("weights");
    assert!(initial == weights, "they are those of the other run");
    let record = json(&fs::read_to_string(next.join("run.json")).expect("a record"));
    assert_eq!(record["initial_weights"]["run"], run.display().to_string());
    assert_eq!(record["initial_weights"]["checkpoint"], "last");
    let config = fs::read_to_string(next.join("config.toml")).expect("a configuration");
    for line in [
        "steps_env = 400",
        "hidden = 8",
        "seed = 9",
        "initial_weights = \"",
    ] {
        assert!(config.contains(line), "{line} is missing: {config}");
    }
    // Two runs that begin alike end alike, and not as one that begins untrained.
    exits(begin("again", &["--steps", "400", "--seed", "9"]), 0);
    assert!(outcome(&next) == outcome(&parent.path().join("again")));
    let untrained = parent.path().join("untrained");
    exits(train(&untrained, &["run.steps_env=400", "run.seed=9"]), 0);
    let last = |run: &Path| fs::read(run.join("weights.safetensors")).expect("weights");
    assert!(last(&next) != last(&untrained));

    let stderr = exits(begin("wide", &["--set", "algorithm.hidden=16"]), 65);
    assert!(
        stderr.contains("cannot begin with the weights of "),
        "{stderr}"
    );
    let stderr = exits(begin("other", &["--map", "8m"]), 2);
    assert!(stderr.contains("8 agents, not 3"), "{stderr}");
    for made in ["wide", "other"] {
        assert!(!parent.path().join(made).exists(), "{made}");
    }
}

#[test]
fn numbers_are_typed_as_people_type_them() {
    let steps = |typed: &str| prints(&mut mackrl(&["config", "--steps", typed]));
    for typed in ["1e6", "1_000_000", "1000000"] {
        assert!(steps(typed).contains("steps_env = 1000000 "), "{typed}");
    }
    let set = prints(&mut mackrl(&["config", "--set", "run.steps_env=2e5"]));
    assert!(set.contains("steps_env = 200000 "), "{set}");
    for (words, range) in [
        (["evaluate", "x", "--episodes", "0"], "from 1 to 1000000000"),
        (["train", "--steps", "1.5", "--json"], "from 1 on"),
        (["reproduce", "figure6", "--seeds", "1"], "from 2 to 1000"),
    ] {
        let stderr = exits(mackrl(&words), 2);
        let expected = format!("expected a whole number {range}, such as 20000, 20_000 or 2e4");
        assert!(stderr.contains(&expected), "{stderr}");
    }
}

/// The words of all commands that are not hidden.
const COMMANDS: [&str; 21] = [
    "train",
    "resume",
    "evaluate",
    "certify",
    "sweep",
    "plot",
    "report",
    "reproduce",
    "play",
    "fidelity",
    "replay",
    "explain",
    "serve",
    "maps",
    "diff",
    "config",
    "bench",
    "sc2",
    "completions",
    "man",
    "help",
];

#[test]
fn completions_know_every_command_and_its_flags() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = prints(&mut mackrl(&["completions", shell]));
        for command in COMMANDS {
            // Features decide whether some are there.
            let is_there = mackrl(&[command, "--help"])
                .output()
                .expect("it starts")
                .status;
            if command == "help" || is_there.success() {
                assert!(script.contains(command), "{command} in {shell}");
            }
        }
        for flag in ["episodes-out", "checkpoint", "time-limit"] {
            assert!(script.contains(flag), "{flag} in {shell}");
        }
    }
    if Command::new("bash").arg("--version").output().is_ok() {
        let script = prints(&mut mackrl(&["completions", "bash"]));
        let mut checked = Command::new("bash");
        let checked = checked
            .args(["-n", "-c", &script])
            .output()
            .expect("bash runs");
        assert!(
            checked.status.success(),
            "{}",
            String::from_utf8_lossy(&checked.stderr)
        );
    }
}

#[test]
fn every_command_has_a_manual_page() {
    let whole = prints(&mut mackrl(&["man"]));
    assert!(whole.contains(".TH mackrl 1"), "{whole}");
    assert!(!whole.contains("execute"), "a hidden command is told");
    let folder = tempfile::tempdir().expect("a folder");
    let pages = folder.path().join("man1");
    exits(on(&pages, &["man"]), 0);
    for (page, text) in [
        ("mackrl", "SUBCOMMANDS"),
        ("mackrl-train", "initial.safetensors"),
        ("mackrl-evaluate", "episodes"),
        ("mackrl-reproduce-figure6", "seeds"),
        ("mackrl-bench-env", "threads"),
        ("mackrl-maps", "difficulty"),
    ] {
        let read = fs::read_to_string(pages.join(format!("{page}.1"))).expect(page);
        assert!(read.contains(text), "{page}: {read}");
        assert!(read.contains(&format!("{page} ")), "{page} has its name");
    }
    assert!(!pages.join("mackrl-execute-agent.1").exists());
    let count = fs::read_dir(&pages).expect("pages").count();
    assert!(count >= COMMANDS.len() - 1, "{count} pages");
}
