//! A run whose numbers leave the range of single precision: it stops, says where, and keeps nothing of the update.

mod support;

use std::{fs, path::Path};

use serde_json::Value;
use support::{checkpoints, exits, mackrl, resume};

/// Rewards of 10¹⁸ and a critic whose gradient is not shortened: after some updates its square is infinite.
const HUGE: &[&str] = &[
    "algorithm.name=mackrl",
    "algorithm.hidden=8",
    "env.reward_negative_scale=1e9",
    "env.reward_death_value=1e9",
    "env.reward_only_positive=false",
    "env.reward_scale=false",
    "algorithm.gradient_norm_max=1e30",
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

/// Every file of the checkpoint with its content.
fn contents(checkpoint: &Path) -> Vec<Vec<u8>> {
    let names = ["tensors.safetensors", "counters.json", "manifest.json"];
    let read = |name| fs::read(checkpoint.join(name)).expect("a checkpoint is whole");
    names.into_iter().map(read).collect()
}

#[test]
fn an_update_that_is_not_finite_stops_the_run_and_is_repeated_when_it_is_resumed() {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    let stderr = exits(train(&run), 65);
    let told = stderr.lines().find(|line| line.starts_with("error: "));
    let told = told.expect("an error").to_owned();
    for part in [
        "error: the run cannot go on: ",
        " moment of critic.",
        " is inf at output ",
        ", in update ",
    ] {
        assert!(told.contains(part), "{part} is missing: {told}");
    }
    let hint = format!("hint: `mackrl resume {}` goes on from", run.display());
    assert!(stderr.contains(&hint), "{stderr}");
    let record = fs::read(run.join("run.json")).expect("a record of the run");
    let record: Value = serde_json::from_slice(&record).expect("the record is JSON");
    assert_eq!(record["status"], "failed");
    assert!(!run.join("weights.safetensors").exists());

    // A checkpoint follows every update, so the last one is the state that the refused update starts from.
    let last = checkpoints(&run).pop().expect("a checkpoint");
    let before = (
        contents(&last),
        fs::read(run.join("metrics.jsonl")).expect("metrics"),
    );
    for threads in [1, 3] {
        let stderr = exits(resume(&run, threads), 65);
        assert!(stderr.contains(&told), "{told}, expected in {stderr}");
        assert_eq!(checkpoints(&run).pop().as_ref(), Some(&last));
        let after = (
            contents(&last),
            fs::read(run.join("metrics.jsonl")).expect("metrics"),
        );
        assert!(before == after, "the refused update has left something");
    }
}
