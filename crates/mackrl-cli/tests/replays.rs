//! Replays, from playing to looking.

use std::{
    fs,
    io::{Read, Write},
    path::Path,
};

use flate2::{Compression, read::GzDecoder, write::GzEncoder};
use mackrl_skirmish::SIMULATOR_VERSION;
use tempfile::TempDir;

/// What came back of a command typed in `folder`: the exit code, stdout and stderr.
fn type_in(folder: &Path, line: &str) -> (i32, String, String) {
    let output = assert_cmd::Command::cargo_bin("mackrl")
        .expect("the program is built")
        .args(line.split_whitespace())
        .current_dir(folder)
        .output()
        .expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("output is UTF-8");
    let code = output.status.code().expect("it ends by itself");
    (code, text(output.stdout), text(output.stderr))
}

fn succeeds(folder: &Path, line: &str) -> String {
    let (code, stdout, stderr) = type_in(folder, line);
    assert_eq!(code, 0, "`{line}`: {stderr}");
    stdout
}

/// What stderr says of a command that fails with this code.
fn fails(folder: &Path, line: &str, code: i32) -> String {
    let (found, _, stderr) = type_in(folder, line);
    assert_eq!(found, code, "`{line}`: {stderr}");
    stderr
}

/// A folder with the replay of a scripted battle, `one.replay.gz`.
fn folder_with_replay() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder for the story");
    succeeds(
        folder.path(),
        "play --map 2s3z --save-replay one.replay.gz --seed 4",
    );
    folder
}

/// Replaces text in a packed file.
fn spoil(file: &Path, from: &str, to: &str) {
    let mut text = String::new();
    GzDecoder::new(&fs::read(file).expect("a replay")[..])
        .read_to_string(&mut text)
        .expect("a packed text");
    assert!(text.contains(from), "no `{from}` in {}", file.display());
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder
        .write_all(text.replacen(from, to, 1).as_bytes())
        .and_then(|()| encoder.finish())
        .and_then(|bytes| fs::write(file, bytes))
        .expect("the folder can be written");
}

#[test]
fn a_kept_episode_plays_again_and_a_changed_one_is_found_out() {
    let folder = folder_with_replay();
    let folder = folder.path();
    let played = succeeds(
        folder,
        "play --map 2s3z --save-replay two.replay.gz --seed 4",
    );
    let replayed = succeeds(folder, "replay two.replay.gz");
    let end = |text: &str| text.split_once(": ").map(|(_, end)| end.to_owned());
    assert_eq!(end(&played), end(&replayed));
    let read = |name: &str| fs::read(folder.join(name)).expect("a replay");
    assert_eq!(read("one.replay.gz"), read("two.replay.gz"));

    let file = folder.join("two.replay.gz");
    spoil(&file, "\"seed\":4", "\"seed\":5");
    let error = fails(folder, "replay two.replay.gz", 65);
    assert!(error.contains("first differs after step"), "{error}");
    let own = format!("\"simulator\":{SIMULATOR_VERSION}");
    spoil(&file, &own, "\"simulator\":904");
    let error = fails(folder, "explain two.replay.gz --step 0", 65);
    assert_eq!(
        error,
        format!(
            "error: two.replay.gz: recorded by mackrl 0.1.0 with simulator version 904, \
             this program has version {SIMULATOR_VERSION}\n\
             hint: mackrl 0.1.0, which recorded it, plays it\n"
        )
    );
    fs::write(&file, "no replay").expect("the folder can be written");
    let error = fails(folder, "replay two.replay.gz --html x.html", 65);
    assert!(error.contains("no replay of mackrl"), "{error}");
    assert!(!folder.join("x.html").exists(), "nothing is written");
}

#[test]
fn every_kind_of_picture_is_what_its_name_says() {
    let folder = folder_with_replay();
    let folder = folder.path();
    let line = "replay one.replay.gz --html a.html --svg a.svg --step 3 --group A,b";
    succeeds(folder, line);
    succeeds(
        folder,
        "play --map 2s3z --seed 4 --svg played.svg --step 3 --save-replay two.replay.gz",
    );
    succeeds(folder, "replay two.replay.gz --svg replayed.svg --step 3");
    let read = |name: &str| fs::read(folder.join(name)).expect("it was written");
    assert!(
        read("played.svg") == read("replayed.svg"),
        "one picture, whoever draws it"
    );
    assert!(read("a.html").starts_with(b"<!doctype html>"), "a page");
    assert!(read("a.svg").starts_with(b"<svg "), "a picture");
    let svg = String::from_utf8(read("a.svg")).expect("SVG is text");
    assert!(svg.contains("common knowledge of A, B"), "{svg}");
}

