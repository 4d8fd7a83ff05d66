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
