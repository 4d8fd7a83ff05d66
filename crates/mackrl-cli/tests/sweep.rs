//! Many runs from one plan: made, stopped, killed, continued, drawn and judged.

mod support;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    thread,
    time::{Duration, Instant},
};

use serde_json::Value;
use support::{exits, mackrl, outcome, uninterrupted};

/// The settings of the small run, as a plan has them.
const SETTINGS: &str = "run.metrics_interval_steps_env = 200\n\
     run.checkpoint_interval_steps_env = 1\n\
     algorithm.hidden = 8\n\
     algorithm.environments = 1\n\
     algorithm.target_interval_updates = 31\n\
     algorithm.exploration_steps_env = 1000\n\
     test.interval_steps_env = 500\n\
     run.weights_interval_steps_env = 400\n\
     test.episodes = 2\n";

/// Writes a plan of runs on 3m with so many environment steps.
fn plan(folder: &Path, algorithms: &str, seeds: &str, steps: u64) -> PathBuf {
    let path = folder.join("plan.toml");
    let text = format!(
        "maps = [\"3m\"]\nalgorithms = [{algorithms}]\nseeds = {seeds}\n\
         [settings]\nrun.steps_env = {steps}\n{SETTINGS}"
    );
    fs::write(&path, text).expect("a plan can be written");
    path
}

fn sweep(plan: &Path, words: &[&str]) -> Command {
    let mut command = mackrl(&["sweep"]);
    command
        .arg(plan)
        .args(words)
        .arg("--out")
        .arg(plan.with_file_name("out"));
    command
}

/// The states of a plan's runs, and the environment steps behind them.
fn states(plan: &Path) -> Vec<(String, u64)> {
    let listed = json(sweep(plan, &["--list", "--json"]));
    let of = |run: &Value| {
        let state = run["state"].as_str().expect("a state").to_owned();
        (state, run["steps_env"].as_u64().expect("steps"))
    };
    listed.as_array().expect("a list").iter().map(of).collect()
}

fn json(mut command: Command) -> Value {
    let output = command.output().expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    serde_json::from_slice(&output.stdout).expect("stdout is JSON")
}

#[test]
fn a_sweep_makes_the_runs_that_train_makes_and_others_look_at_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let plan = plan(folder.path(), "\"mackrl\", \"central-v\"", "[3, 4]", 1500);
    assert_eq!(states(&plan), vec![("waiting".to_owned(), 0); 4]);
    exits(sweep(&plan, &["--jobs", "2"]), 0);
    assert!(states(&plan).iter().all(|(state, _)| state == "finished"));
    let out = folder.path().join("out");
    assert!(
        outcome(&out.join("3m-mackrl-seed3")) == uninterrupted(),
        "a run of a sweep is another than that of train"
    );
    let begun = Instant::now();
    let again = json(sweep(&plan, &["--json"]));
    assert_eq!(again.as_array().map(Vec::len), Some(4));
    assert!(
        begun.elapsed() < Duration::from_secs(20),
        "runs were repeated"
    );

    for file in ["curves.svg", "curves.png"] {
        let mut plot = mackrl(&["plot", "--statistic", "iqm", "-o"]);
        plot.arg(folder.path().join(file)).arg(&out);
        exits(plot, 0);
    }
    let svg = fs::read_to_string(folder.path().join("curves.svg")).expect("a drawing");
    assert!(
        svg.contains("MACKRL (2)") && svg.contains("Central-V (2)"),
        "{svg}"
    );

    let exported = folder.path().join("marl-eval.json");
    let mut report = mackrl(&[
        "report",
        "--json",
        "--resamples",
        "1000",
        "--export-marl-eval",
    ]);
    report.arg(&exported).arg(&out);
    let found = json(report);
    let algorithms = &found["maps"][0]["algorithms"];
    assert_eq!(algorithms[0]["runs"], 2);
    assert_eq!(algorithms[1]["steps_to"][2]["level"], 0.9);
    assert!(
        found["maps"][0]["comparisons"][0]["probability_of_improvement"]["estimate"].is_number()
    );
    assert_eq!(
        found["provenance"].as_array().map(Vec::len),
        Some(2),
        "two experiments"
    );
    let exported: Value =
        serde_json::from_slice(&fs::read(exported).expect("an export")).expect("JSON");
    let run = &exported["SMAC"]["3m"]["MACKRL"]["seed_3"];
    assert_eq!(run["step_2"]["step_count"], 1000);
    assert!(run["absolute_metrics"]["win_rate"][0].is_number(), "{run}");
}

