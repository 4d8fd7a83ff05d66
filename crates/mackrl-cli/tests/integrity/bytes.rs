//! Damage to any byte of a run: every command that reads it refuses, warns, or gives the numbers of the undamaged run.

use std::{fs, path::Path, process::Command, time::Duration};

use super::{Ended, cases, copy, ended, files, random, signal};
use crate::support::{exits, mackrl, outcome, resume, train};

/// Commands that read a run, with what they are asked; `RUN` stands for its folder, `COPY` for an undamaged one.
const READERS: [&[&str]; 5] = [
    &["evaluate", "RUN", "--episodes", "2", "--json"],
    &["certify", "RUN", "--episodes", "1", "--json"],
    &["report", "RUN", "--json", "--resamples", "100"],
    &["plot", "RUN", "-o", "COPY.svg", "--json"],
    &["diff", "RUN", "COPY", "--no-replay", "--json"],
];

fn reader(words: &[&str], run: &Path, other: &Path) -> Command {
    let words: Vec<String> = (words.iter())
        .map(|word| match *word {
            "RUN" => run.display().to_string(),
            word => word.replace("COPY", &other.display().to_string()),
        })
        .collect();
    mackrl(&words.iter().map(String::as_str).collect::<Vec<_>>())
}

fn read(words: &[&str], run: &Path, other: &Path) -> Ended {
    ended(reader(words, run, other), Duration::from_secs(60))
}

/// Damages a file, and says how.
fn damage(path: &Path, other: &Path, random: &mut fastrand::Rng) -> String {
    let mut bytes = fs::read(path).expect("a file to damage");
    let at = random.usize(..bytes.len().max(1));
    let how = match random.u8(0..5) {
        0 | 1 if !bytes.is_empty() => {
            bytes[at] ^= 1 << random.u8(0..8);
            format!("bit flipped in byte {at}")
        }
        2 => {
            bytes.truncate(at);
            format!("cut to {at} bytes")
        }
        3 => {
            let all = bytes.clone();
            bytes.extend(all);
            "doubled".to_owned()
        }
        _ => {
            bytes = fs::read(other).unwrap_or_default();
            "that of another run".to_owned()
        }
    };
    fs::write(path, bytes).expect("a file can be damaged");
    how
}

#[test]
fn no_damage_to_a_finished_run_changes_a_number_in_silence() {
    let parent = tempfile::tempdir().expect("a folder for runs");
    let [whole, other, run] = ["whole", "other", "run"].map(|name| parent.path().join(name));
    let sparse = ["run.checkpoint_interval_steps_env=700"];
    exits(train(&whole, &sparse), 0);
    exits(
        train(
            &other,
            &["run.checkpoint_interval_steps_env=700", "run.seed=9"],
        ),
        0,
    );
    let readers = &READERS;
    copy(&whole, &run);
    let expected: Vec<Ended> = readers
        .iter()
        .map(|words| read(words, &run, &whole))
        .collect();
    for (words, expected) in readers.iter().zip(&expected) {
        assert_eq!(expected.code, 0, "{words:?}: {}", expected.stderr);
    }
    let mut random = random("bytes");
    let names = files(&whole);
    let count = cases(18);
    let mut refused = 0;
    for case in 0..count {
        let name = names[case % names.len()]
            .strip_prefix(&whole)
            .expect("a file of the run");
        fs::remove_dir_all(&run).expect("a copy can be removed");
        copy(&whole, &run);
        let how = damage(&run.join(name), &other.join(name), &mut random);
        for (words, expected) in readers.iter().zip(&expected) {
            let found = read(words, &run, &whole);
            let what = format!("{}: {how}: {words:?}: {}", name.display(), found.stderr);
            assert!(
                matches!(found.code, 0 | 1 | 2 | 64 | 65 | 74),
                "{} {what}",
                found.code
            );
            refused += usize::from(found.code != 0);
            let is_told = found.stderr.contains("warning");
            assert!(
                found.code != 0 || is_told || found.stdout == expected.stdout,
                "other numbers in silence: {what}"
            );
        }
    }
    println!(
        "damaged finished runs: {count} cases, {} commands, {refused} of them refused",
        count * readers.len()
    );
}

#[test]
fn no_damage_to_the_metrics_of_an_interrupted_run_costs_it_its_checkpoint() {
    let parent = tempfile::tempdir().expect("a folder for runs");
    let [whole, stopped, run] = ["whole", "stopped", "run"].map(|name| parent.path().join(name));
    let settings = [
        "run.steps_env=30000",
        "run.checkpoint_interval_steps_env=300",
    ];
    exits(train(&whole, &settings), 0);
    let expected = outcome(&whole);
    let mut child = train(&stopped, &settings)
        .spawn()
        .expect("the program starts");
    crate::support::wait_until(&mut child, || {
        crate::support::checkpoints(&stopped).len() > 1
    });
    signal(child.id(), "TERM");
    let code = child.wait().expect("a child can be waited for").code();
    assert_eq!(code, Some(75));
    let mut random = random("metrics");
    let count = cases(5);
    for case in 0..count {
        let _ = fs::remove_dir_all(&run);
        copy(&stopped, &run);
        let metrics = run.join("metrics.jsonl");
        let how = damage(&metrics, &whole.join("config.toml"), &mut random);
        let is_damaged = fs::read(&metrics).unwrap_or_default()
            != fs::read(stopped.join("metrics.jsonl")).expect("metrics");
        exits(
            mackrl(&["evaluate", &run.display().to_string(), "--episodes", "1"]),
            0,
        );
        let said = exits(resume(&run, 1), 0);
        let found = fs::read(run.join("weights.safetensors")).expect("weights");
        let wanted = fs::read(whole.join("weights.safetensors")).expect("weights");
        assert!(found == wanted, "case {case}: {how}");
        // What was only appended is cut off again.
        let is_whole = outcome(&run) == expected;
        assert!(
            is_whole || is_damaged && said.contains("warning"),
            "case {case}: {how}: {said}"
        );
    }
    println!("damaged metrics: {count} cases");
}
