//! A small run, and what is compared of it.
#![allow(dead_code, reason = "each test file uses its own part")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    time::{Duration, Instant},
};

/// A run of some forty updates, with a test now and then and a checkpoint after each of them: most of its time goes into
/// writing checkpoints.
const SMALL: &[&str] = &[
    "run.steps_env=1500",
    "run.seed=3",
    "run.metrics_interval_steps_env=200",
    "run.checkpoint_interval_steps_env=1",
    "run.weights_interval_steps_env=400",
    "algorithm.name=mackrl",
    "algorithm.hidden=8",
    "algorithm.environments=1",
    "algorithm.target_interval_updates=31",
    "algorithm.exploration_steps_env=1000",
    "test.interval_steps_env=500",
    "test.episodes=2",
];

/// What must be the same whatever happened to a run on its way.
#[derive(PartialEq)]
pub(crate) struct Outcome {
    weights: Vec<u8>,
    /// Names and content of the weights that are kept beside the last.
    kept: Vec<(PathBuf, Vec<u8>)>,
    /// How the teams play, and hashes of what the run ended with, its metrics aside.
    record: [serde_json::Value; 2],
    /// Tensors, counters and best weights of the last checkpoint.
    checkpoint: [Vec<u8>; 3],
    /// Rows without what depends on the clock.
    metrics: Vec<String>,
}

impl Outcome {
    /// The same without what names the configuration: of a run that was made longer, what was written before names the former one.
    pub(crate) fn of_any_plan(mut self) -> Self {
        for (_, weights) in &mut self.kept {
            forget_configuration(weights);
        }
        forget_configuration(&mut self.checkpoint[2]);
        let files = self.record[1].as_object_mut().expect("hashes");
        files.retain(|name, _| !name.starts_with("weights/"));
        for row in &mut self.metrics {
            let mut values: serde_json::Map<String, serde_json::Value> =
                serde_json::from_str(row).expect("a row is a JSON object");
            values.remove("provenance");
            *row = serde_json::to_string(&values).expect("a row can be written");
        }
        self
    }
}

/// Blanks the hash of the configuration in a file of weights.
fn forget_configuration(weights: &mut [u8]) {
    let name = br#""config_sha256":""#;
    let at = weights.windows(name.len()).position(|part| part == name);
    let start = at.expect("weights describe themselves") + name.len();
    weights[start..start + 64].fill(b'0');
}

/// `mackrl`, with these words.
pub(crate) fn mackrl(words: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("mackrl"));
    command
        .args(words)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// The command that begins the small run in `folder`, with further settings.
pub(crate) fn train(folder: &Path, settings: &[&str]) -> Command {
    train_on(1, folder, settings)
}

/// As [`train`], on some threads.
pub(crate) fn train_on(threads: usize, folder: &Path, settings: &[&str]) -> Command {
    let threads = threads.to_string();
    let mut command = mackrl(&["train", "--map", "3m", "--threads", &threads, "--out"]);
    command.arg(folder);
    for setting in SMALL.iter().chain(settings) {
        command.args(["--set", setting]);
    }
    command
}

/// The command that goes on with the run in `folder`.
pub(crate) fn resume(folder: &Path, threads: usize) -> Command {
    let mut command = mackrl(&["resume", "--threads", &threads.to_string()]);
    command.arg(folder);
    command
}

/// Runs to the end, and expects this exit code; gives what stderr holds.
pub(crate) fn exits(mut command: Command, code: i32) -> String {
    let output = command.output().expect("the program starts");
    told(&output, code)
}

/// Expects that a process ended with this exit code; gives what stderr holds.
pub(crate) fn told(output: &Output, code: i32) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    stderr
}

/// Waits until `condition` holds, for a minute at most; gives `false` if the process ended before.
pub(crate) fn wait_until(child: &mut Child, mut condition: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(60) {
        if condition() {
            return true;
        }
        if child.try_wait().expect("a child can be asked").is_some() {
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("nothing happened for a minute");
}

/// The folders of checkpoints in a run: names, in order.
pub(crate) fn checkpoints(run: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(run.join("checkpoints")).into_iter().flatten();
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

/// Whether a checkpoint is being written, or was when the process was killed.
pub(crate) fn has_unfinished_checkpoint(run: &Path) -> bool {
    checkpoints(run)
        .iter()
        .any(|path| path.extension().is_some())
}

/// What a finished run left.
pub(crate) fn outcome(run: &Path) -> Outcome {
    let read =
        |path: PathBuf| fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let last = checkpoints(run)
        .pop()
        .expect("a run ends with a checkpoint");
    let metrics = String::from_utf8(read(run.join("metrics.jsonl"))).expect("metrics are UTF-8");
    assert!(metrics.ends_with('\n'), "metrics end on a whole line");
    let mut kept: Vec<(PathBuf, Vec<u8>)> = fs::read_dir(run.join("weights"))
        .expect("a run keeps weights")
        .map(|entry| entry.expect("a name").path())
        .map(|path| (path.file_name().expect("a name").into(), read(path)))
        .collect();
    kept.sort();
    let record = read(run.join("run.json"));
    let mut record: serde_json::Value = serde_json::from_slice(&record).expect("run.json is JSON");
    // Metrics hold what depends on the clock.
    let files = record["files"].as_object_mut().expect("hashes");
    files.remove("metrics.jsonl");
    Outcome {
        kept,
        record: ["teams", "files"].map(|name| record[name].take()),
        weights: read(run.join("weights.safetensors")),
        checkpoint: ["tensors.safetensors", "counters.json", "best.safetensors"]
            .map(|name| read(last.join(name))),
        metrics: metrics.lines().map(without_clock).collect(),
    }
}

fn without_clock(row: &str) -> String {
    let mut row: serde_json::Map<String, serde_json::Value> =
        serde_json::from_str(row).expect("a row is a JSON object");
    row.retain(|name, _| !name.starts_with("sys/"));
    serde_json::to_string(&row).expect("a row can be written")
}

/// What the small run leaves when nothing happens to it.
pub(crate) fn uninterrupted() -> Outcome {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    exits(train(&run, &[]), 0);
    outcome(&run)
}
