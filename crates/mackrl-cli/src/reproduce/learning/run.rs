//! One training run, as the figures need it.

use std::{fs, path::Path};

use anyhow::Context as _;
use mackrl_run::{
    config::{Config, ConfigBuilder},
    recorded::{KEPT, TRAINING, TrainingRun},
    sweep::Entry,
};
use serde::{Deserialize, Serialize};

use super::LearningOptions;
use crate::reproduce::write;

/// Who learns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Learner {
    /// Pairwise MACKRL.
    Mackrl,
    /// Central-V.
    CentralV,
}

impl Learner {
    /// Name in figures.
    #[must_use]
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Mackrl => "MACKRL",
            Self::CentralV => "Central-V",
        }
    }

    /// Name in configurations and files.
    const fn setting(self) -> &'static str {
        match self {
            Self::Mackrl => "mackrl",
            Self::CentralV => "central-v",
        }
    }
}

/// A run to be made: some settings laid over a preset, on a map, with a seed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Job {
    map: String,
    /// What the settings make of it, in names of files.
    kind: String,
    settings: Vec<String>,
    seed: u64,
}

impl Job {
    /// A run with `settings`, `kind` of them in the names of files.
    pub(crate) fn new(map: &str, kind: &str, settings: &[&str], seed: u64) -> Self {
        Self {
            map: map.to_owned(),
            kind: kind.to_owned(),
            settings: settings.iter().map(|&setting| setting.to_owned()).collect(),
            seed,
        }
    }

    /// A run of `learner`.
    pub(crate) fn of_learner(map: &str, learner: Learner, seed: u64) -> Self {
        let algorithm = format!("algorithm.name={}", learner.setting());
        Self::new(map, learner.setting(), &[&algorithm], seed)
    }

    /// The run, if it was made before with this configuration.
    pub(super) fn load(&self, options: &LearningOptions) -> anyhow::Result<Option<TrainingRun>> {
        let config = self.config(options)?;
        let path = options.out.join(KEPT).join(self.file_name());
        Ok(load(&path, &config))
    }

    /// The run as a run of a sweep.
    pub(super) fn entry(&self, options: &LearningOptions) -> anyhow::Result<Entry> {
        let name = self.name();
        Ok(Entry {
            folder: options.out.join(TRAINING).join(&name),
            config: self.config(options)?,
            name,
        })
    }

    /// Takes what the figures need from the run folder of `entry`, and keeps it.
    pub(super) fn keep(
        &self,
        entry: &Entry,
        options: &LearningOptions,
    ) -> anyhow::Result<TrainingRun> {
        let run = TrainingRun::of_folder(&entry.folder)?;
        let folder = options.out.join(KEPT);
        fs::create_dir_all(&folder).with_context(|| format!("creating {}", folder.display()))?;
        let json = serde_json::to_string(&run)? + "\n";
        write(&folder, &self.file_name(), json.as_bytes())?;
        Ok(run)
    }

    fn name(&self) -> String {
        let Self {
            map, kind, seed, ..
        } = self;
        format!("{map}-{kind}-seed{seed}")
    }

    fn file_name(&self) -> String {
        self.name() + ".json"
    }

    fn config(&self, options: &LearningOptions) -> anyhow::Result<Config> {
        let LearningOptions {
            steps, interval, ..
        } = options;
        let common = [
            format!("run.seed={}", self.seed),
            format!("run.steps_env={steps}"),
            format!("run.metrics_interval_steps_env={interval}"),
            format!("test.interval_steps_env={interval}"),
        ];
        let preset = ConfigBuilder::new(crate::registry())
            .preset(&options.preset)?
            .map(&format!("--map {}", self.map), &self.map);
        let builder = (common.iter().chain(&self.settings))
            .try_fold(preset, |builder, setting| builder.set(setting))?;
        Ok(builder.build()?)
    }
}

/// A run that was made before with this configuration; settings that did not exist then count as their built-in values.
fn load(path: &Path, config: &Config) -> Option<TrainingRun> {
    let run = TrainingRun::load(path).ok()?;
    (run.config().ok()? == *config).then_some(run)
}
