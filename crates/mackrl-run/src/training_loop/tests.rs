use super::*;
use crate::run_folder::{Run, read_description};

/// Learns nothing; fails at the update given by `fails_at`, and is asked to stop during the one given by `stops_at`.
#[derive(Default)]
struct Counting {
    updates: u64,
    fails_at: Option<u64>,
    stops_at: Option<u64>,
    stops_judging: bool,
    stop: StopRequest,
}

fn teams() -> Teams {
    let last = Score {
        steps_env: 3,
        mean: 0.5,
        standard_error: 0.1,
        episodes: 20,
    };
    Teams {
        measure: "battle_won".to_owned(),
        last,
        best: None,
    }
}

impl Training for Counting {
    fn update(&mut self) -> Result<Update, mackrl::Error> {
        self.updates += 1;
        if self.fails_at == Some(self.updates) {
            return Err(mackrl::Error::Data("planted".to_owned()));
        }
        if self.stops_at == Some(self.updates) {
            self.stop.make();
        }
        Ok(Update {
            metrics: Some(format!("{{\"t_env\":{}}}", self.updates)),
            standing: self.standing(),
            tested: None,
            kept: vec![
                (WhichWeights::Best, vec![3]),
                (WhichWeights::Step(self.updates), vec![4]),
            ],
        })
    }

    fn finished(&self) -> bool {
        self.updates >= 3
    }

    fn standing(&self) -> Standing {
        Standing {
            steps_env: self.updates,
            ..Standing::default()
        }
    }

    fn iterations(&self) -> u64 {
        self.updates
    }

    fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            tensors: vec![5],
            counters: self.updates.to_le_bytes().to_vec(),
            best: Some(vec![3]),
            memory: None,
        }
    }

    fn weights(&self) -> Vec<u8> {
        vec![7, 11]
    }

    fn judge(&mut self) -> Result<Teams, mackrl::Error> {
        if self.stops_judging {
            return Err(mackrl::Error::Stopped);
        }
        Ok(teams())
    }
}

fn run(training: Counting) -> (tempfile::TempDir, PathBuf, Result<Summary>) {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("run");
    let mut config = Config::default();
    config.run.checkpoint_interval_steps_env = 2;
    let mut folder = RunFolder::create(&path, &config, 1).unwrap();
    let stop = training.stop.clone();
    let mut training = Apart::start(
        move || -> Result<_> { Ok(training) },
        &StopRequest::default(),
    )
    .unwrap()
    .unwrap();
    let outcome = train_into(&mut folder, &mut training, &config, &stop, &mut ());
    (parent, path, outcome)
}

fn weights(path: &Path, which: WhichWeights) -> Vec<u8> {
    Run::open(path, which).unwrap().weights
}

fn status(path: &Path) -> String {
    let text = std::fs::read_to_string(path.join("run.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    json["status"].as_str().unwrap().to_owned()
}

/// Updates at the latest checkpoint.
fn checkpoint(path: &Path) -> Option<Vec<u8>> {
    let resumption = RunFolder::resume(path, 1).unwrap();
    resumption.checkpoint.map(|checkpoint| checkpoint.counters)
}

#[test]
fn a_run_leaves_metrics_weights_a_checkpoint_and_its_status() {
    let (_parent, path, outcome) = run(Counting::default());
    assert_eq!(outcome.unwrap().steps_env, 3);
    let metrics = std::fs::read_to_string(path.join("metrics.jsonl")).unwrap();
    assert_eq!(metrics, "{\"t_env\":1}\n{\"t_env\":2}\n{\"t_env\":3}\n");
    assert_eq!(weights(&path, WhichWeights::Last), [7, 11]);
    assert_eq!(weights(&path, WhichWeights::Best), [3]);
    assert_eq!(weights(&path, WhichWeights::Step(2)), [4]);
    assert_eq!(status(&path), "finished");
    let (_, description) = read_description(&path).unwrap();
    assert_eq!(description.teams, Some(teams()));
    let kept = [1, 2, 3].map(WhichWeights::Step);
    assert_eq!(
        description.kept,
        [&[WhichWeights::Best], &kept[..]].concat()
    );
    assert_eq!(checkpoint(&path), Some(3_u64.to_le_bytes().to_vec()));
}

#[test]
fn a_run_that_fails_keeps_its_latest_checkpoint_and_says_so() {
    let (_parent, path, outcome) = run(Counting {
        fails_at: Some(3),
        ..Counting::default()
    });
    assert!(outcome.is_err());
    assert_eq!(status(&path), "failed");
    assert!(!path.join("weights.safetensors").exists());
    assert_eq!(weights(&path, WhichWeights::Last), [5]);
    assert_eq!(checkpoint(&path), Some(2_u64.to_le_bytes().to_vec()));
}

#[test]
fn a_run_that_is_asked_to_stop_writes_a_checkpoint_first() {
    let (_parent, path, outcome) = run(Counting {
        stops_at: Some(1),
        ..Counting::default()
    });
    let message = outcome.unwrap_err().to_string();
    assert!(
        message.contains(
            "was stopped at 1 environment steps; its metrics and its latest checkpoint are kept"
        ),
        "{message}"
    );
    assert_eq!(status(&path), "interrupted");
    assert_eq!(checkpoint(&path), Some(1_u64.to_le_bytes().to_vec()));
}

#[test]
fn a_run_that_is_stopped_while_it_is_judged_has_its_last_checkpoint() {
    let (_parent, path, outcome) = run(Counting {
        stops_judging: true,
        ..Counting::default()
    });
    assert!(outcome.unwrap_err().is_interruption());
    assert_eq!(status(&path), "interrupted");
    assert_eq!(checkpoint(&path), Some(3_u64.to_le_bytes().to_vec()));
}

#[test]
fn kept_weights_are_those_of_the_checkpoint_when_a_run_goes_on() {
    let (_parent, path, outcome) = run(Counting {
        fails_at: Some(4),
        ..Counting::default()
    });
    assert!(outcome.is_ok());
    // The latest checkpoint is gone: the run goes on from that of the second update.
    std::fs::remove_dir_all(path.join("checkpoints/000000000003")).unwrap();
    std::fs::write(path.join("weights/best.safetensors"), b"later").unwrap();
    std::fs::write(path.join("weights/000000000001.safetensors"), b"damaged").unwrap();
    std::fs::write(path.join("weights/x.tmp"), b"half").unwrap();
    let resumption = RunFolder::resume(&path, 1).unwrap();
    assert_eq!(resumption.weights_lost.len(), 1);
    assert!(resumption.weights_lost[0].ends_with("000000000001.safetensors"));
    drop(resumption);
    assert_eq!(weights(&path, WhichWeights::Best), [3]);
    let error = Run::open(&path, WhichWeights::Step(3)).unwrap_err();
    let message = error.to_string();
    assert!(
        message.ends_with("keeps no weights `3`, the nearest are 2; there are: last, best, 2"),
        "{message}"
    );
    let left = std::fs::read_dir(path.join("weights")).unwrap();
    assert_eq!(left.count(), 2);
}
