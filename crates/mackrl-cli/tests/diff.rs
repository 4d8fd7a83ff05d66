//! Where two runs first differ.

mod support;

use std::{fs, path::Path};

use mackrl_run::provenance::LEARNING_VERSION;
use serde_json::Value;
use support::{checkpoints, exits, mackrl, train_on};

/// A short run, in a folder of this name, with further settings.
fn run(parent: &Path, name: &str, threads: usize, settings: &[&str]) -> String {
    let path = parent.join(name);
    let mut command = train_on(threads, &path, settings);
    command.args(["--set", "run.steps_env=600"]);
    exits(command, 0);
    path.to_string_lossy().into_owned()
}

/// What `mackrl diff --json` finds, after its exit code was seen to be `code`.
fn diff(a: &str, b: &str, code: i32) -> Value {
    let output = mackrl(&["diff", a, b, "--json", "--threads", "1"]).output();
    let output = output.expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    let found: Value = serde_json::from_slice(&output.stdout).expect("a JSON object");
    assert_eq!(found["equal"], code == 0, "{found}");
    found
}

/// Changes a file of a run.
fn edit(run: &str, file: &str, from: &str, to: &str) {
    let path = Path::new(run).join(file);
    let text = fs::read_to_string(&path).expect("the file is there");
    assert!(text.contains(from), "{text}");
    fs::write(&path, text.replacen(from, to, 1)).expect("the file can be changed");
}

#[test]
fn equal_runs_are_equal_whatever_their_threads() {
    let parent = tempfile::tempdir().expect("a folder for runs");
    let one = run(parent.path(), "one", 1, &[]);
    let other = run(parent.path(), "other", 3, &[]);
    let found = diff(&one, &other, 0);
    assert_eq!(
        found["replay"],
        Value::Null,
        "nothing had to be played again"
    );
    let folders = [&one, &other].map(|run| checkpoints(Path::new(run)).pop());
    let [a, b] = folders.map(|folder| folder.expect("a checkpoint").to_string_lossy().into_owned());
    diff(&a, &b, 0);
}

#[test]
fn another_seed_is_named_with_the_first_step_that_it_changes() {
    let parent = tempfile::tempdir().expect("a folder for runs");
    let one = run(parent.path(), "one", 1, &[]);
    let other = run(parent.path(), "other", 1, &["run.seed=4"]);
    let found = diff(&one, &other, 1);
    assert_eq!(found["configuration"][0]["name"], "run.seed");
    assert_eq!(found["configuration"][0]["a"], 3);
    assert_eq!(found["configuration"][1], Value::Null);
    assert_eq!(found["replay"]["learning"]["update"], 0);
    let game = &found["replay"]["game"];
    assert_eq!(
        (&game["update"], &game["place"][0][1]),
        (&0.into(), &0.into())
    );
    assert_eq!(
        found["replay"]["not_reproduced"],
        serde_json::json!([null, null])
    );
    let output = mackrl(&["diff", &one, &other, "--no-replay"]).output();
    let output = output.expect("the program starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("configuration run.seed: 3, 4\n"), "{text}");
    assert!(!text.contains("game"), "{text}");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(stderr, "error: they differ, first in run.seed: 3, 4\n");
}

#[test]
fn another_rate_changes_what_is_learnt_before_what_is_played() {
    let parent = tempfile::tempdir().expect("a folder for runs");
    let one = run(parent.path(), "one", 1, &[]);
    let other = run(parent.path(), "other", 1, &["algorithm.learning_rate=0.1"]);
    let found = diff(&one, &other, 1);
    assert_eq!(found["configuration"][0]["name"], "algorithm.learning_rate");
    assert_eq!(found["replay"]["learning"]["update"], 0);
    let game = found["replay"]["game"]["update"].as_u64();
    assert!(game.is_some_and(|update| update >= 1), "{found}");
}

#[test]
fn another_version_and_changed_records_are_told_apart() {
    let parent = tempfile::tempdir().expect("a folder for runs");
    let one = run(parent.path(), "one", 1, &[]);
    let other = run(parent.path(), "other", 1, &[]);
    let own = format!("\"learning\": {LEARNING_VERSION}");
    edit(&other, "run.json", &own, "\"learning\": 97");
    let found = diff(&one, &other, 1);
    assert_eq!(found["versions"]["name"], "versions");
    assert_eq!(found["metrics"], Value::Null);
    edit(&other, "run.json", "\"finished\"", "\"interrupted\"");
    let stderr = exits(mackrl(&["resume", &other]), 0);
    assert!(
        stderr.contains("warning: the run was made by simulator")
            && stderr.contains("learning 97 and"),
        "{stderr}"
    );
    let record = fs::read_to_string(Path::new(&other).join("run.json")).expect("a record");
    let record: Value = serde_json::from_str(&record).expect("a JSON object");
    assert_eq!(
        record["provenance"].as_array().map(Vec::len),
        Some(2),
        "both versions"
    );

    let other = run(parent.path(), "third", 1, &[]);
    let metrics = fs::read_to_string(Path::new(&other).join("metrics.jsonl")).expect("metrics");
    let row = metrics.lines().nth(1).expect("a second row");
    let row: Value = serde_json::from_str(row).expect("a JSON object");
    let loss = format!("\"pg_loss\":{}", row["pg_loss"]);
    edit(&other, "metrics.jsonl", &loss, "\"pg_loss\":0.5");
    let refused = exits(mackrl(&["diff", &one, &other]), 65);
    assert!(refused.contains("is not what run.json says"), "{refused}");
    edit(&other, "run.json", "\"finished\"", "\"running\"");
    let found = diff(&one, &other, 1);
    assert_eq!(found["metrics"]["row"], 2);
    assert_eq!(found["metrics"]["name"], "pg_loss");
    let replay = &found["replay"];
    assert_eq!(
        (&replay["game"], &replay["learning"]),
        (&Value::Null, &Value::Null)
    );
    assert_eq!(replay["not_reproduced"][0], Value::Null);
    assert_eq!(
        replay["not_reproduced"][1]["row"], 2,
        "b's records were changed"
    );
    assert_eq!(replay["not_reproduced"][1]["a"], 0.5, "recorded");
    assert_eq!(
        replay["not_reproduced"][1]["b"], row["pg_loss"],
        "played again"
    );
}

#[test]
fn results_are_compared_by_where_they_come_from_and_by_value() {
    let parent = tempfile::tempdir().expect("a folder for runs");
    let one = run(parent.path(), "one", 1, &[]);
    let evaluate = |name: &str, seed: &str| {
        let words = [
            "evaluate",
            &one,
            "--episodes",
            "2",
            "--seed",
            seed,
            "--json",
        ];
        let output = mackrl(&words).output().expect("the program starts");
        let path = parent.path().join(name);
        fs::write(&path, output.stdout).expect("a result can be kept");
        path.to_string_lossy().into_owned()
    };
    let (a, b, c) = (evaluate("a", "1"), evaluate("b", "1"), evaluate("c", "2"));
    diff(&a, &b, 0);
    let found = diff(&a, &c, 1);
    assert_eq!(found["provenance"]["name"], "provenance.seeds.0");
    let stderr = exits(mackrl(&["diff", &a, &one]), 2);
    assert!(stderr.contains("expected two of one kind"), "{stderr}");
}
