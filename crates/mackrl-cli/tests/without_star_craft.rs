//! A program that was built without StarCraft II says what is missing: `cargo test -p mackrl --no-default-features --test
//! without_star_craft`.

#![cfg(not(all(feature = "sc2", target_os = "linux")))]

use assert_cmd::Command;

const MISSING: &str = "this program was built without StarCraft II: build it on Linux with the feature `sc2`, which is on by default";

/// Exit code and stderr of a command that fails.
fn failed(words: &str) -> (i32, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let output = Command::cargo_bin("mackrl")
        .expect("the program is built")
        .args(words.split_whitespace())
        .current_dir(folder.path())
        .output()
        .expect("the program starts");
    let entries = std::fs::read_dir(folder.path()).expect("readable");
    assert_eq!(entries.count(), 0, "`{words}` leaves something behind");
    let code = output.status.code().expect("an exit code");
    (code, String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn worlds_of_the_game_are_refused_in_words() {
    for words in [
        "train --env sc2 --map 3m --steps 500",
        "play --env sc2 --map 3m --policy nearest",
        "play --env sc2 --map 3m --policy nearest --save-replay battle.SC2Replay",
    ] {
        let (code, stderr) = failed(words);
        assert_eq!(code, 64, "`{words}`: {stderr}");
        let said = format!("env.name is `sc2`, expected `skirmish`: {MISSING}");
        assert!(stderr.contains(&said), "`{words}`: {stderr}");
    }
}

#[test]
fn commands_around_the_game_are_refused_in_words() {
    for words in ["sc2 doctor --start", "sc2 serve --port 5000"] {
        let (code, stderr) = failed(words);
        assert_eq!(code, 2, "`{words}`: {stderr}");
        let said = format!("cannot run `mackrl {words}`: {MISSING}");
        assert!(stderr.contains(&said), "{stderr}");
    }
}
