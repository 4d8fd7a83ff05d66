use super::*;

fn free_path(parent: &tempfile::TempDir) -> PathBuf {
    parent.path().join("runs").join("first")
}

#[test]
fn a_run_is_read_as_it_was_written() {
    let parent = tempfile::tempdir().unwrap();
    let path = free_path(&parent);
    let mut config = Config::default();
    config.run.seed = 5;
    let mut folder = RunFolder::create(&path, &config, 2).unwrap();
    folder.append_metrics("{\"t_env\":3}").unwrap();
    folder
        .write_weights(WhichWeights::Last, &[1, 2, 3])
        .unwrap();
    folder.set_status(Status::Finished).unwrap();
    let run = Run::open(&path, WhichWeights::Last).unwrap();
    assert_eq!(run.config, config);
    assert_eq!(run.weights, [1, 2, 3]);
    assert_eq!(StoredRun::open(&path).unwrap().status(), Status::Finished);
}

#[test]
fn a_folder_that_holds_a_run_is_never_written_to() {
    let parent = tempfile::tempdir().unwrap();
    let path = free_path(&parent);
    RunFolder::create(&path, &Config::default(), 1).unwrap();
    let before = fs::read(path.join(RUN)).unwrap();
    let error = RunFolder::create(&path, &Config::default(), 1).unwrap_err();
    assert!(
        error
            .to_string()
            .ends_with("runs/first already holds an unfinished run, and is not overwritten"),
        "{error}"
    );
    assert_eq!(fs::read(path.join(RUN)).unwrap(), before);
}

#[test]
fn a_folder_with_other_files_is_refused_and_an_empty_one_taken() {
    let parent = tempfile::tempdir().unwrap();
    assert!(RunFolder::check_free(parent.path()).is_ok());
    fs::write(parent.path().join("notes"), "mine").unwrap();
    let error = RunFolder::create(parent.path(), &Config::default(), 1).unwrap_err();
    assert!(error.to_string().contains("holds other files"), "{error}");
}

#[test]
fn a_file_in_the_place_of_the_folder_is_refused() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("file");
    fs::write(&path, "mine").unwrap();
    assert!(RunFolder::create(&path, &Config::default(), 1).is_err());
    assert_eq!(fs::read(&path).unwrap(), b"mine");
}

#[test]
fn a_folder_without_a_run_or_with_half_of_one_is_named() {
    let parent = tempfile::tempdir().unwrap();
    let error = Run::open(parent.path(), WhichWeights::Last).unwrap_err();
    assert!(error.to_string().contains("is not a run folder"), "{error}");
    let path = free_path(&parent);
    RunFolder::create(&path, &Config::default(), 1).unwrap();
    let error = Run::open(&path, WhichWeights::Last).unwrap_err();
    assert!(
        error.to_string().contains("the run has only begun"),
        "{error}"
    );
}

#[test]
fn a_damaged_configuration_is_named_with_file_and_line() {
    let parent = tempfile::tempdir().unwrap();
    let path = free_path(&parent);
    RunFolder::create(&path, &Config::default(), 1).unwrap();
    fs::write(path.join(CONFIG), "[algorithm]\ngamma = 7\n").unwrap();
    let error = Run::open(&path, WhichWeights::Last).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("config.toml:2:9: `algorithm.gamma` is 7"),
        "{error}"
    );
}

