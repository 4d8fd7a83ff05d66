//! Which runs are repetitions of one experiment, and which may be compared.

use std::collections::{BTreeMap, BTreeSet};

use super::{RecordedRun, setting};
use crate::{
    config::{Origin, registry},
    error::{Result, RunError},
    provenance::Provenance,
    run_folder::Status,
};

/// Settings in which runs may differ and still be compared.
const FREE: [&str; 7] = [
    "algorithm.name",
    "run.seed",
    // These three change no result.
    "run.checkpoint_interval_steps_env",
    "run.checkpoints_kept",
    "run.weights_interval_steps_env",
    // Maps are never compared with each other.
    "env.map",
    "env.name",
];

/// Which runs are used, and how strictly.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// Runs on this map only.
    pub map: Option<String>,
    /// Settings that make different series, besides the algorithm.
    pub by: Vec<String>,
    /// Whether unlike runs may be compared.
    pub mix: bool,
    /// Whether runs that are not finished count.
    pub unfinished: bool,
}

/// Repetitions of one experiment.
#[derive(Debug, Clone)]
pub struct Series {
    /// The map's name.
    pub map: String,
    /// What learns, and the settings that were asked to be told apart.
    pub name: String,
    /// The repetitions.
    pub runs: Vec<RecordedRun>,
}

/// Runs by experiment.
#[derive(Debug, Clone)]
pub struct Grouping {
    /// In the order of maps, then of names, MACKRL first.
    pub series: Vec<Series>,
    /// Runs that were left out because they are not finished.
    pub left_out: usize,
}

impl Grouping {
    /// The maps, in order, each once.
    pub fn maps(&self) -> Vec<&str> {
        let maps: BTreeSet<&str> = self.series.iter().map(|series| &*series.map).collect();
        maps.into_iter().collect()
    }

    /// The names of series, in order, each once.
    pub fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for series in &self.series {
            if !names.contains(&&*series.name) {
                names.push(&series.name);
            }
        }
        names
    }

    /// Where the runs come from: one entry for each experiment.
    pub fn provenance(&self) -> Vec<Provenance> {
        let runs = self.series.iter().flat_map(|series| &series.runs);
        Provenance::merged(runs.flat_map(|run| &run.provenance))
    }
}

/// Groups runs by map, algorithm and what `selection` tells apart.
///
/// # Errors
/// [`RunError::Selection`] if nothing is left, or a setting is unknown; [`RunError::UnlikeRuns`] if runs differ in anything else.
pub fn group(runs: Vec<RecordedRun>, selection: &Selection) -> Result<Grouping> {
    for key in &selection.by {
        check_key(key)?;
    }
    let found = runs.len();
    let maps: BTreeSet<String> = runs
        .iter()
        .map(|run| run.config.env.map().to_owned())
        .collect();
    let here = |run: &RecordedRun| {
        selection
            .map
            .as_ref()
            .is_none_or(|map| run.config.env.map() == *map)
    };
    let runs: Vec<RecordedRun> = runs.into_iter().filter(here).collect();
    if let (true, Some(map)) = (runs.is_empty(), &selection.map) {
        let maps: Vec<String> = maps.into_iter().collect();
        let message = format!(
            "none of the {found} runs is on the map `{map}`, expected {}",
            maps.join(" or ")
        );
        return Err(RunError::Selection { message });
    }
    let all = runs.len();
    let counts = |run: &RecordedRun| selection.unfinished || run.status == Status::Finished;
    let runs: Vec<RecordedRun> = runs.into_iter().filter(counts).collect();
    let left_out = all - runs.len();
    if runs.is_empty() {
        return Err(RunError::NoneFinished { runs: all });
    }
    if !selection.mix {
        check_alike(&runs, selection)?;
    }
    Ok(Grouping {
        series: series(runs, selection),
        left_out,
    })
}

fn series(runs: Vec<RecordedRun>, selection: &Selection) -> Vec<Series> {
    let mut series: BTreeMap<(String, usize, String), Vec<RecordedRun>> = BTreeMap::new();
    for run in runs {
        let algorithm = run.algorithm();
        let key = (
            run.config.env.map().to_owned(),
            usize::from(!algorithm.starts_with("mackrl")),
            name(&run, selection),
        );
        series.entry(key).or_default().push(run);
    }
    let series = series.into_iter();
    series
        .map(|((map, _, name), runs)| Series { map, name, runs })
        .collect()
}

