//! One training run, as the figures need it.

use std::{fs, path::PathBuf};

use anyhow::Context as _;
use mackrl::{
    config::{Config, ConfigBuilder},
    training::{MetricRow, Trainer},
};
use serde::{Deserialize, Serialize};

use super::{LearningOptions, PROGRESS_STEPS};
use crate::{
    failure::Failure,
    provenance::{CODE, Provenance},
    reproduce::write,
};

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

/// A run to be made: a learner on a map with a seed, all else by a preset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Job {
    /// The map's name.
    pub(crate) map: &'static str,
    /// Who learns.
    pub(crate) learner: Learner,
    /// The run's seed.
    pub(crate) seed: u64,
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
}

impl Job {
    /// Makes the run, or reads it if it was made before. `advance` hears of thousands of steps, `thousands` in all.
    pub(super) fn run_or_load(
        &self,
        options: &LearningOptions,
        thousands: usize,
        advance: &(dyn Fn(usize) + Sync),
    ) -> anyhow::Result<TrainingRun> {
        let config = self.config(options)?;
        let path = self.path(options);
        if let Some(run) = load(&path, &config) {
            let provenance = run.provenance();
            if provenance.code != CODE && !options.any_code {
                let code = provenance.code.clone();
                return Err(Failure::OtherCode { path, code }.into());
            }
            advance(thousands);
            return Ok(run);
        }
        let run = train(&config, thousands, advance)?;
        let json = serde_json::to_string(&run)? + "\n";
        let folder = path.parent().context("a run lies in a folder")?;
        fs::create_dir_all(folder).with_context(|| format!("creating {}", folder.display()))?;
        write(folder, &self.file_name(), json.as_bytes())?;
        Ok(run)
    }

    fn path(&self, options: &LearningOptions) -> PathBuf {
        options.out.join("runs").join(self.file_name())
    }

    fn file_name(&self) -> String {
        let Self { map, learner, seed } = self;
        format!("{map}-{}-seed{seed}.json", learner.setting())
    }

    fn config(&self, options: &LearningOptions) -> anyhow::Result<Config> {
        let LearningOptions {
            steps, interval, ..
        } = options;
        let settings = [
            format!("env.map={}", self.map),
            format!("policy.algorithm={}", self.learner.setting()),
            format!("run.seed={}", self.seed),
            format!("run.steps_env={steps}"),
            format!("run.metrics_interval_steps_env={interval}"),
            format!("test.interval_steps_env={interval}"),
        ];
        let preset = ConfigBuilder::new().preset(&options.preset)?;
        let builder = settings
            .iter()
            .try_fold(preset, |builder, setting| builder.set(setting))?;
        Ok(builder.build()?)
    }
}

/// A run that was made before with this configuration.
fn load(path: &PathBuf, config: &Config) -> Option<TrainingRun> {
    let mut run: TrainingRun = serde_json::from_str(&fs::read_to_string(path).ok()?).ok()?;
    run.provenance
        .get_or_insert_with(|| Provenance::of_unknown_code(config));
    (run.config == config.to_toml()).then_some(run)
}

fn train(
    config: &Config,
    thousands: usize,
    advance: &(dyn Fn(usize) + Sync),
) -> anyhow::Result<TrainingRun> {
    let mut trainer = Trainer::new(config, 1)?;
    let mut run = TrainingRun {
        provenance: Some(Provenance::of_run(config)),
        config: config.to_toml(),
        battle_won: Vec::new(),
        delegation: Vec::new(),
    };
    let mut advanced = 0;
    while !trainer.finished() {
        if let Some(row) = trainer.update()?
            && let Some(battle_won) = row.get("test_battle_won_mean")
        {
            run.battle_won.push(battle_won);
            run.delegation.push(delegation(&row));
        }
        let played = usize::try_from(trainer.steps_env() / PROGRESS_STEPS).unwrap_or(usize::MAX);
        let played = played.min(thousands);
        if played > advanced {
            advance(played - advanced);
            advanced = played;
        }
    }
    advance(thousands - advanced);
    Ok(run)
}

/// Delegation rates by the number of commonly known enemies, from none to as many as the row has.
fn delegation(row: &MetricRow) -> Vec<Option<f64>> {
    let rate = |enemies| row.get(&format!("mackrl/delegation_rate_ck_enemies_{enemies}"));
    let most = (0..128).rev().find(|&enemies| rate(enemies).is_some());
    most.map_or_else(Vec::new, |most| (0..=most).map(rate).collect())
}
