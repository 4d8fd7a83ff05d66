use std::fs;

use tempfile::TempDir;

use super::*;

/// A folder of runs with one run in it.
fn runs() -> (TempDir, Served) {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("one");
    fs::create_dir_all(run.join("replays")).unwrap();
    fs::write(run.join("config.toml"), "").unwrap();
    fs::write(run.join("run.json"), r#"{"status":"running"}"#).unwrap();
    fs::write(
        run.join("metrics.jsonl"),
        "{\"t_env\":1}\n{\"t_env\":2}\n{\"t_en",
    )
    .unwrap();
    fs::write(run.join("replays/a.replay.gz"), "no replay").unwrap();
    fs::write(run.join("replays/<b>.replay.gz"), "").unwrap();
    let served = Served::new(&[folder.path().to_owned()]);
    (folder, served)
}

#[test]
fn runs_are_listed_with_their_status_and_replays() {
    let (_folder, served) = runs();
    let list = route("/runs.json", &served).body();
    assert!(
        list.contains(r#""status":"running","replays":["a.replay.gz"]"#),
        "{list}"
    );
    assert!(route("/", &served).body().starts_with("<!doctype html>"));
}

#[test]
fn metrics_come_in_whole_lines_from_where_the_browser_is() {
    let (_folder, served) = runs();
    let rows = |path| route(path, &served).body();
    assert_eq!(
        rows("/runs/0/metrics.jsonl"),
        "{\"t_env\":1}\n{\"t_env\":2}\n"
    );
    assert_eq!(rows("/runs/0/metrics.jsonl?from=12"), "{\"t_env\":2}\n");
    assert_eq!(rows("/runs/0/metrics.jsonl?from=24"), "");
    let beyond = route("/runs/0/metrics.jsonl?from=999", &served);
    assert_eq!(beyond.status(), 404, "the run was cut back");
}

#[test]
fn nothing_outside_the_runs_can_be_reached() {
    let (_folder, served) = runs();
    for path in [
        "/runs/1/metrics.jsonl",
        "/runs/../metrics.jsonl",
        "/runs/0/replays/..%2fconfig.toml",
        "/runs/0/replays/../config.toml",
        "/runs/0/replays/<b>.replay.gz",
        "/etc/passwd",
        "/runs/-1/metrics.jsonl",
    ] {
        assert_eq!(route(path, &served).status(), 404, "{path}");
    }
    let damaged = route("/runs/0/replays/a.replay.gz", &served);
    assert_eq!(damaged.status(), 500);
    assert!(
        damaged.body().contains("no replay of mackrl"),
        "{}",
        damaged.body()
    );
}

#[test]
fn a_request_is_bounded_and_for_this_machine() {
    let read = |text: &str| Request::read(text.as_bytes());
    let request = read("GET /x?y HTTP/1.1\r\nAccept: */*\r\nhOST: localhost:80\r\n\r\n").unwrap();
    assert_eq!(request.path, "/x?y");
    assert!(request.is_for(80) && !request.is_for(81), "its port is 80");
    let other = read("GET / HTTP/1.1\r\nHost: evil.example:80\r\n\r\n").unwrap();
    assert!(!other.is_for(80), "another name");
    let status = |text: &str| read(text).unwrap_err().status();
    assert_eq!(status("POST / HTTP/1.1\r\n\r\n"), 405);
    assert_eq!(status("GET / HTTP/1.1\r\n"), 400);
    assert_eq!(status(&"x".repeat(100_000)), 431);
}

#[test]
fn a_connection_that_panics_gives_its_slot_back() {
    let connections = Arc::new(AtomicUsize::new(CONNECTIONS_MOST - 1));
    let slot = Slot::take(&connections).unwrap();
    assert!(Slot::take(&connections).is_none(), "all are taken");
    let handler = std::thread::spawn(move || {
        let _slot = slot;
        panic!("on purpose");
    });
    assert!(handler.join().is_err());
    assert!(Slot::take(&connections).is_some());
}
