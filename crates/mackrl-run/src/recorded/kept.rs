//! What is kept of a finished run when its folder is not: the numbers that figures are made of, in one small file.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Measurements, RecordedRun};
use crate::{
    bounded,
    config::{Config, ConfigBuilder, ConfigError, registry},
    error::{Result, RunError},
    provenance::Provenance,
};

/// Longest file that is read, in bytes.
const LENGTH_MAX: usize = 1 << 26;
/// Share of battles won in greedy tests.
const WON: &str = "test_battle_won_mean";
/// What every row of training has.
const PLAYED: &str = "return_mean";
/// Delegation by the number of commonly known enemies, which follows.
const DELEGATION: &str = "mackrl/delegation_rate_ck_enemies_";

/// What a run gave.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrainingRun {
    /// Where it comes from.
    provenance: Provenance,
    /// The whole configuration, as TOML.
    config: String,
    /// Share of battles won at each test: before training, and after each interval.
    pub battle_won: Vec<f64>,
    /// During the first batch, and then during each interval, the share of chosen pairs that delegated, by the number of
    /// enemies they commonly knew; `None` where that did not occur.
    pub delegation: Vec<Vec<Option<f64>>>,
}

/// A run as a file holds it; files of early versions do not say where they come from.
#[derive(Debug, Deserialize)]
struct Stored {
    provenance: Option<Provenance>,
    config: String,
    battle_won: Vec<f64>,
    delegation: Vec<Vec<Option<f64>>>,
}

impl TrainingRun {
    /// A finished run with this configuration that this program made.
    #[must_use]
    pub fn new(config: &Config, battle_won: Vec<f64>, delegation: Vec<Vec<Option<f64>>>) -> Self {
        Self {
            provenance: Provenance::of_run(config),
            config: config.to_toml(),
            battle_won,
            delegation,
        }
    }

    /// Where these runs come from, repetitions of one experiment taken together.
    pub fn provenance_of(runs: &[Self]) -> Vec<Provenance> {
        Provenance::merged(runs.iter().map(Self::provenance))
    }

    /// Where it comes from.
    #[must_use]
    pub const fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// Reads the file at `path`.
    ///
    /// # Errors
    /// If it cannot be read, or holds something else.
    pub fn load(path: &Path) -> Result<Self> {
        let bytes = bounded::read(path, LENGTH_MAX)?;
        let bad = |reason: String| RunError::BadData {
            message: format!("{} holds no training run: {reason}", path.display()),
        };
        let stored: Stored =
            serde_json::from_slice(&bytes).map_err(|error| bad(error.to_string()))?;
        let config = config(&stored.config).map_err(|error| bad(error.to_string()))?;
        let rates = stored.delegation.iter().flatten().flatten();
        let mut shares = stored.battle_won.iter().chain(rates);
        if let Some(share) = shares.find(|share| !(0.0..=1.0).contains(*share)) {
            return Err(bad(format!("a share is {share}, expected 0 to 1")));
        }
        Ok(Self {
            provenance: (stored.provenance).unwrap_or_else(|| Provenance::of_unknown_code(&config)),
            config: stored.config,
            battle_won: stored.battle_won,
            delegation: stored.delegation,
        })
    }

    /// Everything that determines its result.
    ///
    /// # Errors
    /// If this program does not understand it.
    pub fn config(&self) -> Result<Config, ConfigError> {
        config(&self.config)
    }

    /// One of the metrics that are kept, at the environment steps at which tests were due; seconds are not kept.
    pub(super) fn measurements(&self, metric: &str, config: &Config) -> Option<Measurements> {
        let rate_at = metric
            .strip_prefix(DELEGATION)
            .and_then(|count| count.parse().ok());
        let value = |test: usize| match (metric, rate_at) {
            (WON, _) => Some(self.battle_won[test]),
            (_, Some(enemies)) => *self.delegation.get(test)?.get::<usize>(enemies)?,
            _ => None,
        };
        let mut found = Measurements::default();
        for test in 0..self.battle_won.len() {
            if let Some(value) = value(test) {
                let due = test as u64 * config.test.interval_steps_env;
                found.steps.push(due.min(config.run.steps_env) as f64);
                found.wall_s.push(0.0);
                found.values.push(value);
            }
        }
        (!found.values.is_empty()).then_some(found)
    }

    /// Reads what the figures need from the folder of a finished run.
    ///
    /// # Errors
    /// If the folder or its metrics cannot be read.
    pub fn of_folder(folder: &Path) -> Result<Self> {
        let run = RecordedRun::open(folder.to_owned())?;
        let won = Measurements::read(&run, WON)?;
        let first_batch = Measurements::read(&run, PLAYED)?.steps.first().copied();
        let mut delegation = vec![Vec::new(); won.values.len()];
        let world = run.config.env.world()?;
        let enemies = world.spec().entities - world.spec().agents;
        for enemies in 0..=enemies {
            let metric = format!("{DELEGATION}{enemies}");
            let rates = match Measurements::read(&run, &metric) {
                Ok(rates) => rates,
                Err(error) if error.is_missing_metric() => continue,
                Err(error) => return Err(error),
            };
            for (&step, &rate) in rates.steps.iter().zip(&rates.values) {
                // Beside the row of the first batch, those of tests count; a test after the last batch may stand at the step of
                // another row.
                let test = won.steps.iter().rposition(|&test| test == step);
                let Some(test) = test.or_else(|| (first_batch == Some(step)).then_some(0)) else {
                    continue;
                };
                delegation[test].resize(enemies, None);
                delegation[test].push(Some(rate));
            }
        }
        Ok(Self {
            config: run.config.to_toml(),
            provenance: run
                .provenance
                .into_iter()
                .next_back()
                .unwrap_or_else(|| Provenance::of_unknown_code(&run.config)),
            battle_won: won.values,
            delegation,
        })
    }
}

fn config(text: &str) -> Result<Config, ConfigError> {
    ConfigBuilder::new(registry())
        .recorded("config", text)?
        .build()
}
