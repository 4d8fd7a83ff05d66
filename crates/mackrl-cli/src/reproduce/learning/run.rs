//! One training run, as the figures need it.

use std::{fs, path::Path};

use anyhow::Context as _;
use mackrl::config::{Config, ConfigBuilder};
use serde::{Deserialize, Serialize};

use super::LearningOptions;
use crate::{
    failure::Failure,
    provenance::{CODE, Provenance},
    recorded::{Measurements, RecordedRun},
    reproduce::write,
    sweep::Entry,
};

/// Folder of the small files, below the figure's.
const RUNS: &str = "runs";
/// Folder of the run folders, below the figure's.
const TRAINING: &str = "training";

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

/// What a run gave.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct TrainingRun {
    /// Where it comes from; files of early versions do not say.
    #[serde(default)]
    provenance: Option<Provenance>,
    /// The whole configuration, as TOML.
    config: String,
    /// Share of battles won at each test: before training, and after each interval.
    pub(crate) battle_won: Vec<f64>,
    /// During each interval, the share of chosen pairs that delegated, by the number of enemies they commonly knew; `None`
    /// where that did not occur.
    pub(crate) delegation: Vec<Vec<Option<f64>>>,
}

impl TrainingRun {
    /// Where these runs come from, repetitions of one experiment taken together.
    pub(crate) fn provenance_of(runs: &[Self]) -> Vec<Provenance> {
        Provenance::merged(runs.iter().map(Self::provenance))
    }

    fn provenance(&self) -> &Provenance {
        let provenance = self.provenance.as_ref();
        provenance.expect("a run has a provenance when it was made, and when it was loaded")
    }

    /// Reads what the figures need from the folder of a finished run.
    fn of_folder(folder: &Path) -> anyhow::Result<Self> {
        let run = RecordedRun::open(folder.to_owned())?;
        let won = Measurements::read(&run, "test_battle_won_mean")?;
        let mut delegation = vec![Vec::new(); won.values.len()];
        let world = run.config.env.make()?;
        let enemies = world.spec().entities - world.spec().agents;
        for enemies in 0..=enemies {
            let metric = format!("mackrl/delegation_rate_ck_enemies_{enemies}");
            let rates = match Measurements::read(&run, &metric) {
                Ok(rates) => rates,
                Err(error) if Failure::is_missing_metric(&error) => continue,
                Err(error) => return Err(error),
            };
            for (&step, &rate) in rates.steps.iter().zip(&rates.values) {
                // Rows of tests are those that count; a test after the last batch may stand at the step of another row.
                let Some(test) = won.steps.iter().rposition(|&test| test == step) else {
                    continue;
                };
                delegation[test].resize(enemies, None);
                delegation[test].push(Some(rate));
            }
        }
        Ok(Self {
            provenance: run.provenance.into_iter().next_back(),
            config: run.config.to_toml(),
            battle_won: won.values,
            delegation,
        })
    }
}

#[cfg(test)]
impl TrainingRun {
    /// A run of the built-in configuration that won so often at its tests.
    pub(crate) fn of_wins(battle_won: &[f64]) -> Self {
        let config = Config::default();
        Self {
            provenance: Some(Provenance::of_run(&config)),
            config: config.to_toml(),
            battle_won: battle_won.to_vec(),
            delegation: Vec::new(),
        }
    }
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
        let algorithm = format!("policy.algorithm={}", learner.setting());
        Self::new(map, learner.setting(), &[&algorithm], seed)
    }

    /// The run, if it was made before with this configuration.
    pub(super) fn load(&self, options: &LearningOptions) -> anyhow::Result<Option<TrainingRun>> {
        let config = self.config(options)?;
        let path = options.out.join(RUNS).join(self.file_name());
        let Some(run) = load(&path, &config) else {
            return Ok(None);
        };
        let provenance = run.provenance();
        if provenance.code != CODE && !options.any_code {
            let code = provenance.code.clone();
            return Err(Failure::OtherCode { path, code }.into());
        }
        Ok(Some(run))
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
        let folder = options.out.join(RUNS);
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
            format!("env.map={}", self.map),
            format!("run.seed={}", self.seed),
            format!("run.steps_env={steps}"),
            format!("run.metrics_interval_steps_env={interval}"),
            format!("test.interval_steps_env={interval}"),
        ];
        let preset = ConfigBuilder::new().preset(&options.preset)?;
        let builder = (common.iter().chain(&self.settings))
            .try_fold(preset, |builder, setting| builder.set(setting))?;
        Ok(builder.build()?)
    }
}

/// A run that was made before with this configuration; settings that did not exist then count as their built-in values.
fn load(path: &Path, config: &Config) -> Option<TrainingRun> {
    let mut run: TrainingRun = serde_json::from_str(&fs::read_to_string(path).ok()?).ok()?;
    run.provenance
        .get_or_insert_with(|| Provenance::of_unknown_code(config));
    let name = path.display().to_string();
    let then = ConfigBuilder::new().file(&name, &run.config).ok()?;
    (then.build().ok()? == *config).then_some(run)
}
