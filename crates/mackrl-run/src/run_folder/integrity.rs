//! What is read is the run's own and whole, and what is written reaches no other run.

use super::*;
use crate::training::Trainer;

fn config(seed: u64) -> Config {
    let settings = [
        "algorithm.name=central-v".to_owned(),
        "algorithm.hidden=3".to_owned(),
        "algorithm.environments=2".to_owned(),
        "test.episodes=1".to_owned(),
        format!("run.seed={seed}"),
    ];
    Config::with(&settings.each_ref().map(String::as_str)).expect("settings that there are")
}

/// A run with two checkpoints, and the later of them.
fn unfinished(path: &Path) -> (RunFolder, Checkpoint) {
    let mut trainer = Trainer::new(&config(1), 1).unwrap();
    let mut folder = RunFolder::create(path, &config(1), 1).unwrap();
    for number in 1..=2 {
        trainer.update().unwrap();
        folder
            .append_metrics(&format!("{{\"t_env\":{number}}}"))
            .unwrap();
        folder
            .write_checkpoint(number, &trainer.checkpoint())
            .unwrap();
    }
    (folder, trainer.checkpoint())
}

/// A run at its end.
fn finished(path: &Path) {
    let (mut folder, checkpoint) = unfinished(path);
    folder
        .write_weights(WhichWeights::Last, &checkpoint.tensors)
        .unwrap();
    folder.set_status(Status::Finished).unwrap();
}

/// All files of a folder with their content.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(contents(&path));
        } else {
            found.push((path.clone(), fs::read(path).unwrap()));
        }
    }
    found.sort();
    found
}

#[cfg(unix)]
#[test]
fn a_run_whose_folder_was_replaced_writes_nothing_into_the_new_one() {
    let moves: [fn(&Path); 3] = [
        |path| fs::rename(path, path.with_extension("old")).unwrap(),
        |path| fs::remove_dir_all(path).unwrap(),
        |path| {
            for (file, _) in contents(path) {
                fs::remove_file(file).unwrap();
            }
            fs::remove_dir_all(path.join(CHECKPOINTS)).unwrap();
        },
    ];
    for (case, replace) in moves.into_iter().enumerate() {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("run");
        let (mut old, checkpoint) = unfinished(&path);
        replace(&path);
        let _new = RunFolder::create(&path, &config(2), 1).unwrap();
        let before = contents(&path);
        let outcomes = [
            old.append_metrics("{\"t_env\":3}"),
            old.write_checkpoint(3, &checkpoint),
            old.write_weights(WhichWeights::Last, b"weights"),
            old.write_weights(WhichWeights::Best, b"weights"),
            old.write_events(3),
        ];
        for outcome in outcomes {
            assert!(
                matches!(outcome, Err(RunError::FolderReplaced { .. })),
                "case {case}: {outcome:?}"
            );
        }
        // The old run may still say in its own folder that it failed.
        let _ = old.set_status(Status::Failed);
        assert_eq!(contents(&path), before, "case {case}");
    }
}

#[test]
fn no_damage_to_metrics_costs_a_checkpoint() {
    let damages: [fn(&Path); 5] = [
        |path| fs::remove_file(path).unwrap(),
        |path| fs::write(path, "").unwrap(),
        |path| fs::write(path, "{\"t_env\":7}\n{\"t_env\":9}\n").unwrap(),
        |path| fs::write(path, fs::read_to_string(path).unwrap().replace('1', "3")).unwrap(),
        |path| {
            fs::write(
                path,
                fs::read_to_string(path).unwrap().replace('\n', "\r\n"),
            )
            .unwrap();
        },
    ];
    for (case, damage) in damages.into_iter().enumerate() {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("run");
        let (folder, checkpoint) = unfinished(&path);
        drop(folder);
        damage(&path.join(METRICS));
        let left = fs::read(path.join(METRICS)).ok();
        assert_eq!(
            Run::open(&path, WhichWeights::Last).unwrap().weights,
            checkpoint.tensors
        );
        let resumption = RunFolder::resume(&path, 1).unwrap();
        assert!(resumption.checkpoint == Some(checkpoint), "case {case}");
        let aside = resumption.metrics_put_aside.expect("it is told");
        assert_eq!(fs::read(aside).ok(), left, "case {case}");
        assert_eq!(fs::read(path.join(METRICS)).unwrap(), b"");
        let (_, description) = read_description(&path).unwrap();
        assert_eq!(description.metrics_put_aside, ["metrics.jsonl.damaged"]);
    }
}

