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

use std::collections::BTreeSet;

use mackrl_run::{provenance::Versions, recorded::TrainingRun, sweep::Entry};

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
    if !options.any_code {
        check_versions(&runs)?;
    }
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

/// Refuses runs of which some were computed by other versions than the rest, or than this program if runs are still to be made.
///
/// # Errors
/// [`Failure::OtherVersions`], with both.
fn check_versions(runs: &[Option<TrainingRun>]) -> Result<(), Failure> {
    let versions = |run: &Option<TrainingRun>| {
        run.as_ref()
            .map_or(Versions::OWN, |run| run.provenance().versions)
    };
    let versions: BTreeSet<Versions> = runs.iter().map(versions).collect();
    let mut versions = versions.into_iter();
    match (versions.next(), versions.next()) {
        (Some(one), Some(other)) => Err(Failure::OtherVersions { one, other }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use mackrl_run::config::Config;

    use super::*;

    #[test]
    fn runs_of_other_versions_are_drawn_alone_and_not_mixed() {
        let own = TrainingRun::new(&Config::default(), vec![0.5], Vec::new());
        let mut old = serde_json::to_value(&own).unwrap();
        old["provenance"]["versions"]["learning"] = 1.into();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("old.json");
        std::fs::write(&file, old.to_string()).unwrap();
        let old = TrainingRun::load(&file).unwrap();
        assert!(check_versions(&[Some(old.clone()), Some(old.clone())]).is_ok());
        assert!(check_versions(&[Some(own.clone()), None]).is_ok());
        for other in [Some(own), None] {
            let error = check_versions(&[Some(old.clone()), other]).unwrap_err();
            assert!(error.to_string().contains("learning 1 and "), "{error}");
        }
    }
}
