//! Commands, run as a reader types them.

use std::{env, fs, os::unix::fs::symlink, path::Path, time::Duration};

use assert_cmd::{Command, cargo::cargo_bin};

use crate::{
    blocks::{Directive, blocks},
    expect_same, fenced, read, root,
};

/// No block waits longer.
const PATIENCE: Duration = Duration::from_secs(300);

/// What `mackrl` prints when it is given these words.
pub(crate) fn mackrl(words: &str) -> String {
    let mut program = Command::new(cargo_bin("mackrl"));
    let output = program
        .args(words.split_whitespace())
        .env_remove("COLUMNS")
        .output();
    let output = output.expect("the program starts");
    assert!(
        output.status.success(),
        "mackrl {words}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).expect("output is UTF-8")
}

/// Runs the blocks of a page one after the other, in a folder as that of a clone, and compares what they print.
/// The first fault ends it.
pub(crate) fn run(page: &str) -> Result<(), String> {
    let folder = tempfile::tempdir().expect("a folder for the page");
    furnish(folder.path());
    let path = format!(
        "{}:{}",
        folder.path().join("bin").display(),
        env::var("PATH").expect("a path")
    );
    let mut printed = None;
    for block in blocks(&read(page)) {
        let place = format!("{page}:{}", block.line);
        match (&*block.language, &block.directive) {
            ("toml" | "python", Some(Directive::File(name, _))) => {
                fs::write(folder.path().join(name), block.to_run()).expect("a file of the page");
            }
            ("sh", Some(Directive::NotRun(_))) => printed = None,
            ("sh", _) => {
                let mut shell = Command::new("bash");
                shell.args(["-euo", "pipefail", "-c", &block.to_run()]);
                shell
                    .env("PATH", &path)
                    .env_remove("COLUMNS")
                    .env_remove("SC2PATH");
                let output = shell.current_dir(folder.path()).timeout(PATIENCE).output();
                let output = output.map_err(|error| format!("{place}: {error}"))?;
                if !output.status.success() {
                    let stderr = String::from_utf8_lossy(&output.stderr);
                    return Err(format!("{place}: {}\n{stderr}", output.status));
                }
                printed = Some(String::from_utf8(output.stdout).expect("output is UTF-8"));
            }
            ("python", _) => printed = None,
            (_, Some(Directive::Output(lines))) => {
                if let Some(printed) = &printed {
                    let (first, last) = lines.unwrap_or((1, usize::MAX));
                    let chosen = printed.lines().skip(first - 1).take(last - first + 1);
                    let chosen: String = chosen
                        .map(|line| format!("{}\n", line.trim_end()))
                        .collect();
                    let language = &block.language;
                    expect_same(
                        page,
                        &fenced(language, &block.text),
                        &fenced(language, &chosen),
                    );
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// What a clone has, and `mackrl` on the path.
fn furnish(folder: &Path) {
    for name in ["examples", "results"] {
        symlink(root().join(name), folder.join(name)).expect("a link");
    }
    for name in ["bin", "docs"] {
        fs::create_dir(folder.join(name)).expect("a folder");
    }
    symlink(cargo_bin("mackrl"), folder.join("bin/mackrl")).expect("a link");
    // Evaluation may write into these.
    copy(&root().join("zoo"), &folder.join("zoo"));
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder") {
        let entry = entry.expect("an entry");
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).expect("a copy");
        }
    }
}