fn name(run: &RecordedRun, selection: &Selection) -> String {
    let mut parts = vec![display_name(&run.algorithm())];
    for key in &selection.by {
        let short = key.rsplit('.').next().unwrap_or(key);
        parts.push(format!("{short} {}", setting(&run.config, key)));
    }
    parts.join(" · ")
}

/// How an algorithm is called in figures.
fn display_name(algorithm: &str) -> String {
    match algorithm {
        "mackrl" => "MACKRL".to_owned(),
        "central-v" => "Central-V".to_owned(),
        other => other.to_uppercase(),
    }
}

/// Refuses a key that no setting has.
fn check_key(key: &str) -> Result<()> {
    let text = format!("--by {key}");
    let found = registry().settings_called(key, Origin::CommandLine { text })?;
    if found.iter().any(|setting| setting.key == key) {
        return Ok(());
    }
    let message = format!("--by {key}: expected one setting, such as algorithm.delegation");
    Err(RunError::Selection { message })
}

fn check_alike(runs: &[RecordedRun], selection: &Selection) -> Result<()> {
    let mut references: BTreeMap<&str, &RecordedRun> = BTreeMap::new();
    let mut seeds: BTreeMap<(&str, String, u64), &RecordedRun> = BTreeMap::new();
    for run in runs {
        let reference = *references.entry(run.config.env.map()).or_insert(run);
        if let Some((key, values)) = difference(reference, run, selection) {
            return Err(unlike(reference, run, &key, &values));
        }
        // Maps differ, but one program plays all of them.
        let first = &runs[0];
        for (what, values) in [
            ("the version of the program", [first, run].map(versions)),
            ("map data", [reference, run].map(map_data)),
        ] {
            if values[0] != values[1] {
                return Err(unlike(reference, run, what, &values));
            }
        }
        let identity = (
            run.config.env.map(),
            name(run, selection),
            run.config.run.seed,
        );
        if let Some(twin) = seeds.insert(identity, run) {
            return Err(RunError::UnlikeRuns {
                message: format!(
                    "{} and {} are the same experiment with the same seed, which would be counted twice",
                    twin.path.display(),
                    run.path.display()
                ),
                key: None,
            });
        }
    }
    Ok(())
}

/// The versions of the program that made a run.
fn versions(run: &RecordedRun) -> String {
    let versions = run.provenance.iter().map(|one| one.versions.to_string());
    let mut versions: Vec<String> = versions.collect();
    versions.dedup();
    versions.join(" then ")
}

/// Names the data of the map and its units.
fn map_data(run: &RecordedRun) -> String {
    let hashes: BTreeSet<&str> = run.provenance.iter().map(|one| &*one.map_sha256).collect();
    hashes.into_iter().collect::<Vec<_>>().join(" then ")
}

/// The first setting in which two runs differ that should not, with both values.
fn difference(
    one: &RecordedRun,
    other: &RecordedRun,
    selection: &Selection,
) -> Option<(String, [String; 2])> {
    let free = |key: &str| FREE.contains(&key) || selection.by.iter().any(|by| by == key);
    // What another algorithm has no setting for is a difference between algorithms.
    let shared = |key: &str| other.config.get(key).is_some();
    let keys = one.config.keys().filter(|key| !free(key) && shared(key));
    keys.map(|key| {
        let values = [one, other].map(|run| setting(&run.config, &key));
        (key, values)
    })
    .find(|(_, values)| values[0] != values[1])
}

