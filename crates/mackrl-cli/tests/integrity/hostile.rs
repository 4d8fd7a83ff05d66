//! Folders of strangers: whatever stands under a run's names, no command hangs, needs much memory, or tells what is elsewhere.

use std::{
    fs::{self, File},
    os::unix::{fs::symlink, net::UnixListener},
    path::Path,
    process::Command,
    time::Duration,
};

use super::{copy, ended};
use crate::support::{exits, train};

const SECRET: &str = "the-words-of-a-secret";
/// Longest that a command may take; machines that do other things as well are slow.
const LIMIT: Duration = Duration::from_secs(30);
/// Address space of a command, in KiB: half of it is what the program and its threads reserve.
const MEMORY_KIB: u32 = 1 << 20;

/// Every command that reads a run folder; `RUN` stands for it, `COPY` for a good one, `PLAN` for a plan whose run it is.
const COMMANDS: [&str; 12] = [
    "evaluate RUN --episodes 1 --save-replays 1",
    "certify RUN --episodes 1",
    "resume RUN --threads 1",
    "report RUN --unfinished --resamples 100",
    "plot RUN --unfinished -o COPY.svg",
    "diff RUN COPY --no-replay",
    "diff COPY RUN --no-replay",
    "diff RUN/checkpoints COPY/checkpoints",
    "sweep PLAN --list",
    "train --map 3m --steps 100 --threads 1 --out RUN",
    "replay RUN/replays/a.replay.gz --html /dev/null",
    "config --config RUN/config.toml --print",
];

/// Puts something hostile in the place of a name.
fn place(kind: &str, path: &Path, secret: &Path) {
    let _ = fs::remove_dir_all(path);
    let _ = fs::remove_file(path);
    match kind {
        "pipe" => {
            let made = Command::new("mkfifo").arg(path).status();
            assert!(made.expect("mkfifo starts").success(), "a pipe can be made");
        }
        "endless" => symlink("/dev/zero", path).expect("a link"),
        "secret" => symlink(secret, path).expect("a link"),
        "socket" => drop(UnixListener::bind(path).expect("a socket")),
        "folder" => fs::create_dir(path).expect("a folder"),
        "huge" => {
            let file = File::create(path).expect("a file");
            file.set_len(1 << 30).expect("a file with a hole");
        }
        other => panic!("unknown: {other}"),
    }
}

#[test]
fn no_command_is_led_astray_by_a_strangers_folder() {
    // Paths of sockets are short.
    let parent = tempfile::tempdir_in("/tmp").expect("a folder for runs");
    let [good, run] = ["good", "sweep/3m-mackrl-seed3"].map(|name| parent.path().join(name));
    exits(train(&good, &["run.checkpoint_interval_steps_env=700"]), 0);
    fs::create_dir(good.join("replays")).expect("a folder for replays");
    fs::write(good.join("replays/a.replay.gz"), "no replay").expect("a replay");
    let secret = parent.path().join("secret");
    fs::write(&secret, format!("{{\"t_env\": \"{SECRET}\"}}\n{SECRET}\n")).expect("a secret");
    let plan = parent.path().join("plan.toml");
    let sweep = parent.path().join("sweep");
    let text = format!(
        "out = {:?}\nmaps = [\"3m\"]\nalgorithms = [\"mackrl\"]\nseeds = [3]\n",
        sweep
    );
    fs::write(&plan, text).expect("a plan");
    let names = [
        "config.toml",
        "metrics.jsonl",
        "run.json",
        "weights.safetensors",
        "weights",
        "weights/best.safetensors",
        "lock",
        "checkpoints",
        "replays",
        "run.json.tmp",
        "metrics.jsonl.damaged",
        "replays/a.replay.gz",
        "checkpoints/LAST/tensors.safetensors",
        "checkpoints/LAST/manifest.json",
    ];
    let last = crate::support::checkpoints(&good)
        .pop()
        .expect("a checkpoint");
    let last = last
        .file_name()
        .expect("a name")
        .to_string_lossy()
        .into_owned();
    let program = assert_cmd::cargo::cargo_bin("mackrl");
    let mut count = 0;
    let all = std::env::var_os("MACKRL_CASES").is_some();
    for (n, name) in names.iter().enumerate() {
        for (k, kind) in ["pipe", "endless", "secret", "socket", "folder", "huge"]
            .iter()
            .enumerate()
        {
            for (c, command) in COMMANDS.iter().enumerate() {
                // A quick run takes some of all, other ones for each name.
                if !all && (n + 5 * k + 7 * c) % 9 != 0 {
                    continue;
                }
                let _ = fs::remove_dir_all(&run);
                copy(&good, &run);
                let path = run.join(name.replace("LAST", &last));
                place(kind, &path, &secret);
                let typed = command
                    .replace("RUN", &run.display().to_string())
                    .replace("COPY", &good.display().to_string())
                    .replace("PLAN", &plan.display().to_string());
                let limited = format!("ulimit -v {MEMORY_KIB}; exec {} {typed}", program.display());
                let mut shell = Command::new("sh");
                shell.args(["-c", &limited]);
                let found = ended(shell, LIMIT);
                let what = format!(
                    "{kind} at {name}: {command}: {} {}",
                    found.code, found.stderr
                );
                assert!(
                    matches!(found.code, 0 | 1 | 2 | 64 | 65 | 74 | 75),
                    "{what}"
                );
                assert!(
                    !found.stderr.contains(SECRET) && !found.stdout.contains(SECRET),
                    "{what}"
                );
                count += 1;
            }
        }
    }
    let kept = fs::read_to_string(&secret).expect("the secret is there");
    assert!(
        kept.starts_with("{\"t_env\""),
        "the secret was not written to"
    );
    println!("hostile folders: {count} cases");
}
