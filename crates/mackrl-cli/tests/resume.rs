//! An interrupted run goes on as if it had never stopped.
#![cfg(unix)]

mod support;

use std::{
    fs,
    path::Path,
    process::{Child, Command},
    time::{Duration, Instant},
};

use support::{
    checkpoints, exits, has_unfinished_checkpoint, mackrl, outcome, resume, told, train,
    uninterrupted, wait_until,
};

/// Settings with which one update takes seconds.
const SLOW: &[&str] = &["algorithm.hidden=128", "algorithm.environments=128"];

fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill")
        .args(["-s", signal, &child.id().to_string()])
        .status();
    assert!(sent.expect("`kill` can be run").success(), "{signal}");
}

/// Sends a signal when `count` checkpoints were written, and expects an orderly stop.
fn stop(mut command: Command, run: &Path, signal: &str, count: usize) {
    let before = checkpoints(run).pop();
    let mut child = command.spawn().expect("the program starts");
    let mut seen = Vec::from_iter(before);
    let running = wait_until(&mut child, || {
        let latest = checkpoints(run)
            .pop()
            .filter(|path| path.extension().is_none());
        seen.extend(latest);
        seen.dedup();
        seen.len() > count
    });
    assert!(running, "the run ended before {signal}");
    send(signal, &child);
    let asked = Instant::now();
    let output = child.wait_with_output().expect("a child ends");
    assert!(asked.elapsed() < Duration::from_secs(5), "{signal}");
    let stderr = told(&output, 75);
    assert!(
        stderr.contains("hint: go on with `mackrl resume "),
        "{stderr}"
    );
    assert!(!has_unfinished_checkpoint(run), "{signal}");
}

#[test]
fn a_run_that_is_stopped_by_signals_ends_with_the_same_bytes() {
    let expected = uninterrupted();
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    stop(train(&run, &[]), &run, "TERM", 2);
    stop(resume(&run, 2), &run, "INT", 5);
    stop(resume(&run, 3), &run, "USR1", 3);
    exits(resume(&run, 1), 0);
    assert!(outcome(&run) == expected);
    exits(resume(&run, 1), 0);
    assert!(outcome(&run) == expected, "a finished run stays as it is");
}

#[test]
fn a_second_interrupt_stops_at_once() {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    let mut child = train(&run, SLOW).spawn().expect("the program starts");
    let metrics = run.join("metrics.jsonl");
    // After the first test come updates, each of which lasts longer than this test waits.
    assert!(wait_until(&mut child, || fs::metadata(&metrics)
        .is_ok_and(|metadata| metadata.len() > 0)));
    // The first asks; writing a checkpoint takes longer than the next ones need to arrive.
    while child.try_wait().expect("a child can be asked").is_none() {
        send("INT", &child);
        std::thread::sleep(Duration::from_millis(2));
    }
    let output = child.wait_with_output().expect("a child ends");
    told(&output, 130);
}

#[test]
fn a_run_of_a_large_team_stops_in_time_and_goes_on() {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    let large = ["env.map=27m_vs_30m", "algorithm.partitions=round-robin"];
    let settings: Vec<&str> = SLOW.iter().copied().chain(large).collect();
    // Neither its first test nor its first batch is anywhere near its end.
    for mut command in [train(&run, &settings), resume(&run, 2)] {
        let mut child = command.spawn().expect("the program starts");
        let record = run.join("run.json");
        let begun = || fs::read_to_string(&record).is_ok_and(|text| text.contains("running"));
        assert!(wait_until(&mut child, begun), "the run ended before TERM");
        std::thread::sleep(Duration::from_millis(700));
        send("TERM", &child);
        let asked = Instant::now();
        told(&child.wait_with_output().expect("a child ends"), 75);
        assert!(
            asked.elapsed() < Duration::from_secs(5),
            "{:?}",
            asked.elapsed()
        );
        assert!(!has_unfinished_checkpoint(&run), "a checkpoint was written");
        assert_eq!(checkpoints(&run).len(), 1);
    }
}

#[test]
fn a_folder_has_one_writer_and_an_unfinished_run_is_resumed_not_overwritten() {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    let mut child = train(&run, SLOW).spawn().expect("the program starts");
    assert!(wait_until(&mut child, || run
        .join("metrics.jsonl")
        .exists()));
    let stderr = exits(resume(&run, 1), 2);
    assert!(
        stderr.starts_with("error: another process is writing in "),
        "{stderr}"
    );
    child.kill().expect("a child can be killed");
    child.wait().expect("a child ends");
    let config = fs::read(run.join("config.toml")).expect("a configuration");
    let stderr = exits(train(&run, &[]), 2);
    assert!(
        stderr.contains("already holds an unfinished run"),
        "{stderr}"
    );
    let hint = format!("hint: go on with `mackrl resume {}`", run.display());
    assert!(stderr.contains(&hint), "{stderr}");
    assert_eq!(
        fs::read(run.join("config.toml")).expect("it is still there"),
        config
    );
}

