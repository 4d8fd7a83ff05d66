//! `mackrl train`: from a configuration to a run folder.

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use mackrl::{config::Config, training::Trainer};
use serde::Serialize;

use crate::{
    args::TrainArgs,
    output,
    progress::{Progress, Standing},
    run_folder::{RunFolder, Status},
};

/// What one update gave.
#[derive(Debug, Clone, PartialEq)]
struct Update {
    /// A row of metrics as one JSON object, without a line break, if one was due.
    metrics: Option<String>,
    /// How the run stands, for the person who waits.
    standing: Standing,
}

/// Something that learns from one batch of episodes after the other.
trait Training {
    /// Plays and learns from one batch.
    fn update(&mut self) -> Result<Update, mackrl::Error>;
    /// Whether the configured number of steps has been played.
    fn finished(&self) -> bool;
    /// The weights as safetensors.
    fn weights(&self) -> Vec<u8>;
}

/// A trainer, and what it last reported for the person who waits.
struct Reporting {
    trainer: Trainer,
    standing: Standing,
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
        let metrics = row.map(|row| serde_json::to_string(&row).expect("numbers can be written"));
        Ok(Update {
            metrics,
            standing: self.standing,
        })
    }

    fn finished(&self) -> bool {
        self.trainer.finished()
    }

    fn weights(&self) -> Vec<u8> {
        self.trainer.weights()
    }
}

/// What a finished run says of itself.
#[derive(Debug, Serialize)]
struct Summary {
    /// Where the run lies.
    folder: PathBuf,
    /// Environment steps played.
    steps_env: u64,
    /// Seconds that training took.
    wall_s: f64,
    /// Environment steps a second, everything included.
    steps_per_s: f64,
}

/// Trains a team. Everything that can be wrong with what was typed is found before the run folder is created.
pub(crate) fn run(args: &TrainArgs) -> anyhow::Result<()> {
    let config = args.configuration.layers()?.build()?;
    let path = args.out.clone().unwrap_or_else(|| default_folder(&config));
    RunFolder::check_free(&path)?;
    let threads = args.threads.count();
    let standing = Standing {
        steps_env_total: config.run.steps_env,
        ..Standing::default()
    };
    let mut training = Reporting {
        trainer: Trainer::new(&config, threads)?,
        standing,
    };
    let mut folder = RunFolder::create(&path, &config, threads)?;
    let summary = train_into(&mut folder, &mut training, &mut Progress::new())?;
    print(&summary, args.json)
}

/// Where a run lies if nothing else is asked for.
fn default_folder(config: &Config) -> PathBuf {
    let algorithm = config
        .get("policy.algorithm")
        .and_then(|name| name.as_str().map(str::to_owned))
        .unwrap_or_default();
    let Config { env, run, .. } = config;
    let map = Path::new(&env.map).file_stem().unwrap_or_default();
    let name = format!("{}-{algorithm}-seed{}", map.display(), run.seed);
    Path::new("runs").join(name)
}

/// Trains to the end, and keeps metrics, status and weights in `folder`.
fn train_into(
    folder: &mut RunFolder,
    training: &mut impl Training,
    progress: &mut Progress,
) -> anyhow::Result<Summary> {
    let outcome = train(folder, training, progress);
    progress.finish();
    let recorded = folder.set_status(match &outcome {
        Ok(_) => Status::Finished,
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
    progress: &mut Progress,
) -> anyhow::Result<Summary> {
    let start = Instant::now();
    let mut steps_env = 0;
    while !training.finished() {
        let Update { metrics, standing } = training.update()?;
        if let Some(metrics) = metrics {
            folder.append_metrics(&metrics)?;
        }
        progress.show(&standing);
        steps_env = standing.steps_env;
    }
    folder.write_weights(&training.weights())?;
    let wall_s = start.elapsed().as_secs_f64();
    Ok(Summary {
        folder: folder.path().to_owned(),
        steps_env,
        wall_s,
        steps_per_s: steps_env as f64 / wall_s.max(1e-9),
    })
}

/// Prints what a finished run says of itself.
fn print(summary: &Summary, json: bool) -> anyhow::Result<()> {
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
    use super::*;
    use crate::run_folder::Run;

    /// Learns nothing; fails at the update given by `fails_at`.
    struct Counting {
        updates: u64,
        length: u64,
        fails_at: Option<u64>,
    }

    impl Training for Counting {
        fn update(&mut self) -> Result<Update, mackrl::Error> {
            self.updates += 1;
            if self.fails_at == Some(self.updates) {
                return Err(mackrl::Error::Data("planted".to_owned()));
            }
            Ok(Update {
                metrics: Some(format!("{{\"t_env\":{}}}", self.updates)),
                standing: Standing {
                    steps_env: self.updates,
                    ..Standing::default()
                },
            })
        }

        fn finished(&self) -> bool {
            self.updates >= self.length
        }

        fn weights(&self) -> Vec<u8> {
            vec![7, 11]
        }
    }

    fn run(fails_at: Option<u64>) -> (tempfile::TempDir, PathBuf, anyhow::Result<Summary>) {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("run");
        let mut folder = RunFolder::create(&path, &Config::default(), 1).unwrap();
        let mut training = Counting {
            updates: 0,
            length: 3,
            fails_at,
        };
        let outcome = train_into(&mut folder, &mut training, &mut Progress::silent());
        (parent, path, outcome)
    }

    fn status(path: &Path) -> String {
        let text = std::fs::read_to_string(path.join("run.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        json["status"].as_str().unwrap().to_owned()
    }

    #[test]
    fn a_run_leaves_metrics_weights_and_its_status() {
        let (_parent, path, outcome) = run(None);
        assert_eq!(outcome.unwrap().steps_env, 3);
        let metrics = std::fs::read_to_string(path.join("metrics.jsonl")).unwrap();
        assert_eq!(metrics, "{\"t_env\":1}\n{\"t_env\":2}\n{\"t_env\":3}\n");
        assert_eq!(Run::open(&path).unwrap().weights, [7, 11]);
        assert_eq!(status(&path), "finished");
    }

    #[test]
    fn a_run_that_fails_keeps_what_it_had_and_says_so() {
        let (_parent, path, outcome) = run(Some(3));
        assert!(outcome.is_err());
        let metrics = std::fs::read_to_string(path.join("metrics.jsonl")).unwrap();
        assert_eq!(metrics, "{\"t_env\":1}\n{\"t_env\":2}\n");
        assert_eq!(status(&path), "failed");
        assert!(!path.join("weights.safetensors").exists());
    }

    #[test]
    fn a_run_is_named_after_what_makes_it_different() {
        assert_eq!(
            default_folder(&Config::default()),
            Path::new("runs/3m-mackrl-seed1")
        );
    }
}
