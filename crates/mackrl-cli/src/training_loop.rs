//! The loop around a trainer: metrics, checkpoints, progress, and an orderly stop.

use std::{path::PathBuf, time::Instant};

use mackrl_run::{
    config::Config,
    training::{Checkpoint, MetricRow, Trainer},
};
use serde::Serialize;

use crate::{
    failure::Failure,
    output,
    progress::{Progress, Standing},
    provenance::Provenance,
    run_folder::{RunFolder, Status},
    signals::StopRequest,
};

/// What one update gave.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Update {
    /// A row of metrics as one JSON object, without a line break, if one was due.
    metrics: Option<String>,
    /// How the run stands, for the person who waits.
    standing: Standing,
}

/// Something that learns from one batch of episodes after the other.
pub(crate) trait Training {
    /// Plays and learns from one batch.
    fn update(&mut self) -> Result<Update, mackrl::Error>;
    /// Whether the configured number of steps has been played.
    fn finished(&self) -> bool;
    /// How the run stands.
    fn standing(&self) -> Standing;
    /// Updates and tests so far, the same number at the same point of every repetition.
    fn iterations(&self) -> u64;
    /// Everything that the rest of the run depends on.
    fn checkpoint(&self) -> Checkpoint;
    /// The weights as safetensors.
    fn weights(&self) -> Vec<u8>;
}

/// A trainer, and what it last reported for the person who waits.
pub(crate) struct Reporting {
    trainer: Trainer,
    standing: Standing,
    provenance: String,
}

impl Reporting {
    /// A trainer of the run that `config` describes, at its beginning or restored, that gives up when asked to stop.
    pub(crate) fn new(mut trainer: Trainer, config: &Config, stop: &StopRequest) -> Self {
        trainer.stop_when(stop.flag());
        let standing = Standing {
            steps_env: trainer.steps_env(),
            steps_env_total: config.run.steps_env,
            ..Standing::default()
        };
        Self {
            trainer,
            standing,
            provenance: Provenance::of_run(config).id,
        }
    }
}

impl Training for Reporting {
    fn update(&mut self) -> Result<Update, mackrl::Error> {
        let row = self.trainer.update()?;
        self.standing.steps_env = self.trainer.steps_env();
        if let Some(row) = &row {
            let latest = |name, before| row.get(name).or(before);
            let Standing {
                battle_won_mean,
                delegation_rate,
                ..
            } = self.standing;
            self.standing.battle_won_mean = latest("test_battle_won_mean", battle_won_mean);
            self.standing.delegation_rate = latest("mackrl/delegation_rate", delegation_rate);
        }
        let metrics = row.map(|metrics| Row {
            metrics,
            provenance: &self.provenance,
        });
        let json = |row: Row<'_>| serde_json::to_string(&row).expect("numbers can be written");
        Ok(Update {
            metrics: metrics.map(json),
            standing: self.standing,
        })
    }

    fn finished(&self) -> bool {
        self.trainer.finished()
    }

    fn standing(&self) -> Standing {
        self.standing
    }

    fn iterations(&self) -> u64 {
        self.trainer.iterations()
    }

    fn checkpoint(&self) -> Checkpoint {
        self.trainer.checkpoint()
    }

    fn weights(&self) -> Vec<u8> {
        self.trainer.weights()
    }
}

/// A line of `metrics.jsonl`.
#[derive(Debug, Serialize)]
struct Row<'a> {
    #[serde(flatten)]
    metrics: MetricRow,
    /// Id of the provenance, which stands in `run.json`.
    provenance: &'a str,
}

/// What a finished run says of itself.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    /// Where the run lies.
    folder: PathBuf,
    /// Environment steps played.
    steps_env: u64,
    /// Seconds that training took, since it began or was resumed.
    wall_s: f64,
    /// Environment steps a second in that time, everything included.
    steps_per_s: f64,
}

