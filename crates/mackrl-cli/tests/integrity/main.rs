//! A result is never another run's, whatever was done to its folder.
//!
//! Every test goes over random cases. `scripts/robustness.sh integrity` makes many, `MACKRL_CASES` says how many, and
//! `MACKRL_SEED` which; a plain run makes a few.
#![cfg(target_os = "linux")]

#[path = "../support/mod.rs"]
mod support;

mod bytes;
mod crossings;
mod ends;
mod hostile;
mod stops;
mod sweeps;
mod writers;

use std::{
    env, fs,
    io::{Read, Seek},
    path::Path,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

/// How often each test tries, unless `few` is more than the environment asks for.
fn cases(few: usize) -> usize {
    let asked = env::var("MACKRL_CASES").ok();
    asked.map_or(few, |text| text.parse().expect("a number of cases"))
}

/// The random numbers of a test.
fn random(test: &str) -> fastrand::Rng {
    let seed = env::var("MACKRL_SEED").ok();
    let seed = seed.map_or(1, |text| text.parse().expect("a seed"));
    let of_test = test.bytes().map(u64::from).sum::<u64>();
    fastrand::Rng::with_seed(seed * 1_000 + of_test)
}

/// How a command ended, and what it said.
struct Ended {
    /// Exit code; -1 for a signal, -2 if it did not end in time.
    code: i32,
    stdout: String,
    stderr: String,
}

/// Runs a command to its end, for `limit` at most.
fn ended(mut command: Command, limit: Duration) -> Ended {
    let [mut out, mut err] = [(); 2].map(|()| tempfile::tempfile().expect("a file for words"));
    let clone = |file: &fs::File| Stdio::from(file.try_clone().expect("a second handle"));
    let mut child = command
        .stdin(Stdio::null())
        .stdout(clone(&out))
        .stderr(clone(&err))
        .spawn()
        .expect("the program starts");
    let start = Instant::now();
    let code = loop {
        if let Some(status) = child.try_wait().expect("a child can be asked") {
            break status.code().unwrap_or(-1);
        }
        if start.elapsed() > limit {
            child.kill().expect("a child can be killed");
            let _ = child.wait();
            break -2;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let text = |file: &mut fs::File| {
        let mut bytes = Vec::new();
        file.rewind().expect("a file can be rewound");
        file.read_to_end(&mut bytes).expect("a file can be read");
        String::from_utf8_lossy(&bytes).into_owned()
    };
    Ended {
        code,
        stdout: text(&mut out),
        stderr: text(&mut err),
    }
}

/// Sends a signal, by its name.
fn signal(pid: u32, name: &str) {
    let _ = Command::new("kill")
        .args([&format!("-{name}"), &pid.to_string()])
        .stderr(Stdio::null())
        .status();
}

/// Copies a folder with all that is in it.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder can be made");
    for entry in fs::read_dir(from).expect("a folder can be read").flatten() {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).expect("a file can be copied");
        }
    }
}

/// All files in a folder.
fn files(folder: &Path) -> Vec<std::path::PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)
        .expect("a folder can be read")
        .flatten()
    {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}
