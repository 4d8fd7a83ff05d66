//! The training runs of a figure, made as those of a sweep.

use std::{collections::BTreeSet, fs};

use anyhow::Context as _;
use mackrl_run::{
    config::{Config, ConfigBuilder},
    provenance::Versions,
    recorded::{KEPT, TRAINING, TrainingRun},
    sweep::Entry,
};

use super::{Cell, LearningOptions};
use crate::{
    commands::{resume::make_all, sweep::expect_all},
    failure::Failure,
    reproduce::write,
    signals,
};

/// A run to be made.
pub(super) struct Job<'a> {
    pub(super) cell: &'a Cell,
    pub(super) seed: u64,
}

/// Makes all `jobs` that were not made before, as many side by side as `options` says, and gives their runs in the order of
/// the jobs.
///
/// # Errors
/// [`Failure::SweepInterrupted`] when asked to stop; [`Failure::BadData`] if a run failed, after all others are made.
pub(super) fn train_all(
    jobs: &[Job<'_>],
    options: &LearningOptions,
) -> anyhow::Result<Vec<TrainingRun>> {
    let mut runs: Vec<Option<TrainingRun>> = (jobs.iter())
        .map(|job| job.load(options))
        .collect::<anyhow::Result<_>>()?;
    let missing: Vec<usize> = (0..jobs.len()).filter(|&job| runs[job].is_none()).collect();
    if !options.mix {
        check_versions(&runs)?;
    }
    let entries: Vec<Entry> = (missing.iter())
        .map(|&job| jobs[job].entry(options))
        .collect::<anyhow::Result<_>>()?;
    let outcome = make_all(&entries, options.jobs(), None, &signals::listen()?)?;
    expect_all(&outcome, entries.len())?;
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

impl Job<'_> {
    /// The run, if it was made before with this configuration; settings that did not exist then count as their built-in values.
    fn load(&self, options: &LearningOptions) -> anyhow::Result<Option<TrainingRun>> {
        let config = self.config(options)?;
        let path = options.out.join(KEPT).join(self.name() + ".json");
        let made = |run: &TrainingRun| run.config().is_ok_and(|made| made == config);
        Ok(TrainingRun::load(&path).ok().filter(made))
    }

    /// The run as a run of a sweep.
    fn entry(&self, options: &LearningOptions) -> anyhow::Result<Entry> {
        let name = self.name();
        Ok(Entry {
            folder: options.out.join(TRAINING).join(&name),
            config: self.config(options)?,
            name,
        })
    }

    /// Takes what the figures need from the run folder of `entry`, and keeps it.
    fn keep(&self, entry: &Entry, options: &LearningOptions) -> anyhow::Result<TrainingRun> {
        let run = TrainingRun::of_folder(&entry.folder)?;
        let folder = options.out.join(KEPT);
        fs::create_dir_all(&folder).with_context(|| format!("creating {}", folder.display()))?;
        let json = serde_json::to_string(&run)? + "\n";
        write(&folder, &(self.name() + ".json"), json.as_bytes())?;
        Ok(run)
    }

    fn name(&self) -> String {
        let Cell { map, arm } = self.cell;
        format!("{map}-{}-seed{}", arm.name, self.seed)
    }

    fn config(&self, options: &LearningOptions) -> anyhow::Result<Config> {
        let LearningOptions {
            steps, interval, ..
        } = options;
        let Cell { map, arm } = self.cell;
        let common = [
            format!("run.seed={}", self.seed),
            format!("run.steps_env={steps}"),
            format!("run.metrics_interval_steps_env={interval}"),
            format!("test.interval_steps_env={interval}"),
        ];
        let preset = ConfigBuilder::new(crate::registry())
            .preset(&options.preset)?
            .map(&format!("--map {map}"), map);
        let settings = common.iter().map(String::as_str);
        let builder = (settings.chain(arm.settings.iter().copied()))
            .try_fold(preset, |builder, setting| builder.set(setting))?;
        Ok(builder.build()?)
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
        fs::write(&file, old.to_string()).unwrap();
        let old = TrainingRun::load(&file).unwrap();
        assert!(check_versions(&[Some(old.clone()), Some(old.clone())]).is_ok());
        assert!(check_versions(&[Some(own.clone()), None]).is_ok());
        for other in [Some(own), None] {
            let error = check_versions(&[Some(old.clone()), other]).unwrap_err();
            assert!(error.to_string().contains("learning 1 and "), "{error}");
        }
    }
}