#[test]
fn runs_that_are_unlike_are_not_taken_together_unasked() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = plan(folder.path(), "\"central-v\"", "1", 500);
    exits(sweep(&path, &[]), 0);
    let other = plan(folder.path(), "\"central-v\"", "1", 501);
    let refusal = exits(sweep(&other, &[]), 2);
    assert!(
        refusal.contains("another configuration: `run.steps_env`"),
        "{refusal}"
    );
    fs::rename(folder.path().join("out"), folder.path().join("first")).expect("a move");
    exits(sweep(&other, &[]), 0);

    let report = |words: &[&str]| {
        let mut report = mackrl(&["report"]);
        report.args(words).arg(folder.path());
        report
    };
    let refusal = exits(report(&[]), 2);
    assert!(
        refusal.contains("differ in run.steps_env: 500 and 501"),
        "{refusal}"
    );
    assert!(
        refusal.contains("hint: tell them apart with --by run.steps_env"),
        "{refusal}"
    );
    exits(report(&["--mix"]), 0);
    exits(report(&["--by", "run.steps_env"]), 0);
    let nowhere = exits(report(&["--map", "2s3z"]), 2);
    assert!(nowhere.contains("expected 3m"), "{nowhere}");
    let unknown = exits(report(&["--mix", "--metric", "test_return_maen"]), 2);
    assert!(
        unknown.contains("did you mean `test_return_mean`?"),
        "{unknown}"
    );
}

#[test]
fn an_entry_asks_to_be_started_again_and_goes_on_where_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let plan = plan(folder.path(), "\"central-v\"", "2", 1_000_000_000);
    let one = ["--index", "1", "--threads", "1", "--time-limit", "1s"];
    exits(sweep(&plan, &one), 75);
    let before = states(&plan);
    assert_eq!(before[0], ("waiting".to_owned(), 0));
    assert!(before[1].0 == "stopped" && before[1].1 > 0, "{before:?}");
    exits(sweep(&plan, &one), 75);
    let after = states(&plan);
    assert!(after[1].1 > before[1].1, "{before:?} {after:?}");
    let refusal = exits(sweep(&plan, &["--index", "2"]), 2);
    assert!(
        refusal.contains("the plan has 2 runs, expected 0 to 1"),
        "{refusal}"
    );
}

#[test]
fn a_sweep_that_is_stopped_or_killed_leaves_no_run_behind() {
    let folder = tempfile::tempdir().expect("a folder");
    let plan = plan(folder.path(), "\"central-v\"", "2", 1_000_000_000);
    let stopped = exits(sweep(&plan, &["--jobs", "2", "--time-limit", "1s"]), 75);
    assert!(
        stopped.contains("note: stopped when 0 of 2 runs were finished"),
        "{stopped}"
    );
    assert!(states(&plan).iter().all(|(state, _)| state == "stopped"));

    let mut child = sweep(&plan, &["--jobs", "2"])
        .spawn()
        .expect("the program starts");
    let everywhere = |state: &str| states(&plan).iter().all(|(found, _)| found == state);
    wait_until(|| everywhere("running"));
    child.kill().expect("a child can be killed");
    child.wait().expect("a child can be awaited");
    wait_until(|| everywhere("stopped"));
}

#[test]
fn a_block_is_made_on_a_disk_of_the_machine_and_its_folders_have_everything() {
    let folder = tempfile::tempdir().expect("a folder");
    let plan = plan(folder.path(), "\"mackrl\"", "[1, 2, 3]", 1500);
    let scratch = folder.path().join("disk");
    let on_disk = ["--scratch", scratch.to_str().expect("a path in UTF-8")];
    let block = |index: &'static str| {
        let mut command = sweep(&plan, &["--index", index, "--block", "2", "--jobs", "2"]);
        command.args(on_disk);
        command
    };
    exits(block("1"), 0);
    let found: Vec<String> = states(&plan).into_iter().map(|(state, _)| state).collect();
    assert_eq!(found, ["waiting", "waiting", "finished"]);
    let run = folder.path().join("out/3m-mackrl-seed3");
    assert!(
        outcome(&run) == uninterrupted(),
        "a run on scratch is another"
    );
    let left = fs::read_dir(&scratch).expect("a disk").count();
    assert_eq!(left, 0, "something is left on the disk");
    assert!(!run.join("lock").exists());
    let refusal = exits(block("2"), 2);
    assert!(
        refusal.contains("the plan has 3 runs, 2 blocks of 2, expected 0 to 1"),
        "{refusal}"
    );
}

