//! A run whose numbers leave the range of single precision: it stops, keeps nothing of the update, and can be asked why.

mod support;

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;
use support::{checkpoints, exits, mackrl, resume};

/// Rewards of 10¹⁸ and a critic whose gradient is not shortened: after some updates its square is infinite.
const HUGE: &[&str] = &[
    "policy.hidden=8",
    "env.reward_negative_scale=1e9",
    "env.reward_death_value=1e9",
    "env.reward_only_positive=false",
    "env.reward_scale=false",
    "learner.gradient_norm_max=1e30",
    "run.steps_env=20000",
    "run.checkpoint_interval_steps_env=1",
    "test.episodes=2",
];

fn train(run: &Path) -> std::process::Command {
    let mut command = mackrl(&["train", "--map", "8m", "--threads", "1", "--out"]);
    command.arg(run);
    for setting in HUGE {
        command.args(["--set", setting]);
    }
    command
}

fn json(path: &Path) -> Value {
    let text = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_slice(&text).expect("the file is JSON")
}

/// What `mackrl debug` prints, and its exit code.
fn debug(words: &[&str]) -> (Option<i32>, String) {
    let output = mackrl(&[&["debug"], words].concat()).output();
    let output = output.expect("the program starts");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    (output.status.code(), text)
}

/// A failed run, its dump, and what the run said when it stopped.
fn failed(parent: &Path) -> (PathBuf, PathBuf, String) {
    let run = parent.join("run");
    let stderr = exits(train(&run), 65);
    let dumps = fs::read_dir(run.join("dumps")).expect("a dump was written");
    let dumps: Vec<PathBuf> = dumps.flatten().map(|entry| entry.path()).collect();
    assert_eq!(dumps.len(), 1, "{dumps:?}");
    (run, dumps[0].clone(), stderr)
}

#[test]
fn an_update_that_is_not_finite_stops_the_run_and_leaves_a_dump_that_repeats_it() {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let (run, dump, stderr) = failed(parent.path());
    let failure = json(&dump.join("failure.json"));
    let message = failure["message"].as_str().expect("a message");
    assert!(message.contains(" moment of critic."), "{message}");
    assert!(message.contains(" is inf at "), "{message}");
    let told = format!(
        "error: the run cannot go on: {message}\nhint: `mackrl debug {}` repeats the update",
        dump.display()
    );
    assert!(stderr.contains(&told), "{stderr}");

    // A checkpoint follows every update, so the last one is the state that the refused update started from.
    let last = checkpoints(&run).pop().expect("a checkpoint");
    for file in ["tensors.safetensors", "counters.json"] {
        let same = fs::read(last.join(file)).ok() == fs::read(dump.join(file)).ok();
        assert!(same, "{file} has changed");
    }
    assert_eq!(json(&run.join("run.json"))["status"], "failed");
    assert!(!run.join("weights.safetensors").exists());

    let (code, text) = debug(&[&run.to_string_lossy(), "--threads", "3"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("repeated  the same\n"), "{text}");
    assert!(text.contains("<- first"), "{text}");
    let (code, text) = debug(&[&dump.to_string_lossy(), "--json"]);
    assert_eq!(code, Some(0), "{text}");
    let report: Value = serde_json::from_str(&text).expect("a JSON object");
    assert_eq!(report["reproduced"], true);
    assert_eq!(report["repeated"], failure["number"]);
    assert_eq!(report["origin"]["name"], failure["number"]["tensor"]);
    assert_eq!(report["origin"]["part"], "critic");

    let before = fs::read(run.join("metrics.jsonl")).expect("metrics");
    let stderr = exits(resume(&run, 1), 65);
    assert!(stderr.contains(&told), "{stderr}");
    assert!(fs::read(run.join("metrics.jsonl")).expect("metrics") == before);
}

#[test]
fn a_dump_that_does_not_fail_is_told_apart_from_a_damaged_one_and_from_none() {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let (run, dump, _) = failed(parent.path());
    // The configuration under which the update goes well, with a manifest that vouches for it.
    let config = dump.join("config.toml");
    let text = fs::read_to_string(&config).expect("a configuration");
    let sound = text.replace(
        "gradient_norm_max = 1000000000000000000000000000000.0",
        "gradient_norm_max = 10.0",
    );
    assert_ne!(sound, text);
    fs::write(&config, &sound).expect("a dump can be changed");
    let output = mackrl(&["debug", &dump.to_string_lossy()]).output();
    let output = output.expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(65), "{stderr}");
    assert!(
        stderr.contains("config.toml: is not what manifest.json says"),
        "{stderr}"
    );

    let manifest = dump.join("manifest.json");
    let vouched = fs::read_to_string(&manifest).expect("a manifest");
    let of = |text: &str| (text.len(), support::sha256(text.as_bytes()));
    let ((bytes, hash), (sound_bytes, sound_hash)) = (of(&text), of(&sound));
    let vouched = vouched.replace(&hash, &sound_hash).replace(
        &format!("\"bytes\": {bytes},"),
        &format!("\"bytes\": {sound_bytes},"),
    );
    fs::write(&manifest, vouched).expect("a dump can be changed");
    let output = mackrl(&["debug", &dump.to_string_lossy()]).output();
    let output = output.expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(
        stderr.contains("the update is not refused any more"),
        "{stderr}"
    );

    fs::remove_dir_all(run.join("dumps")).expect("dumps can be removed");
    let output = mackrl(&["debug", &run.to_string_lossy()]).output();
    let output = output.expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("is no dump and holds none"), "{stderr}");
}