#[test]
fn a_damaged_checkpoint_is_noticed_and_an_earlier_one_used() {
    let expected = uninterrupted();
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    stop(train(&run, &[]), &run, "TERM", 3);
    let evaluation = exits(
        mackrl(&["evaluate", "--episodes", "1", &run.to_string_lossy()]),
        0,
    );
    assert_eq!(evaluation, "", "an unfinished run can be evaluated");
    let flip = |path: &Path| {
        let path = path.join("tensors.safetensors");
        let mut tensors = fs::read(&path).expect("a checkpoint has tensors");
        let last = tensors.len() - 1;
        tensors[last] ^= 1;
        fs::write(&path, tensors).expect("a checkpoint can be damaged");
    };
    let all = checkpoints(&run);
    assert_eq!(all.len(), 2, "two checkpoints are kept");
    flip(&all[1]);
    let undamaged = all[0].join("tensors.safetensors");
    let kept = fs::read(&undamaged).expect("a checkpoint has tensors");
    flip(&all[0]);
    let stderr = exits(resume(&run, 1), 65);
    assert!(stderr.contains("is damaged"), "{stderr}");
    fs::write(&undamaged, kept).expect("a checkpoint can be mended");
    let stderr = exits(resume(&run, 1), 0);
    assert!(stderr.starts_with("warning: "), "{stderr}");
    assert!(
        stderr.contains("is not what manifest.json says; an earlier one is used"),
        "{stderr}"
    );
    assert!(outcome(&run) == expected);
}

#[test]
fn a_run_that_goes_on_has_an_event_file_for_each_process() {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    stop(train(&run, &["run.tensorboard=true"]), &run, "TERM", 2);
    exits(resume(&run, 1), 0);
    let names = fs::read_dir(&run).expect("a run folder").flatten();
    let events: Vec<_> = names
        .filter(|entry| {
            entry
                .file_name()
                .to_string_lossy()
                .starts_with("events.out.tfevents.")
        })
        .map(|entry| fs::read(entry.path()).expect("an event file"))
        .collect();
    assert_eq!(events.len(), 2);
    let name = b"test_battle_won_mean";
    let told = |events: &Vec<u8>| events.windows(name.len()).any(|part| part == name);
    assert!(events.iter().all(told), "both processes tested");
    let undisturbed = parent.path().join("undisturbed");
    exits(train(&undisturbed, &["run.tensorboard=true"]), 0);
    assert!(outcome(&run) == outcome(&undisturbed));
}

#[test]
fn a_finished_run_is_left_as_it_is() {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    exits(train(&run, &[]), 0);
    let files = || {
        ["weights.safetensors", "metrics.jsonl", "run.json"]
            .map(|name| fs::read(run.join(name)).expect("a finished run has its files"))
    };
    let before = files();
    fs::remove_dir_all(run.join("checkpoints")).expect("checkpoints can be removed");
    let stderr = exits(resume(&run, 1), 0);
    assert!(
        stderr.contains("is finished: nothing is left to do"),
        "{stderr}"
    );
    assert!(files() == before, "a finished run was touched");
}

/// A run that was planned for `planned` steps and then made longer, once for each length.
fn extended(run: &Path, planned: u64, lengths: &[&str]) -> String {
    exits(train(run, &[&format!("run.steps_env={planned}")]), 0);
    let mut told = String::new();
    for length in lengths {
        let mut command = resume(run, 2);
        command.args(["--steps", length]);
        told = exits(command, 0);
    }
    told
}

#[test]
fn a_run_that_is_made_longer_is_the_run_of_that_length() {
    let expected = uninterrupted().of_any_plan();
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = |name: &str| parent.path().join(name);
    let told = extended(&run("once"), 700, &["1_500"]);
    assert!(
        told.contains(
            "was planned for 700 environment steps and is now for 1500: it goes on from step "
        ),
        "{told}"
    );
    assert!(outcome(&run("once")).of_any_plan() == expected);
    // Twice, and once from where a test is due in any case.
    extended(&run("twice"), 300, &["1000", "1500"]);
    assert!(outcome(&run("twice")).of_any_plan() == expected);
    let record = fs::read_to_string(run("twice").join("run.json")).expect("a record");
    let record: serde_json::Value = serde_json::from_str(&record).expect("JSON");
    let former = record["former_plans"].as_array().expect("former plans");
    let lengths: Vec<_> = former.iter().map(|plan| &plan["steps_env"]).collect();
    assert_eq!(lengths, [300, 1000]);
    let config = fs::read_to_string(run("twice").join("config.toml")).expect("a configuration");
    assert!(config.contains("steps_env = 1500"), "{config}");
    // As one command more often than needed.
    let mut again = resume(&run("twice"), 1);
    again.args(["--steps", "1500"]);
    assert!(exits(again, 0).contains("is finished: nothing is left to do"));
    let mut shorter = resume(&run("twice"), 1);
    shorter.args(["--steps", "1400"]);
    let stderr = exits(shorter, 2);
    assert!(
        stderr.contains("is planned for 1500 environment steps, expected more"),
        "{stderr}"
    );
}

#[test]
fn a_run_without_a_checkpoint_before_its_end_goes_no_further_unless_it_is_short() {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    exits(
        train(&run, &["run.steps_env=400", "run.checkpoints_kept=1"]),
        0,
    );
    let before = fs::read(run.join("run.json")).expect("a record");
    let mut longer = resume(&run, 1);
    longer.args(["--steps", "1500"]);
    let stderr = exits(longer, 2);
    assert!(
        stderr.contains("keeps no checkpoint from before its end"),
        "{stderr}"
    );
    assert!(stderr.contains("hint: `mackrl train --from "), "{stderr}");
    assert!(
        fs::read(run.join("run.json")).expect("a record") == before,
        "it was touched"
    );
    // A run without any due checkpoint begins again.
    let rare = "run.checkpoint_interval_steps_env=100000";
    let [short, whole] = ["short", "whole"].map(|name| parent.path().join(name));
    exits(train(&short, &["run.steps_env=400", rare]), 0);
    let mut longer = resume(&short, 1);
    longer.args(["--steps", "600"]);
    assert!(exits(longer, 0).contains("it begins again"));
    exits(train(&whole, &["run.steps_env=600", rare]), 0);
    assert!(outcome(&short).of_any_plan() == outcome(&whole).of_any_plan());
}
