//! Killing a run at any instant costs nothing that was written.
//!
//! `MACKRL_KILLS=5000 cargo test --release -p mackrl-cli --test crash` kills more often.
#![cfg(unix)]

mod support;

use std::{path::Path, process::Command, time::Duration};

use support::{
    exits, has_unfinished_checkpoint, outcome, resume, train, uninterrupted, wait_until,
};

/// Kills that are dealt out unless the environment asks for another number.
const KILLS: usize = 48;
/// The longest life of a process that is killed blindly.
const LIFE_MAX_MS: f64 = 400.0;

/// Kills a process with SIGKILL: every second time blindly, otherwise when a checkpoint is being written.
fn kill(mut command: Command, run: &Path, number: usize) -> bool {
    let mut child = command.spawn().expect("the program starts");
    // Multiples of the golden ratio fill the interval evenly, in an order without a pattern.
    let share = (number as f64 * 0.618_033_988_749_895).fract();
    if number.is_multiple_of(2) {
        std::thread::sleep(Duration::from_secs_f64(share * LIFE_MAX_MS / 1e3));
    } else if wait_until(&mut child, || has_unfinished_checkpoint(run)) {
        std::thread::sleep(Duration::from_secs_f64(share * 10.0 / 1e3));
    }
    child.kill().expect("a child can be killed");
    let output = child.wait_with_output().expect("a child ends");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(!stderr.contains("damaged"), "kill {number}: {stderr}");
    assert!(!stderr.contains("error:"), "kill {number}: {stderr}");
    !output.status.success()
}

/// The command that begins the run, or goes on with it.
fn next(run: &Path, number: usize) -> Command {
    if run.join("config.toml").exists() {
        resume(run, 1 + number % 2)
    } else {
        train(run, &[])
    }
}

#[test]
fn a_run_that_is_killed_again_and_again_ends_with_the_same_bytes() {
    let kills = std::env::var("MACKRL_KILLS").map_or(KILLS, |text| {
        text.parse().expect("MACKRL_KILLS is a number of kills")
    });
    let expected = uninterrupted();
    let (mut killed, mut while_writing, mut number) = (0, 0, 0);
    while killed < kills {
        let parent = tempfile::tempdir().expect("a folder for the run");
        let run = parent.path().join("run");
        let ended = |run: &Path| run.join("weights.safetensors").exists();
        while killed < kills && !ended(&run) {
            number += 1;
            killed += usize::from(kill(next(&run, number), &run, number));
            while_writing += usize::from(has_unfinished_checkpoint(&run));
        }
        exits(next(&run, number), 0);
        assert!(outcome(&run) == expected, "after {killed} kills");
        assert!(!has_unfinished_checkpoint(&run), "leftovers are removed");
    }
    assert!(
        while_writing >= kills / 8,
        "only {while_writing} of {killed} kills met a checkpoint being written"
    );
}
