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
/// How often that many enemies were commonly known.
const CASES: &str = "mackrl/delegation_cases_ck_enemies_";

/// Shares by the number of commonly known enemies, at each test; `None` where that did not occur.
pub type ByEnemies = Vec<Vec<Option<f64>>>;

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
    pub delegation: ByEnemies,
    /// At the same times, the share of chosen pairs with common knowledge that knew so many enemies. Nothing, in runs of early
    /// versions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cases: ByEnemies,
    /// As `delegation`, in the greedy test itself.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub test_delegation: ByEnemies,
    /// As `cases`, in the greedy test itself.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub test_cases: ByEnemies,
}

/// A run as a file holds it; files of early versions do not say where they come from.
#[derive(Debug, Deserialize)]
struct Stored {
    provenance: Option<Provenance>,
    config: String,
    battle_won: Vec<f64>,
    delegation: ByEnemies,
    #[serde(default)]
    cases: ByEnemies,
    #[serde(default)]
    test_delegation: ByEnemies,
    #[serde(default)]
    test_cases: ByEnemies,
}

impl TrainingRun {
    /// A finished run with this configuration that this program made.
    #[must_use]
    pub fn new(config: &Config, battle_won: Vec<f64>, delegation: ByEnemies) -> Self {
        Self {
            provenance: Provenance::of_run(config),
            config: config.to_toml(),
            battle_won,
            delegation,
            cases: Vec::new(),
            test_delegation: Vec::new(),
            test_cases: Vec::new(),
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
        let tables = [
            &stored.delegation,
            &stored.cases,
            &stored.test_delegation,
            &stored.test_cases,
        ];
        let rates = tables.into_iter().flatten().flatten().flatten();
        let wrong = |share: &&f64| !(0.0..=1.0).contains(*share);
        let wrong = stored.battle_won.iter().chain(rates).find(wrong).copied();
        if let Some(share) = wrong {
            return Err(bad(format!("a share is {share}, expected 0 to 1")));
        }
        Ok(Self {
            provenance: (stored.provenance).unwrap_or_else(|| Provenance::of_unknown_code(&config)),
            config: stored.config,
            battle_won: stored.battle_won,
            delegation: stored.delegation,
            cases: stored.cases,
            test_delegation: stored.test_delegation,
            test_cases: stored.test_cases,
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
        let world = run.config.env.world()?;
        let enemies = world.spec().entities - world.spec().agents;
        let by_enemies = |metric: &str| -> Result<ByEnemies> {
            let mut shares = vec![Vec::new(); won.values.len()];
            for enemies in 0..=enemies {
                let of = match Measurements::read(&run, &format!("{metric}{enemies}")) {
                    Ok(of) => of,
                    Err(error) if error.is_missing_metric() => continue,
                    Err(error) => return Err(error),
                };
                for (&step, &share) in of.steps.iter().zip(&of.values) {
                    // Beside the row of the first batch, those of tests count; a test after the last batch may stand at the step
                    // of another row.
                    let test = won.steps.iter().rposition(|&test| test == step);
                    let test = test.or_else(|| (first_batch == Some(step)).then_some(0));
                    if let Some(test) = test {
                        shares[test].resize(enemies, None);
                        shares[test].push(Some(share));
                    }
                }
            }
            Ok(shares)
        };
        let some = |shares: ByEnemies| match shares.iter().all(Vec::is_empty) {
            true => Vec::new(),
            false => shares,
        };
        let delegation = by_enemies(DELEGATION)?;
        let cases = some(by_enemies(CASES)?);
        let [test_delegation, test_cases] =
            [DELEGATION, CASES].map(|metric| by_enemies(&format!("test_{metric}")).map(some));
        Ok(Self {
            config: run.config.to_toml(),
            provenance: run
                .provenance
                .into_iter()
                .next_back()
                .unwrap_or_else(|| Provenance::of_unknown_code(&run.config)),
            battle_won: won.values,
            delegation,
            cases,
            test_delegation: test_delegation?,
            test_cases: test_cases?,
        })
    }
}

fn config(text: &str) -> Result<Config, ConfigError> {
    ConfigBuilder::new(registry())
        .recorded("config", text)?
        .build()
}