fn unlike(one: &RecordedRun, other: &RecordedRun, what: &str, values: &[String; 2]) -> RunError {
    RunError::UnlikeRuns {
        message: format!(
            "{} and {} differ in {what}: {} and {}",
            one.path.display(),
            other.path.display(),
            values[0],
            values[1]
        ),
        key: what.contains('.').then(|| what.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use crate::config::Config;

    use super::*;

    fn run(settings: &[&str]) -> RecordedRun {
        let config = Config::with(&[&["algorithm.name=mackrl"], settings].concat()).unwrap();
        RecordedRun {
            misses_rows: false,
            teams: None,
            path: PathBuf::from(settings.join(" ")),
            provenance: vec![Provenance::of_run(&config)],
            config,
            kept: None,
            status: Status::Finished,
        }
    }

    fn names(
        runs: Vec<RecordedRun>,
        selection: &Selection,
    ) -> Result<Vec<(String, usize)>, String> {
        let grouping = group(runs, selection).map_err(|error| error.to_string())?;
        let series = grouping.series.into_iter();
        Ok(series
            .map(|series| (series.name, series.runs.len()))
            .collect())
    }

    #[test]
    fn repetitions_differ_in_seeds_and_series_in_algorithms() {
        let runs = vec![
            run(&["run.seed=1", "algorithm.name=central-v"]),
            run(&["run.seed=1"]),
            run(&["run.seed=2", "run.checkpoints_kept=7"]),
        ];
        let expected = [("MACKRL".to_owned(), 2), ("Central-V".to_owned(), 1)];
        assert_eq!(names(runs, &Selection::default()).unwrap(), expected);
    }

    #[test]
    fn runs_that_differ_in_anything_else_are_refused_told_apart_or_mixed() {
        let runs = || {
            vec![
                run(&["run.seed=1"]),
                run(&["run.seed=2", "algorithm.gamma=0.5"]),
            ]
        };
        let refusal = names(runs(), &Selection::default()).unwrap_err();
        assert!(
            refusal.ends_with("differ in algorithm.gamma: 0.99 and 0.5"),
            "{refusal}"
        );
        let by = Selection {
            by: vec!["algorithm.gamma".to_owned()],
            ..Selection::default()
        };
        let expected = [
            ("MACKRL · gamma 0.5".to_owned(), 1),
            ("MACKRL · gamma 0.99".to_owned(), 1),
        ];
        assert_eq!(names(runs(), &by).unwrap(), expected);
        let mix = Selection {
            mix: true,
            ..Selection::default()
        };
        assert_eq!(names(runs(), &mix).unwrap(), [("MACKRL".to_owned(), 2)]);
    }

    #[test]
    fn other_versions_and_repeated_seeds_are_refused() {
        let mut newer = run(&["run.seed=2"]);
        newer.provenance[0].versions.learning = 97;
        let refusal = names(vec![run(&[]), newer], &Selection::default()).unwrap_err();
        assert!(
            refusal.contains("differ in the version of the program")
                && refusal.ends_with("learning 97"),
            "{refusal}"
        );
        let refusal =
            names(vec![run(&[]), run(&["run.seed=1"])], &Selection::default()).unwrap_err();
        assert!(refusal.contains("the same seed"), "{refusal}");
    }

    #[test]
    fn maps_are_chosen_and_unfinished_runs_left_out() {
        let mut running = run(&["run.seed=2"]);
        running.status = Status::Running;
        let runs = vec![run(&[]), run(&["env.map=2s3z"]), running];
        let grouping = group(runs.clone(), &Selection::default()).unwrap();
        assert_eq!(
            (grouping.maps(), grouping.left_out),
            (vec!["2s3z", "3m"], 1)
        );
        let only = Selection {
            map: Some("3m".to_owned()),
            unfinished: true,
            ..Selection::default()
        };
        assert_eq!(
            names(runs.clone(), &only).unwrap(),
            [("MACKRL".to_owned(), 2)]
        );
        let nowhere = Selection {
            map: Some("8m".to_owned()),
            ..Selection::default()
        };
        let refusal = names(runs, &nowhere).unwrap_err();
        assert!(refusal.ends_with("expected 2s3z or 3m"), "{refusal}");
    }

    #[test]
    fn a_misspelt_setting_finds_its_neighbour() {
        let by = Selection {
            by: vec!["algorithm.gama".to_owned()],
            ..Selection::default()
        };
        let refusal = names(vec![run(&[])], &by).unwrap_err();
        assert!(
            refusal.contains("did you mean `algorithm.gamma`"),
            "{refusal}"
        );
    }
}