/// Trains to the end, or until asked to stop, and keeps metrics, checkpoints, status and weights in `folder`.
///
/// # Errors
/// [`Failure::Interrupted`] when asked to stop, after a checkpoint; otherwise what went wrong.
pub(crate) fn train_into(
    folder: &mut RunFolder,
    training: &mut impl Training,
    config: &Config,
    stop: &StopRequest,
) -> anyhow::Result<Summary> {
    let mut progress = Progress::new(training.standing().steps_env);
    let outcome = train(folder, training, config, stop, &mut progress);
    progress.finish();
    let recorded = folder.set_status(match &outcome {
        Ok(_) => Status::Finished,
        Err(error) if Failure::is_interruption(error) => Status::Interrupted,
        Err(_) => Status::Failed,
    });
    // What stopped the training matters more than a status that cannot be written.
    let summary = outcome?;
    recorded?;
    Ok(summary)
}

fn train(
    folder: &mut RunFolder,
    training: &mut impl Training,
    config: &Config,
    stop: &StopRequest,
    progress: &mut Progress,
) -> anyhow::Result<Summary> {
    let start = Instant::now();
    let steps_env_before = training.standing().steps_env;
    if config.run.tensorboard {
        folder.write_events(steps_env_before)?;
    }
    let interval = config.run.checkpoint_interval_steps_env;
    let mut intervals = steps_env_before / interval;
    while !training.finished() {
        if stop.is_made() {
            folder.write_checkpoint(training.iterations(), &training.checkpoint())?;
            return Err(Failure::Interrupted {
                folder: folder.path().to_owned(),
                steps_env: training.standing().steps_env,
            }
            .into());
        }
        let Update { metrics, standing } = match training.update() {
            // What was begun was given up; the checkpoint is that of the moment before.
            Err(mackrl::Error::Stopped) => continue,
            Err(mackrl::Error::NotFinite(number)) => {
                return Err(Failure::UpdateRefused {
                    number,
                    folder: folder.path().to_owned(),
                }
                .into());
            }
            outcome => outcome?,
        };
        if let Some(metrics) = metrics {
            folder.append_metrics(&metrics)?;
        }
        progress.show(&standing);
        if standing.steps_env / interval > intervals {
            intervals = standing.steps_env / interval;
            folder.write_checkpoint(training.iterations(), &training.checkpoint())?;
        }
    }
    folder.write_checkpoint(training.iterations(), &training.checkpoint())?;
    folder.write_weights(&training.weights())?;
    let wall_s = start.elapsed().as_secs_f64();
    let steps_env = training.standing().steps_env;
    Ok(Summary {
        folder: folder.path().to_owned(),
        steps_env,
        wall_s,
        steps_per_s: (steps_env - steps_env_before) as f64 / wall_s.max(1e-9),
    })
}

/// Prints what a finished run says of itself.
pub(crate) fn print(summary: &Summary, json: bool) -> anyhow::Result<()> {
    if json {
        return output::print_json(summary);
    }
    output::print(&format!(
        "{}: {} environment steps in {:.1} s ({:.0} a second)\n",
        summary.folder.display(),
        summary.steps_env,
        summary.wall_s,
        summary.steps_per_s
    ))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::run_folder::Run;

    /// Learns nothing; fails at the update given by `fails_at`, and is asked to stop during the one given by `stops_at`.
    #[derive(Default)]
    struct Counting {
        updates: u64,
        fails_at: Option<u64>,
        stops_at: Option<u64>,
        stop: StopRequest,
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
            }
        }

        fn weights(&self) -> Vec<u8> {
            vec![7, 11]
        }
    }

    fn run(mut training: Counting) -> (tempfile::TempDir, PathBuf, anyhow::Result<Summary>) {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("run");
        let mut config = Config::default();
        config.run.checkpoint_interval_steps_env = 2;
        let mut folder = RunFolder::create(&path, &config, 1).unwrap();
        let stop = training.stop.clone();
        let outcome = train_into(&mut folder, &mut training, &config, &stop);
        (parent, path, outcome)
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
        assert_eq!(Run::open(&path).unwrap().weights, [7, 11]);
        assert_eq!(status(&path), "finished");
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
        assert_eq!(Run::open(&path).unwrap().weights, [5]);
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
            message.ends_with("was interrupted at 1 environment steps"),
            "{message}"
        );
        assert_eq!(status(&path), "interrupted");
        assert_eq!(checkpoint(&path), Some(1_u64.to_le_bytes().to_vec()));
    }
}
