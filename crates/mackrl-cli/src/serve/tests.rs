use std::{
    fs,
    io::{Read, Write},
    net::TcpStream as Socket,
    path::Path,
    time::{Duration, Instant},
};

use mackrl_run::{
    config::Config,
    run_folder::{RunFolder, Status},
};
use tempfile::TempDir;

use super::{answer::route, *};

/// A folder of runs with one run in it, two levels down.
fn runs() -> (TempDir, Served) {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("deep/one");
    let mut made = RunFolder::create(&run, &Config::default(), 1).unwrap();
    made.append_metrics("{\"t_env\":1}").unwrap();
    made.append_metrics("{\"t_env\":2}").unwrap();
    made.set_status(Status::Interrupted).unwrap();
    fs::create_dir(run.join("replays")).unwrap();
    fs::write(run.join("replays/a.replay.gz"), "no replay").unwrap();
    fs::write(run.join("replays/<b>.replay.gz"), "").unwrap();
    let served = Served::new(&[folder.path().to_owned()]);
    (folder, served)
}

fn id(served: &Served) -> String {
    let list: serde_json::Value =
        serde_json::from_str(&route("runs.json", "", served).body()).unwrap();
    list["runs"][0]["id"].as_str().unwrap().to_owned()
}

#[test]
fn runs_are_listed_at_any_depth_with_status_settings_and_replays() {
    let (_folder, served) = runs();
    let list = route("runs.json", "", &served).body();
    assert!(list.contains(r#""status":"interrupted""#), "{list}");
    assert!(list.contains(r#""replays":["a.replay.gz"]"#), "{list}");
    assert!(list.contains(r#""run.seed":"1""#), "{list}");
    let page = route("", "", &served).body();
    assert!(page.starts_with("<!doctype html>") && page.contains("uPlot"));
}

#[test]
fn an_empty_folder_says_why_the_page_is_empty() {
    let folder = tempfile::tempdir().unwrap();
    let served = Served::new(&[folder.path().to_owned()]);
    let list = route("runs.json", "", &served).body();
    assert!(list.contains("there is no run in or below"), "{list}");
}

#[test]
fn rows_come_whole_from_where_the_browser_is_and_bad_ones_are_told() {
    let (folder, served) = runs();
    let id = id(&served);
    let rows = |from: &str| route(&format!("runs/{id}/rows.json"), from, &served);
    let whole = r#"{"rows":[{"t_env":1},{"t_env":2}],"next":24,"problem":null}"#;
    assert_eq!(rows("").body(), whole);
    assert!(rows("from=12").body().contains(r#"[{"t_env":2}]"#));
    assert_eq!(rows("from=999").status(), 404, "the run was cut back");
    let metrics = folder.path().join("deep/one/metrics.jsonl");
    fs::write(
        &metrics,
        "{\"t_env\":1}\n{\"t_env\":{}}\n{\"t_env\":1e308}\n{\"t_env\":7}\n{\"t_e",
    )
    .unwrap();
    let found = rows("").body();
    assert!(
        found.contains(r#""rows":[{"t_env":1},{"t_env":7}]"#),
        "{found}"
    );
    assert!(found.contains("a row is left out"), "{found}");
}

#[test]
fn nothing_outside_the_runs_can_be_reached() {
    let (_folder, served) = runs();
    let id = id(&served);
    for path in [
        "runs/0123456789abcdef/rows.json".to_owned(),
        "runs/../rows.json".to_owned(),
        format!("runs/{id}/replays/..%2fconfig.toml"),
        format!("runs/{id}/replays/../config.toml"),
        format!("runs/{id}/replays/<b>.replay.gz"),
        "etc/passwd".to_owned(),
    ] {
        assert_eq!(route(&path, "", &served).status(), 404, "{path}");
    }
    let damaged = route(&format!("runs/{id}/replays/a.replay.gz"), "", &served);
    assert_eq!(damaged.status(), 500);
    assert!(damaged.body().contains("no replay of mackrl"));
}

#[cfg(unix)]
#[test]
fn links_and_pipes_in_a_run_are_refused_at_once_and_hide_no_other_run() {
    use std::os::unix::fs::symlink;
    let (folder, served) = runs();
    let secret = folder.path().join("secret");
    fs::write(&secret, "{\"t_env\":7,\"word\":1}\n").unwrap();
    for name in ["metrics.jsonl", "run.json", "config.toml", "replays"] {
        let bad = folder.path().join(format!("bad-{name}"));
        RunFolder::create(&bad, &Config::default(), 1).unwrap();
        let _ = fs::remove_file(bad.join(name));
        symlink(&secret, bad.join(name)).unwrap();
    }
    let piped = folder.path().join("piped");
    RunFolder::create(&piped, &Config::default(), 1).unwrap();
    fs::remove_file(piped.join("metrics.jsonl")).unwrap();
    let made = std::process::Command::new("mkfifo")
        .arg(piped.join("metrics.jsonl"))
        .status();
    assert!(made.unwrap().success());
    let start = Instant::now();
    let list: serde_json::Value =
        serde_json::from_str(&route("runs.json", "", &served).body()).unwrap();
    let listed = list["runs"].as_array().unwrap();
    assert_eq!(listed.len(), 6);
    for run in listed {
        let path = format!("runs/{}/rows.json", run["id"].as_str().unwrap());
        let rows = route(&path, "", &served).body();
        assert!(!rows.contains("word"), "{rows}");
    }
    let good = listed.iter().filter(|run| run["problem"].is_null());
    assert_eq!(good.count(), 1);
    assert!(start.elapsed() < Duration::from_secs(5));
}

/// A server of a folder, and the address that it gives.
fn start(folder: &Path) -> (u16, String) {
    let shared = Shared {
        served: Served::new(&[folder.to_owned()]),
        token: token().unwrap(),
        port: 0,
        answers: Semaphore::new(ANSWERS_MOST),
    };
    let token = shared.token.clone();
    let (sender, receiver) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let runtime = runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .unwrap();
        runtime.block_on(async {
            let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
            let port = listener.local_addr().unwrap().port();
            sender.send(port).unwrap();
            accept_on(listener, Arc::new(Shared { port, ..shared })).await;
        });
    });
    (receiver.recv().unwrap(), token)
}

fn get(port: u16, path: &str, host: &str) -> String {
    let mut socket = Socket::connect((Ipv4Addr::LOCALHOST, port)).unwrap();
    socket
        .set_read_timeout(Some(Duration::from_secs(10)))
        .unwrap();
    write!(socket, "GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n").unwrap();
    let mut answer = String::new();
    let _ = socket.read_to_string(&mut answer);
    answer
}

#[test]
fn only_who_has_the_token_and_calls_this_machine_by_its_name_is_answered() {
    let (folder, _) = runs();
    let (port, token) = start(folder.path());
    let own = format!("127.0.0.1:{port}");
    assert!(get(port, &format!("/{token}/"), &own).starts_with("HTTP/1.1 200"));
    for (path, host) in [
        ("/".to_owned(), &*own),
        ("/runs.json".to_owned(), &own),
        (format!("/{token}/"), "evil.example"),
        (
            format!(
                "/{}/runs.json",
                token.replace(|c: char| c.is_ascii_digit(), "x")
            ),
            &own,
        ),
    ] {
        let answer = get(port, &path, host);
        assert!(answer.starts_with("HTTP/1.1 403"), "{path}: {answer}");
    }
}

#[test]
fn connections_that_dawdle_keep_nobody_from_an_answer() {
    let (folder, _) = runs();
    let (port, token) = start(folder.path());
    let dawdling: Vec<Socket> = (0..200)
        .map(|_| {
            let mut socket = Socket::connect((Ipv4Addr::LOCALHOST, port)).unwrap();
            socket.write_all(b"GET / HT").unwrap();
            socket
        })
        .collect();
    let start = Instant::now();
    let answer = get(
        port,
        &format!("/{token}/runs.json"),
        &format!("localhost:{port}"),
    );
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    assert!(start.elapsed() < Duration::from_secs(2));
    drop(dawdling);
}
