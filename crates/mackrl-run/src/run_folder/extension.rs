//! A run that goes further than it was planned, and one that begins with the weights of another.
//!
//! How long a run is planned decides nothing before its end: schedules have lengths of their own. So a run of P steps that is
//! extended to N is the run of N steps, if it goes on from before its end; there a test is played that the longer run does not have.
//! `run.json` keeps the former plan with its command, and `config.toml` the new length.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{
    CONFIG, RUN, WEIGHTS, checkpoints,
    claim::Claim,
    disk::{self, RealDisk},
    kept::WhichWeights,
    manifest::Fingerprint,
    record::{RunRecord, Status, command_line},
    stored::StoredRun,
};
use crate::{
    config::{ConfigError, Origin},
    error::{Context, Result, RunError},
    folder::Folder,
    training::assembly::tensors_bytes_max,
};

/// A length that was planned once, before the run was extended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct FormerPlan {
    /// Environment steps after which training should have ended.
    pub(super) steps_env: u64,
    /// The configuration that said so.
    pub(super) config: Fingerprint,
    /// The command that planned more, word by word.
    pub(super) extended_by: Vec<String>,
}

/// What becomes of a run that is extended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extension {
    /// Environment steps that were planned before.
    pub planned: u64,
    /// Environment steps from which it goes on: those of the latest checkpoint from before its end, or 0.
    pub from: u64,
}

/// Weights of another run that a run begins with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InitialWeights {
    /// A safetensors file.
    pub bytes: Vec<u8>,
    /// Where they come from.
    pub source: InitialSource,
}

/// Where the weights come from that a run began with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InitialSource {
    /// The run's folder, as it was typed.
    pub run: String,
    /// Which of its weights.
    pub checkpoint: WhichWeights,
    /// Environment steps of training that they had seen, if their file says so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps_env: Option<u64>,
}

/// Plans the run at `path` for `steps_env` environment steps, which are more than before; it is unfinished then, and resuming makes
/// the rest. Gives nothing if so many are planned already.
///
/// # Errors
/// [`RunError::NotFurther`] if more are planned, [`RunError::NoWayFurther`] if no checkpoint from before the end is left, unless the
/// run was too short to have had one; otherwise as [`RunFolder::resume`](super::RunFolder::resume).
pub fn extend(path: &Path, steps_env: u64) -> Result<Option<Extension>> {
    let folder = StoredRun::open(path)?.folder;
    let claim = Claim::acquire(&folder, None)?;
    // Another process may have gone on meanwhile.
    let run = StoredRun::within(folder)?;
    let planned = run.config.config.run.steps_env;
    if steps_env == planned {
        return Ok(None);
    }
    let folder = run.folder.path().to_owned();
    if steps_env < planned {
        return Err(RunError::NotFurther { folder, planned });
    }
    let mut config = run.config.config.clone();
    config.run.steps_env = steps_env;
    config.validate().map_err(|error| match error {
        ConfigError::WrongValue {
            key,
            found,
            expected,
            ..
        } => ConfigError::WrongValue {
            origin: Origin::CommandLine {
                text: format!("--steps {steps_env}"),
            },
            key,
            found,
            expected,
        },
        error => error,
    })?;
    let former = FormerPlan {
        steps_env: planned,
        config: run.config.fingerprint(),
        extended_by: command_line(),
    };
    let from = goes_on_from(&run, &former)?;
    if from == 0 && planned > config.run.checkpoint_interval_steps_env {
        return Err(RunError::NoWayFurther { folder });
    }
    record(&run, former)?;
    let text = config.to_toml();
    disk::replace(&RealDisk, &run.folder, Path::new(CONFIG), text.as_bytes())?;
    drop(claim);
    Ok(Some(Extension { planned, from }))
}

/// The environment steps of the latest checkpoint that the longer run has as well, or 0.
fn goes_on_from(run: &StoredRun, former: &FormerPlan) -> Result<u64> {
    let mut config = run.config.clone();
    config.former.push(former.clone());
    let wanted = (
        checkpoints::Wanted::Everything,
        tensors_bytes_max(&config.config)?,
    );
    let (latest, _) = checkpoints::latest(&run.folder, &config, wanted)?;
    Ok(match latest {
        Some(stored) => stored.checkpoint.steps_env()?,
        None => 0,
    })
}

/// Writes into `run.json` that the run is unfinished, and what was planned until now.
fn record(run: &StoredRun, former: FormerPlan) -> Result<()> {
    let Some(mut record) = run.record.clone() else {
        let message = format!(
            "{} has no {RUN}, which says what it is",
            run.folder.path().display()
        );
        return Err(RunError::BadData { message });
    };
    record.status = Status::Interrupted;
    record.failure = None;
    record.teams = None;
    record.files.clear();
    record
        .former_plans
        .retain(|plan| plan.config != former.config);
    record.former_plans.push(former);
    let json = serde_json::to_string_pretty(&record).map_err(std::io::Error::from);
    let json = json.with_context(|| run.folder.cannot("write", Path::new(RUN)))? + "\n";
    disk::replace(&RealDisk, &run.folder, Path::new(RUN), json.as_bytes())
}

/// Removes the weights of an end that is none any more, of a run that was extended and goes on.
pub(super) fn forget_former_end(folder: &Folder, record: Option<&RunRecord>) -> Result<()> {
    let is_extended = record.is_some_and(|record| !record.former_plans.is_empty());
    if is_extended && folder.kind(WEIGHTS)?.is_some() {
        (folder.dir().remove_file(WEIGHTS))
            .with_context(|| folder.cannot("remove", Path::new(WEIGHTS)))?;
    }
    Ok(())
}
