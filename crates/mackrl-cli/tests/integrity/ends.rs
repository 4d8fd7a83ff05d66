//! The ends of every number that can be typed, and words that are no text: an exit code of the documented ones, and never a panic.

use std::{ffi::OsString, os::unix::ffi::OsStringExt, time::Duration};

use super::ended;
use crate::support::{exits, mackrl, train};

/// Commands with a number `N`; `RUN` stands for a finished run.
const NUMBERS: [&str; 24] = [
    "evaluate RUN --episodes N",
    "evaluate RUN --episodes 1 --seed N",
    "evaluate RUN --episodes 1 --threads N",
    "evaluate RUN --episodes 1 --save-replays N",
    "certify RUN --episodes N",
    "certify RUN --episodes 1 --seed N",
    "report RUN --at N --resamples 100",
    "report RUN --resamples N",
    "bench update --rows N --updates 1 --steps 1",
    "bench update --steps N --updates 1 --rows 1",
    "bench update --updates N --rows 1 --steps 1",
    "bench env --map 3m --steps N",
    "bench env --map 3m --steps 10 --threads N",
    "play --map 3m --episodes N",
    "play --map 3m --episodes 1 --seed N",
    "play --map 3m --episodes 1 --threads N",
    "fidelity --map 3m --episodes N",
    "train --map 3m --steps N --out OUT",
    "train --map 3m --steps 10 --seed N --out OUT",
    "train --map 3m --steps 10 --threads N --out OUT",
    "reproduce figure5 --runs N --points 2 --threads 1 --out OUT",
    "serve RUN --port N",
    "replay RUN/none --step N",
    "explain RUN/none --step N",
];
/// Exit codes that the program documents; -2 is one that goes on, as with an enormous number it may.
const DOCUMENTED: [i32; 9] = [0, 1, 2, 64, 65, 74, 75, -2, -1];

#[test]
fn the_ends_of_every_number_are_taken_or_refused_in_order() {
    let parent = tempfile::tempdir().expect("a folder for the run");
    let run = parent.path().join("run");
    exits(train(&run, &["run.checkpoint_interval_steps_env=700"]), 0);
    let mut count = 0;
    for (number, command) in NUMBERS.iter().enumerate() {
        for (end, value) in [
            "0",
            "1",
            "18446744073709551614",
            "18446744073709551615",
            "-1",
            "nan",
        ]
        .iter()
        .enumerate()
        {
            let out = parent
                .path()
                .join(format!("out{number}-{end}"))
                .display()
                .to_string();
            let words: Vec<String> = command
                .split(' ')
                .map(|word| match word {
                    "N" => (*value).to_owned(),
                    "OUT" => out.clone(),
                    word => word.replace("RUN", &run.display().to_string()),
                })
                .collect();
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let found = ended(mackrl(&words), Duration::from_millis(1500));
            let what = format!("{command} with {value}: {} {}", found.code, found.stderr);
            assert!(DOCUMENTED.contains(&found.code), "{what}");
            // A process that was killed here has no code; one that killed itself said why.
            assert!(
                found.code != -1 && !found.stderr.contains("panicked"),
                "{what}"
            );
            count += 1;
        }
    }
    println!("ends of numbers: {count} cases");
}

#[test]
fn words_that_are_no_text_and_names_that_control_terminals_do_no_harm() {
    let parent = tempfile::tempdir().expect("a folder for the runs");
    let mut count = 0;
    let long = "x".repeat(4_000);
    for word in [&b"np\xff"[..], b"e\x1b[2Jc", b"new\nline", long.as_bytes()] {
        let mut name = parent.path().as_os_str().to_owned();
        name.push("/");
        name.push(OsString::from_vec(word.to_vec()));
        for words in [
            &[
                "train",
                "--map",
                "3m",
                "--steps",
                "300",
                "--threads",
                "1",
                "--set",
                "algorithm.hidden=4",
                "--out",
            ][..],
            &["evaluate", "--episodes", "1"],
            &["resume", "--threads", "1"],
            &["report"],
            &["plot", "-o", "/tmp/x.svg"],
            &["maps", "--check"],
            &["sweep", "--list"],
            &["diff", "x"],
        ] {
            let mut command = mackrl(words);
            command.arg(&name);
            let found = ended(command, Duration::from_secs(30));
            let what = format!("{words:?} {word:?}: {} {}", found.code, found.stderr);
            assert!([0, 1, 2, 64, 65, 74].contains(&found.code), "{what}");
            assert!(
                !found.stdout.contains('\u{1b}') && !found.stderr.contains("\u{1b}[2J"),
                "{what}"
            );
            count += 1;
        }
    }
    println!("words that are no text: {count} cases");
}
