//! The comparison of learners and the zoo of trained teams, in miniature; and the teams that are committed.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Output,
};

use assert_cmd::Command;
use mackrl_run::{
    run_folder::{Run, WhichWeights, read_description},
    training::{Score, evaluate},
};
use serde_json::Value;

/// Settings with which a team trains for a second.
const SMALL: [&str; 4] = [
    "algorithm.hidden=8",
    "algorithm.critic_hidden=8",
    "algorithm.environments=2",
    "test.episodes=4",
];

fn mackrl(words: &[&str], paths: &[(&str, &Path)]) -> Output {
    let mut command = Command::cargo_bin("mackrl").expect("the program is built");
    command.args(words);
    for (flag, path) in paths {
        command.arg(flag).arg(path);
    }
    command.output().expect("the program starts")
}

fn json(output: &Output) -> Value {
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Plays again what a run says of its teams, with the library: the very same numbers come out. Returns how many different openings
/// its last and its best weights play.
fn plays_as_recorded(folder: &Path) -> Vec<f64> {
    let mut scripts = Vec::new();
    let (config, description) = read_description(folder).expect("a run");
    let teams = description
        .teams
        .expect("a finished run says how its teams play");
    let best = teams.best.expect("a run has best weights");
    for (which, score) in [(WhichWeights::Last, teams.last), (WhichWeights::Best, best)] {
        let run = Run::open(folder, which).expect("the weights");
        assert_eq!(run.steps_env(), Some(score.steps_env), "{which}");
        let evaluation = evaluate(&config, &run.weights, score.episodes, config.run.seed, 2);
        let evaluation = evaluation.expect("episodes");
        let found = Score::of(&evaluation, score.steps_env);
        assert_eq!(found, score, "{which} of {}", folder.display());
        scripts.push(evaluation.distinct_openings * score.episodes as f64);
    }
    scripts
}

#[test]
fn a_zoo_is_trained_once_told_and_published() {
    let folder = tempfile::tempdir().expect("a folder");
    let [out, zoo] = ["runs", "zoo"].map(|name| folder.path().join(name));
    let page = folder.path().join("zoo.md");
    fs::write(&page, "# Zoo\n<!-- zoo: begin -->\n<!-- zoo: end -->\n").expect("a page");
    let mut words = vec![
        "reproduce",
        "zoo",
        "--maps",
        "3m",
        "--steps",
        "900",
        "--json",
    ];
    words.extend(SMALL.iter().flat_map(|setting| ["--set", setting]));
    let own: [(&str, &Path); 3] = [("--out", &out), ("--page", &page), ("--publish", &zoo)];
    let first = json(&mackrl(&words, &own));
    let team = &first["teams"][0];
    assert_eq!(
        (&team["map"], &team["steps_env"]),
        (&"3m".into(), &900.into())
    );
    assert_eq!(team["last"]["episodes"], 40);
    let table = fs::read_to_string(&page).expect("the page");
    assert!(table.contains("| map | best weights win |"), "{table}");
    assert!(
        table.contains("| 3m | ") && table.contains("over 40 battles"),
        "{table}"
    );

    plays_as_recorded(&zoo.join("3m"));
    let replay = zoo.join("3m/replays/best-seed1-episode0.replay.gz");
    let battle = folder.path().join("battle.html");
    let paths: [(&str, &Path); 2] = [("--html", &battle), ("--", &replay)];
    assert!(mackrl(&["replay"], &paths).status.success());
    let published = fs::read(zoo.join("3m/battle.html")).expect("a page");
    assert_eq!(published, fs::read(&battle).expect("a page"));
    let card = fs::read_to_string(zoo.join("3m/README.md")).expect("a card");
    for told in [
        "`mackrl-ppo` for 900 environment steps with seed 1",
        "over 40 battles",
        "best-seed1-episode0",
    ] {
        assert!(card.contains(told), "{told} in {card}");
    }
    let told = mackrl(
        &["evaluate", "--episodes", "40", "--checkpoint", "best"],
        &[("--", &zoo.join("3m"))],
    );
    let told = String::from_utf8(told.stdout).expect("text");
    assert!(told.starts_with("won "), "{told}");
    assert!(told.contains("battles (best weights, of step "), "{told}");

    // Where the best weights are better by more than chance, evaluating the last says so.
    let told = || {
        let run = zoo.join("3m");
        let output = mackrl(&["evaluate", "--episodes", "1"], &[("--", &run)]);
        String::from_utf8(output.stderr).expect("text")
    };
    let path = zoo.join("3m/run.json");
    let mut record: Value =
        serde_json::from_slice(&fs::read(&path).expect("a record")).expect("JSON");
    for (best, is_better) in [(0.5, false), (0.9, true)] {
        for (which, mean) in [("last", 0.5), ("best", best)] {
            record["teams"][which]["mean"] = mean.into();
            record["teams"][which]["standard_error"] = 0.1.into();
        }
        fs::write(&path, record.to_string()).expect("a record can be changed");
        assert_eq!(
            told().contains("with --checkpoint best"),
            is_better,
            "{}",
            told()
        );
    }

    let record = fs::read(out.join("3m/run.json")).expect("a record");
    assert_eq!(json(&mackrl(&words, &own)), first);
    assert_eq!(fs::read(out.join("3m/run.json")).expect("a record"), record);
}

#[test]
fn a_zoo_asks_how_long_a_team_learns_on_a_map_that_it_does_not_know() {
    let output = mackrl(&["reproduce", "zoo", "--maps", "27m_vs_30m"], &[]);
    assert_eq!(output.status.code(), Some(2));
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(error.contains("say it with --steps"), "{error}");
}

#[test]
fn a_comparison_is_made_from_a_plan_and_drawn_again_from_what_is_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let [plan, out, runs] = ["plan.toml", "out", "runs"].map(|name| folder.path().join(name));
    let settings = SMALL
        .map(|setting| setting.replace('=', " = ") + "\n")
        .concat();
    let text = format!(
        "maps = [\"3m\"]\nalgorithms = [\"mackrl-ppo\", \"mappo\"]\nseeds = 1\n\
         [settings]\nrun.steps_env = 600\ntest.interval_steps_env = 300\n{settings}"
    );
    fs::write(&plan, &text).expect("a plan");
    fs::create_dir(&out).expect("a folder");
    let readme = out.join("README.md");
    fs::write(&readme, "<!-- ppo: begin -->\n<!-- ppo: end -->\n").expect("a page");
    let paths: [(&str, &Path); 3] = [("--plan", &plan), ("--out", &out), ("--runs", &runs)];
    let stands = ["reproduce", "ppo", "--as-it-stands", "--json"];
    let nothing = mackrl(&stands, &paths);
    assert_eq!(nothing.status.code(), Some(2));
    let error = String::from_utf8_lossy(&nothing.stderr);
    assert!(error.contains("is finished"), "{error}");

    let first = json(&mackrl(&["reproduce", "ppo", "--json"], &paths));
    assert_eq!(
        (&first["finished"], &first["planned"]),
        (&2.into(), &2.into())
    );
    let learners = first["rows"].as_array().expect("rows").iter();
    let learners: Vec<&Value> = learners.map(|row| &row["learner"]).collect();
    assert_eq!(learners, ["mackrl-ppo", "mappo"]);
    let found = &first["rows"][0]["found"];
    assert_eq!(found["steps"], serde_json::json!([0, 300, 600]));
    assert!(
        found["minutes"].as_f64() > Some(0.0) && found["best"].is_f64(),
        "{found}"
    );
    let claims = first["claims"].as_array().expect("claims");
    assert_eq!(claims.len(), 6);
    let one_run = claims.iter().all(|claim| claim["verdict"] == "not-tested");
    assert!(one_run, "{claims:?}");
    for name in ["ppo.json", "ppo.svg", "ppo.png", "runs/3m-mappo-seed1.json"] {
        assert!(out.join(name).exists(), "{name}");
    }
    let table = fs::read_to_string(&readme).expect("the page");
    assert!(table.contains("| 3m | mappo | 1/1 | "), "{table}");

    fs::remove_dir_all(&runs).expect("run folders are not needed any more");
    assert_eq!(json(&mackrl(&stands, &paths)), first);
    assert_eq!(fs::read_to_string(&readme).expect("the page"), table);
    let other = text.replace("run.steps_env = 600", "run.steps_env = 900");
    fs::write(&plan, other).expect("a plan");
    assert_eq!(
        mackrl(&stands, &paths).status.code(),
        Some(2),
        "another experiment"
    );
}