#[test]
fn a_run_that_is_stopped_on_a_disk_of_the_machine_goes_on_without_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let plan = plan(folder.path(), "\"central-v\"", "1", 1_000_000_000);
    let scratch = folder.path().join("disk");
    let on_disk = ["--scratch", scratch.to_str().expect("a path in UTF-8")];
    let mut child = sweep(&plan, &on_disk).spawn().expect("the program starts");
    let listed = || json(sweep(&plan, &["--list", "--json"]))[0].clone();
    wait_until(|| listed()["checkpoint"].is_string() && listed()["where"].is_object());
    let place = listed()["where"].clone();
    assert_eq!(place["process"], child.id());
    let made_in = place["scratch"].as_str().expect("a folder");
    assert!(Path::new(made_in).starts_with(&scratch), "{made_in}");
    child.kill().expect("a child can be killed");
    child.wait().expect("a child can be awaited");
    wait_until(|| listed()["state"] == "stopped");
    let before = listed()["steps_env"].as_u64();
    fs::remove_dir_all(&scratch).expect("a disk that is lost");
    exits(sweep(&plan, &["--index", "0", "--time-limit", "2s"]), 75);
    assert!(listed()["steps_env"].as_u64() > before);
}

#[test]
fn failed_runs_say_why_and_are_made_again_alone_when_that_is_asked() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("plan.toml");
    let text = format!(
        "maps = [\"8m\"]\nalgorithms = [\"mackrl\"]\nseeds = 1\n[settings]\nrun.steps_env = 2000\n{SETTINGS}\
         [variants.fine]\n[variants.huge]\nenv.reward_negative_scale = 1e9\n\
         env.reward_death_value = 1e9\nenv.reward_only_positive = false\nenv.reward_scale = false\n\
         algorithm.gradient_norm_max = 1e30\nrun.steps_env = 20000\n"
    );
    fs::write(&path, text).expect("a plan");
    let told = exits(sweep(&path, &["--jobs", "2"]), 65);
    assert!(
        told.contains("1 of 2 runs failed: 8m-mackrl-huge"),
        "{told}"
    );
    let failed = json(sweep(&path, &["--list", "--json", "--retry", "failed"]));
    assert_eq!(failed.as_array().map(Vec::len), Some(1));
    assert_eq!(failed[0]["index"], 1);
    let why = failed[0]["failure"].as_str().expect("a reason");
    assert!(why.starts_with("the run cannot go on: "), "{why}");
    let told = exits(sweep(&path, &["--retry", "failed"]), 65);
    assert!(told.contains("1 of 1 runs failed"), "{told}");
}

#[cfg(unix)]
#[test]
fn a_batch_script_asks_for_what_is_left_and_needs() {
    let folder = tempfile::tempdir().expect("a folder");
    let plan = plan(folder.path(), "\"central-v\"", "5", 1500);
    exits(sweep(&plan, &["--index", "1", "--block", "2"]), 0);
    let output = sweep(&plan, &["--slurm", "--block", "2", "--jobs", "2"])
        .output()
        .expect("the program starts");
    let script = String::from_utf8(output.stdout).expect("a script");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}");
    assert!(told.contains("3m-central-v-seed1: "), "{told}");
    for part in [
        "#SBATCH --job-name=plan --array=0,2\n",
        "--cpus-per-task=2\n",
        "#SBATCH --time=00:0",
        " --index \"$SLURM_ARRAY_TASK_ID\" --block 2 --jobs 2\n",
    ] {
        assert!(script.contains(part), "{part} is missing:\n{script}");
    }
    let shell = Command::new("sh").args(["-n", "-c", &script]).status();
    assert!(shell.expect("a shell").success(), "{script}");
    exits(sweep(&plan, &[]), 0);
    let refusal = exits(sweep(&plan, &["--slurm"]), 2);
    assert!(refusal.contains("nothing is left to do"), "{refusal}");
}

/// Waits until `condition` holds, for a minute at most.
fn wait_until(condition: impl Fn() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(
            begun.elapsed() < Duration::from_secs(60),
            "nothing happened for a minute"
        );
        thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn a_broken_plan_is_told_by_line_and_column() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("plan.toml");
    fs::write(
        &path,
        "maps = [\"3m\"]\nseeds = 2\n[settings]\nalgorithm.gama = 0.5\n",
    )
    .expect("a plan");
    let refusal = exits(sweep(&path, &[]), 64);
    assert!(
        refusal.contains("plan.toml:4:18: unknown key `algorithm.gama`"),
        "{refusal}"
    );
    fs::write(&path, [0xFF, 0xFE]).expect("a plan");
    let refusal = exits(sweep(&path, &[]), 64);
    assert!(refusal.contains("not UTF-8 text at byte 0"), "{refusal}");
    exits(sweep(&folder.path().join("none.toml"), &[]), 74);
}