#[cfg(unix)]
#[test]
fn nothing_outside_a_strangers_run_folder_is_touched() {
    use std::os::unix::fs::symlink;

    for own in [
        CONFIG,
        METRICS,
        RUN,
        WEIGHTS,
        LOCK,
        CHECKPOINTS,
        "run.json.tmp",
    ] {
        let parent = tempfile::tempdir().unwrap();
        let path = free_path(&parent);
        RunFolder::create(&path, &Config::default(), 1).unwrap();
        let mine = parent.path().join("mine");
        fs::write(&mine, Config::default().to_toml()).unwrap();
        let link = path.join(own);
        let _ = fs::remove_file(&link);
        symlink(&mine, &link).unwrap();
        for error in [
            RunFolder::resume(&path, 1).unwrap_err(),
            Run::open(&path, WhichWeights::Last).unwrap_err(),
        ] {
            let message = error.to_string();
            assert!(
                message.contains("is a symbolic link, expected a"),
                "{message}"
            );
            assert!(message.contains(own), "{message}");
        }
        assert_eq!(
            fs::read_to_string(&mine).unwrap(),
            Config::default().to_toml()
        );
    }
}

#[cfg(unix)]
#[test]
fn a_checkpoint_that_leads_elsewhere_is_refused() {
    let parent = tempfile::tempdir().unwrap();
    let path = free_path(&parent);
    RunFolder::create(&path, &Config::default(), 1).unwrap();
    let elsewhere = parent.path().join("elsewhere");
    fs::create_dir_all(elsewhere.join("000000000007.tmp")).unwrap();
    fs::create_dir(path.join(CHECKPOINTS)).unwrap();
    std::os::unix::fs::symlink(&elsewhere, path.join(CHECKPOINTS).join("000000000001")).unwrap();
    let message = RunFolder::resume(&path, 1).unwrap_err().to_string();
    assert!(
        message.contains("is a symbolic link, expected a folder"),
        "{message}"
    );
    assert!(elsewhere.join("000000000007.tmp").exists());
}

/// A memory of the episodes with these numbers.
fn memory(numbers: std::ops::Range<u64>) -> mackrl::experience::MemoryState {
    mackrl::experience::MemoryState {
        first: numbers.start,
        episodes: numbers
            .map(|number| number.to_le_bytes().as_slice().into())
            .collect(),
    }
}

#[test]
fn remembered_episodes_are_written_once_and_gone_when_the_run_is_over() {
    let parent = tempfile::tempdir().unwrap();
    let path = free_path(&parent);
    let mut folder = RunFolder::create(&path, &Config::default(), 1).unwrap();
    let checkpoint = |memory| Checkpoint {
        tensors: vec![1; 100],
        counters: b"{}".to_vec(),
        best: None,
        memory,
    };
    let first = checkpoint(Some(memory(0..300)));
    let second = checkpoint(Some(memory(120..500)));
    folder.write_checkpoint(1, &first).unwrap();
    folder.write_checkpoint(2, &second).unwrap();
    let files = |number: usize| {
        let folder = path.join(CHECKPOINTS).join(format!("{number:012}"));
        let names = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = names.map(|entry| entry.unwrap().path()).collect();
        names.retain(|name| name.to_string_lossy().contains("memory-"));
        names.sort();
        names
    };
    assert_eq!([files(1).len(), files(2).len()], [2, 2]);
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let file = |path: &Path| fs::metadata(path).unwrap().ino();
        assert_eq!(file(&files(1)[1]), file(&files(2)[0]), "block 1 is linked");
    }
    drop(folder);
    let Resumption {
        mut folder,
        checkpoint: found,
        damaged,
        ..
    } = RunFolder::resume(&path, 1).unwrap();
    assert!(found.as_ref() == Some(&second) && damaged.is_empty());
    // An earlier block that is damaged costs the checkpoints that have it, and is told.
    fs::write(&files(2)[1], b"other").unwrap();
    drop(folder);
    let resumption = RunFolder::resume(&path, 1).unwrap();
    assert!(resumption.checkpoint == Some(first));
    assert!(resumption.damaged[0].contains("memory-000000000002.episodes"));
    folder = resumption.folder;
    folder.write_checkpoint(3, &checkpoint(None)).unwrap();
    let left = fs::read_dir(path.join(CHECKPOINTS)).unwrap();
    assert_eq!(left.count(), 1, "the last checkpoint needs no memory");
}
