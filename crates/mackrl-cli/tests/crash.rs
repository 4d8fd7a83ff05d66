//! Killing a run at any instant, and a disk that takes no more, cost nothing that was written.
//!
//! `MACKRL_KILLS=5000 cargo test --release -p mackrl --features slow-tests --test crash -- --nocapture` kills more often.
#![cfg(unix)]

mod support;

use std::{
    path::Path,
    process::{Command, Stdio},
    time::Duration,
};

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
    let (mut killed, mut while_writing, mut number, mut runs) = (0, 0, 0, 0);
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
        runs += 1;
        assert!(outcome(&run) == expected, "after {killed} kills");
        assert!(!has_unfinished_checkpoint(&run), "leftovers are removed");
    }
    println!("{killed} kills, {while_writing} of them met a checkpoint being written; {runs} runs");
    assert!(
        while_writing >= kills / 8,
        "only {while_writing} of {killed} kills met a checkpoint being written"
    );
}

/// The command, where no file can grow beyond so many blocks of 512 bytes: the last write is cut short, as on a full disk.
fn limited(command: &Command, blocks: u32) -> Command {
    let mut limited = Command::new("sh");
    limited
        .arg("-c")
        .arg(format!(
            "trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\""
        ))
        .arg(command.get_program())
        .args(command.get_args())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    limited
}

#[test]
fn a_disk_that_takes_no_more_stops_the_run_and_loses_nothing() {
    // Rows of metrics outgrow checkpoints.
    let settings = ["algorithm.hidden=2", "run.metrics_interval_steps_env=1"];
    let parent = tempfile::tempdir().expect("a folder for the runs");
    let undisturbed = parent.path().join("undisturbed");
    exits(train(&undisturbed, &settings), 0);
    let expected = outcome(&undisturbed);
    // No room for the best weights or the first checkpoint; for some rows of metrics; for most.
    for (blocks, at) in [
        (20, ".safetensors"),
        (50, "metrics.jsonl"),
        (80, "metrics.jsonl"),
    ] {
        let run = parent.path().join(format!("limited-{blocks}"));
        let stderr = exits(limited(&train(&run, &settings), blocks), 74);
        let told = stderr
            .lines()
            .find(|line| line.starts_with("error: cannot write "));
        let told = told.unwrap_or_else(|| panic!("{stderr}"));
        assert!(told.contains(at) && told.contains(" bytes)"), "{told}");
        assert!(stderr.contains("hint: make room"), "{stderr}");
        exits(resume(&run, 2), 0);
        assert!(outcome(&run) == expected, "{blocks} blocks");
    }
}
