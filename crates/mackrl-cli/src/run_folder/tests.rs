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
    folder.write_weights(&[1, 2, 3]).unwrap();
    folder.set_status(Status::Finished).unwrap();
    let run = Run::open(&path).unwrap();
    assert_eq!(run.config, config);
    assert_eq!(run.weights, [1, 2, 3]);
    assert_eq!(recorded_status(&path), Some(Status::Finished));
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
    let error = Run::open(parent.path()).unwrap_err();
    assert!(error.to_string().contains("is not a run folder"), "{error}");
    let path = free_path(&parent);
    RunFolder::create(&path, &Config::default(), 1).unwrap();
    let error = Run::open(&path).unwrap_err();
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
    fs::write(path.join(CONFIG), "[learner]\ngamma = 7\n").unwrap();
    let error = Run::open(&path).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("config.toml:2:9: `learner.gamma` is 7"),
        "{error}"
    );
}