#[test]
fn what_does_not_go_together_is_a_usage_error() {
    let folder = folder_with_replay();
    let says = |line: &str| fails(folder.path(), line, 2);
    insta::assert_snapshot!(says("replay one.replay.gz --svg a.svg --step 999").lines().next().unwrap_or_default().split(" in this").next().unwrap_or_default().rsplit_once(' ').unwrap_or_default().0, @"error: --step 999 is after the end, expected at most");
    insta::assert_snapshot!(says("replay one.replay.gz --svg a.svg --group A,Z"), @"error: no agent is called `Z`, expected some of A, B, C, D, E");
    insta::assert_snapshot!(says("replay one.replay.gz --step 3"), @"error: --step says what --svg or --html shows, and neither is given");
    insta::assert_snapshot!(says("play --map all --save-replay x"), @"error: --save-replay takes one map and one policy, not `all`");
    insta::assert_snapshot!(says("play --policy all --svg x"), @"error: --svg takes one map and one policy, not `all`");
    assert!(says("play --svg x --step 999").contains("is after the end"));
    assert!(says("play --step 3").contains("--svg"));
    assert!(says("explain one.replay.gz --step 999").contains("is no decision"));
    assert!(says("play --save-replay x --episodes 3").contains("cannot be used with"));
}

#[test]
fn a_trained_team_s_replay_explains_every_step() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let folder = folder.path();
    succeeds(
        folder,
        "train --map 3m --steps 100 --out run --set test.episodes=2",
    );
    let error = fails(folder, "evaluate run --episodes 2 --save-replays 3", 2);
    assert!(error.contains("--save-replays 3 of 2 episodes"), "{error}");
    succeeds(
        folder,
        "evaluate run --episodes 2 --save-replays 2 --seed 7",
    );
    let file = "run/replays/seed7-episode1.replay.gz";
    let text = succeeds(folder, &format!("explain {file} --step 2"));
    for part in [
        "Who sees whom",
        "A, B: A, B, C, because A sees B and B sees A",
        "Partitions (> was chosen)",
        "over all ways, p(u)",
    ] {
        assert!(text.contains(part), "{part} is missing:\n{text}");
    }
    let json = succeeds(folder, &format!("explain {file} --step 2 --json"));
    let facts: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let controllers = &facts["controllers"];
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let path = controllers["path"].as_array().expect("choices");
    let product: f64 = path
        .iter()
        .map(|choice| number(&choice["probability"]))
        .product();
    let recorded = number(&controllers["path_probability"]);
    assert!(
        (product / recorded - 1.0).abs() < 1e-4,
        "{product} {recorded}"
    );
    assert!(recorded <= number(&controllers["marginal_probability"]) + 1e-6);
    assert_eq!(facts["knowledge"].as_array().map(Vec::len), Some(3));
}

#[test]
fn the_matrix_game_has_no_replays() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let folder = folder.path();
    succeeds(
        folder,
        "train --map matrix-game --steps 20 --out run --set test.episodes=2",
    );
    let error = fails(folder, "evaluate run --episodes 1 --save-replays 1", 64);
    assert!(
        error.contains("`matrix-game` has no units to look at"),
        "{error}"
    );
}

#[test]
fn what_a_whole_team_could_do_is_explained() {
    let folder = tempfile::tempdir().expect("a folder for the story");
    let folder = folder.path();
    succeeds(
        folder,
        "train --map 3m --algorithm jal --set env.sight_range=64 --steps 300 --set test.episodes=2 --out run",
    );
    succeeds(folder, "evaluate run --episodes 1 --save-replays 1");
    let mut replays = fs::read_dir(folder.join("run/replays")).expect("a kept replay");
    let replay = replays.next().expect("one").expect("a file").path();
    let replay = replay.display();
    let told = succeeds(folder, &format!("explain {replay} --step 0"));
    assert!(
        told.contains("The whole team (> was taken)\n  A, B, C: > "),
        "{told}"
    );
    assert!(
        told.contains("The way that was taken\n  A, B, C: "),
        "{told}"
    );
    assert!(!told.contains("Agents alone"), "{told}");
    let alone = succeeds(folder, &format!("explain {replay} --step 0 --agent A"));
    assert!(alone.contains("The whole team"), "{alone}");
    let pair = succeeds(folder, &format!("explain {replay} --step 0 --group A,B"));
    assert!(!pair.contains("The whole team"), "{pair}");
}