#[test]
fn published_points_stand_beside_ours_and_claims_wait_for_runs_enough() {
    let folder = tempfile::tempdir().expect("a folder");
    let [plan, out, runs] = ["plan.toml", "out", "runs"].map(|name| folder.path().join(name));
    let text = "preset = \"paper-figures\"\nmaps = [\"3m\"]\nseeds = 1\n\
                [settings]\nrun.steps_env = 600\ntest.interval_steps_env = 300\ntest.episodes = 4\n\
                [variants.mackrl]\nalgorithm.name = \"mackrl\"\n\
                [variants.coma]\nalgorithm.name = \"coma\"\n";
    fs::write(&plan, text).expect("a plan");
    fs::create_dir(&out).expect("a folder");
    let readme = out.join("README.md");
    let marks = ["figure4-neurips", "calibration"]
        .map(|name| format!("<!-- {name}: begin -->\n<!-- {name}: end -->\n"));
    fs::write(&readme, marks.concat()).expect("a page");
    let paths: [(&str, &Path); 3] = [("--plan", &plan), ("--out", &out), ("--runs", &runs)];
    let found = json(&mackrl(&["reproduce", "figure4-neurips", "--json"], &paths));
    let rows = found["rows"].as_array().expect("rows").iter();
    let rows: Vec<(&Value, &Value)> = rows.map(|row| (&row["learner"], &row["runs"])).collect();
    // As a plan orders its variants.
    assert_eq!(
        rows,
        [(&"coma".into(), &1.into()), (&"mackrl".into(), &1.into())]
    );
    let beside = found["beside"].as_array().expect("points");
    assert_eq!(beside.len(), 8, "0.5, 1, 1.5 and 2 million steps of both");
    assert_eq!(
        (&beside[4]["recorded"], &beside[4]["ours"]),
        (&0.91.into(), &Value::Null)
    );
    let mut claims = found["claims"].as_array().expect("claims").iter();
    assert!(claims.all(|claim| claim["verdict"] == "not-tested"));
    let table = fs::read_to_string(&readme).expect("the page");
    assert!(
        table.contains("| 3m | mackrl | 500 k | – | 0 | 0.910 |"),
        "{table}"
    );
    assert!(
        table.contains("Needs 5 runs of 2000000 steps of each of mackrl and"),
        "{table}"
    );
    // The other command draws the same plan beside its own points: the real game's, of other learners.
    let other = mackrl(
        &["reproduce", "calibration", "--as-it-stands", "--json"],
        &paths,
    );
    assert_eq!(json(&other).get("beside"), None);
}

