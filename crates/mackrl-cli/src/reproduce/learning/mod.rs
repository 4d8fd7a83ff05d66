//! Training runs for the figures that show learning: many seeds, each learner with the same settings.
//!
//! The runs are made as those of a sweep: each has a process and a run folder of its own, below `training/` in the folder of the
//! figure, and goes on where it was if it was stopped. What the figures need of a finished run is kept beside it in a small file in
//! `runs/`, which is all that has to be kept: a run whose file holds the same configuration is not repeated. Runs use one
//! thread each, because many runs side by side use a machine better than one run on all of it, and because their number of
//! threads changes no result.

mod curve;
mod options;
mod run;

use mackrl_run::{recorded::TrainingRun, sweep::Entry};

use crate::{commands::resume::make_all, failure::Failure, signals};
pub(crate) use curve::{Curve, Difference};
pub(crate) use options::LearningOptions;
pub(crate) use run::{Job, Learner};

/// Makes all `jobs` that were not made before, as many side by side as `options` says, and gives their runs in the order of
/// the jobs.
///
/// # Errors
/// [`Failure::SweepInterrupted`] when asked to stop; [`Failure::BadData`] if a run failed, after all others are made.
pub(crate) fn train_all(
    jobs: &[Job],
    options: &LearningOptions,
) -> anyhow::Result<Vec<TrainingRun>> {
    let mut runs: Vec<Option<TrainingRun>> = (jobs.iter())
        .map(|job| job.load(options))
        .collect::<anyhow::Result<_>>()?;
    let missing: Vec<usize> = (0..jobs.len()).filter(|&job| runs[job].is_none()).collect();
    let entries: Vec<Entry> = (missing.iter())
        .map(|&job| jobs[job].entry(options))
        .collect::<anyhow::Result<_>>()?;
    let outcome = make_all(&entries, options.jobs(), &signals::listen()?)?;
    if let Some((name, reason)) = outcome.failed.first() {
        let message = format!(
            "{} of {} runs failed, the first of them {name}: {reason}",
            outcome.failed.len(),
            entries.len()
        );
        return Err(Failure::BadData { message }.into());
    }
    for (job, entry) in missing.into_iter().zip(&entries) {
        runs[job] = Some(jobs[job].keep(entry, options)?);
    }
    Ok(runs.into_iter().flatten().collect())
}