#[test]
fn a_configuration_that_says_the_same_in_other_bytes_is_the_same() {
    for change in [
        |text: String| text.replace('\n', "\r\n"),
        |text: String| text + "\n# a note\n",
    ] {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("run");
        drop(unfinished(&path));
        let file = path.join(CONFIG);
        fs::write(&file, change(fs::read_to_string(&file).unwrap())).unwrap();
        let resumption = RunFolder::resume(&path, 1).unwrap();
        assert!(resumption.checkpoint.is_some() && resumption.damaged.is_empty());
    }
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("run");
    drop(unfinished(&path));
    fs::write(path.join(CONFIG), config(2).to_toml()).unwrap();
    let error = RunFolder::resume(&path, 1).unwrap_err().chain();
    assert!(error.contains("config.toml is not what"), "{error}");
}

#[test]
fn a_finished_run_is_refused_where_it_is_not_what_it_was() {
    let refused = |path: &Path, name: &str| {
        let errors = [
            (WEIGHTS, Run::open(path, WhichWeights::Last).map(drop)),
            (METRICS, Recorded::open(path).map(drop)),
            (METRICS, read_rows(path).map(drop)),
            (CONFIG, read_description(path).map(drop)),
        ];
        let of_the_file = errors.into_iter().filter(|(own, _)| *own == name);
        for (_, outcome) in of_the_file {
            let error = outcome.unwrap_err().chain();
            assert!(error.contains("is not what run.json says"), "{error}");
            assert!(error.contains(name), "{error}");
        }
    };
    for (name, other) in [
        (WEIGHTS, b"".to_vec()),
        (WEIGHTS, vec![7; 100]),
        (METRICS, b"{\"t_env\":1}\n".to_vec()),
        (METRICS, b"{\"t_env\":1}\n{\"t_env\":4}\n".to_vec()),
        (METRICS, b"{\"t_env\":1}\n{\"t_env\":2}\n{\"t".to_vec()),
        (CONFIG, config(2).to_toml().into_bytes()),
    ] {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("run");
        finished(&path);
        assert!(Recorded::open(&path).is_ok());
        fs::write(path.join(name), other).unwrap();
        refused(&path, name);
    }
}

#[test]
fn weights_that_a_finished_run_lost_are_known_to_be_missing() {
    for damage in [
        |path: &Path| fs::remove_file(path).unwrap(),
        |path: &Path| fs::write(path, "").unwrap(),
    ] {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("run");
        finished(&path);
        let completeness = || StoredRun::open(&path).unwrap().completeness().unwrap();
        assert_eq!(completeness(), Completeness::Finished);
        damage(&path.join(WEIGHTS));
        assert_eq!(completeness(), Completeness::WithoutWeights);
    }
}

#[test]
fn two_processes_with_one_number_in_one_second_have_event_files_of_their_own() {
    let parent = tempfile::tempdir().unwrap();
    let (mut folder, _) = unfinished(&parent.path().join("run"));
    for _ in 0..3 {
        folder.write_events(0).unwrap();
    }
    let names = fs::read_dir(folder.path()).unwrap();
    let names = names.map(|entry| entry.unwrap().file_name());
    let events = names.filter(|name| name.to_string_lossy().starts_with("events."));
    assert_eq!(events.count(), 3);
}