/// The folders of the committed teams.
fn committed() -> Vec<PathBuf> {
    let zoo = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../zoo");
    let entries = fs::read_dir(zoo).expect("the zoo is committed");
    let mut teams: Vec<PathBuf> = entries.map(|entry| entry.expect("a team").path()).collect();
    teams.retain(|path| path.is_dir());
    teams.sort();
    teams
}

#[test]
fn committed_teams_win_what_they_won_to_the_last_battle() {
    let teams = committed();
    assert!(!teams.is_empty(), "no team is committed");
    for folder in teams {
        // Starts differ, and a team that sees them does not play one script.
        let scripts = plays_as_recorded(&folder);
        assert!(
            scripts.iter().all(|scripts| *scripts > 1.5),
            "{scripts:?} openings of {}",
            folder.display()
        );
        let replays = fs::read_dir(folder.join("replays")).expect("replays");
        let replays: Vec<PathBuf> = replays
            .map(|entry| entry.expect("a replay").path())
            .collect();
        assert!(!replays.is_empty(), "{}", folder.display());
        for shown in ["battle.html", "README.md"] {
            assert!(
                folder.join(shown).is_file(),
                "{} has no {shown}",
                folder.display()
            );
        }
        for replay in replays {
            let output = mackrl(&["replay"], &[("--", &replay)]);
            let error = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{}: {error}", replay.display());
        }
    }
}
