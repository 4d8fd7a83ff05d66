//! Figures 6 and 7 in miniature: two seeds, two thousand steps.

use std::{fs, path::Path, process::Output, time::SystemTime};

use assert_cmd::Command;
use serde_json::Value;

fn reproduce(figure: &str, folder: &Path, jobs: &str) -> Output {
    Command::cargo_bin("mackrl")
        .expect("the program is built")
        .args([
            "reproduce",
            figure,
            "--seeds",
            "2",
            "--steps",
            "2000",
            "--interval",
            "1000",
        ])
        .args(["--json", "--jobs", jobs, "--out"])
        .arg(folder)
        .output()
        .expect("the program starts")
}

fn report(output: &Output) -> Value {
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    serde_json::from_slice(&output.stdout).expect("the report is JSON")
}

fn written(folder: &Path) -> Vec<(String, SystemTime)> {
    let entries = fs::read_dir(folder.join("runs")).expect("runs were written");
    let mut files: Vec<_> = entries
        .map(|entry| {
            let entry = entry.expect("a file");
            let time = entry.metadata().and_then(|m| m.modified()).expect("a time");
            (entry.file_name().to_string_lossy().into_owned(), time)
        })
        .collect();
    files.sort();
    files
}

#[test]
fn finished_runs_are_used_again_and_jobs_change_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let first = report(&reproduce("figure6", folder.path(), "1"));
    let files = written(folder.path());
    assert_eq!(files.len(), 8, "two maps, two learners, two seeds");
    assert_eq!(first["steps"], serde_json::json!([0, 1000, 2000]));
    assert_eq!(first["panels"][1]["map"], "2s3z");
    assert_eq!(first["panels"][0]["mackrl"]["runs"], 2);
    assert_eq!(
        first["claims"].as_array().map(Vec::len),
        Some(8),
        "five of the paper, three aims"
    );
    for claim in first["claims"].as_array().expect("claims") {
        assert_eq!(
            claim["verdict"], "not-tested",
            "two seeds judge nothing: {claim}"
        );
    }
    for name in [
        "figure6.json",
        "figure6-3m.svg",
        "figure6-3m.png",
        "figure6-2s3z.svg",
    ] {
        assert!(folder.path().join(name).exists(), "{name}");
    }

    let delegation = report(&reproduce("figure7", folder.path(), "2"));
    assert_eq!(delegation["moments"].as_array().map(Vec::len), Some(4));
    // The first batch: an untrained pair that knows all enemies has one of very many actions to choose.
    let untrained = &delegation["moments"][0];
    assert_eq!(untrained["steps"], 0);
    let rate = untrained["rates"][5]["mean"].as_f64();
    assert!(rate.is_some_and(|rate| rate < 0.15), "{untrained}");
    assert_eq!(report(&reproduce("figure6", folder.path(), "2")), first);
    assert_eq!(written(folder.path()), files, "a finished run was repeated");

    let other = tempfile::tempdir().expect("a folder");
    assert_eq!(
        report(&reproduce("figure6", other.path(), "3")),
        first,
        "jobs changed a result"
    );
}

#[test]
fn everything_together_is_one_page() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = Command::cargo_bin("mackrl")
        .expect("the program is built")
        .args(["reproduce", "all", "--without-ablations", "--seeds", "2"])
        .args(["--steps", "1000", "--interval", "1000", "--out"])
        .arg(folder.path())
        .output()
        .expect("the program starts");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    let page = fs::read_to_string(folder.path().join("report.html")).expect("a page");
    assert_eq!(
        page.matches("<svg ").count(),
        4,
        "figures 5, 6 (two maps) and 7"
    );
    assert!(page.contains("not tested") && page.contains("config_sha256"));
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.trim_end().ends_with("report.html"), "{told}");
}

#[test]
fn a_single_seed_has_no_standard_error() {
    let output = Command::cargo_bin("mackrl")
        .expect("the program is built")
        .args(["reproduce", "figure6", "--seeds", "1"])
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(2));
}
