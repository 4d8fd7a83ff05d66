//! The runs of a protocol, and what is measured of one.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt, fs,
    path::Path,
};

use anyhow::Context as _;
use mackrl::statistics::{Aggregate, Bootstrap, Crossings, Interval, first_crossing, mean};
use mackrl_run::{
    config::Config,
    recorded::{KEPT, TrainingRun, final_mean, share_of},
    run_folder::{self, Status},
    sweep::Entry,
};
use serde::Serialize;

use crate::reproduce::write;

/// Configurations that are compared, in the order in which ties are decided.
const CONFIGURATIONS: [&str; 3] = ["one-sweep", "paper-figures", "gae"];
/// Learners that are compared.
pub(super) const LEARNERS: [&str; 2] = ["mackrl", "central-v"];
/// MACKRL among the ablations: the learner, and how its plan calls it.
pub(super) const LEARNED: [&str; 2] = [LEARNERS[0], "learned"];
/// The map on which the configuration is chosen.
pub(super) const CHOICE: &str = "2s3z";
/// Steps on both sides of a moment whose tests are averaged: one test of 24 battles says little.
const AROUND: u64 = 50_000;
/// Share of the tests at the beginning of training that "initially" means.
const INITIAL: f64 = 0.1;
/// Shares of battles won whose first crossing is reported.
const LEVELS: [f64; 3] = [0.5, 0.7, 0.9];

/// Of an interval; tests, which only ask on which side one lies, have less time.
const RESAMPLES: usize = if cfg!(test) { 500 } else { 50_000 };

/// All cells.
#[derive(Debug)]
pub(super) struct Study {
    pub(super) cells: Vec<Cell>,
}

/// The runs of one learner under one configuration on one map.
#[derive(Debug)]
pub(super) struct Cell {
    pub(super) map: String,
    pub(super) learner: String,
    pub(super) configuration: String,
    /// What is changed in it; empty for nothing.
    pub(super) variant: String,
    /// Runs that the plan has.
    pub(super) planned: usize,
    /// Environment steps of a run, and between two tests.
    pub(super) steps: u64,
    pub(super) interval: u64,
    /// Finished runs by their seeds.
    pub(super) runs: BTreeMap<u64, TrainingRun>,
}

/// What is measured of a run: a share of battles won in greedy tests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Quantity {
    /// Mean of all tests after the first, which an untrained team plays.
    All,
    /// Mean of the tests of the first tenth of training.
    First,
    /// Mean of the tests within 50 000 steps of this one.
    At(u64),
    /// Mean of the last tenth of the tests.
    End,
}

/// When runs first won so many battles of a test.
#[derive(Debug, Clone, Serialize)]
#[serde(transparent)]
pub(super) struct Levels(pub(super) Vec<Crossings>);

impl Study {
    /// Reads the runs of all plans in `folder`.
    pub(super) fn read(folder: &Path, runs: Option<&Path>) -> anyhow::Result<Self> {
        let mut cells: Vec<Cell> = Vec::new();
        for entry in super::plans(folder, runs)?
            .into_iter()
            .flat_map(|plan| plan.entries)
        {
            let run = finished(&entry, folder)?;
            let cell = Cell::for_run(&entry);
            let known = cells.iter().position(|known| known.name() == cell.name());
            let place = known.unwrap_or_else(|| {
                cells.push(cell);
                cells.len() - 1
            });
            cells[place].planned += 1;
            if let Some(run) = run {
                cells[place].runs.insert(entry.config.run.seed, run);
            }
        }
        Ok(Self { cells })
    }

    /// All finished runs.
    pub(super) fn runs(&self) -> impl Iterator<Item = &TrainingRun> {
        self.cells.iter().flat_map(|cell| cell.runs.values())
    }

    /// Those that the plans have, in the protocol's order.
    pub(super) fn configurations(&self) -> Vec<String> {
        let names = self.cells.iter().map(|cell| cell.configuration.clone());
        let names: BTreeSet<String> = names.collect();
        let mut names: Vec<String> = names.into_iter().collect();
        names.sort_by_key(|name| CONFIGURATIONS.iter().position(|own| own == name));
        names
    }

    /// Whether the plans change something in a configuration.
    pub(super) fn is_of_ablations(&self) -> bool {
        self.cells.iter().any(|cell| !cell.variant.is_empty())
    }

    /// The cell of a learner under a configuration, with what is changed in it.
    pub(super) fn cell(
        &self,
        map: &str,
        [learner, configuration, variant]: [&str; 3],
    ) -> Option<&Cell> {
        let mut cells = self.cells.iter();
        cells.find(|cell| {
            cell.map == map
                && cell.learner == learner
                && cell.configuration == configuration
                && cell.variant == variant
        })
    }

    /// The configuration under which both learners together win most over the whole of training on 2s3z: the greatest sum of their
    /// interquartile means. Nothing, as long as a run is missing.
    pub(super) fn chosen(&self) -> Option<String> {
        let configurations = self.configurations();
        if let [only] = &*configurations {
            return Some(only.clone());
        }
        let mut best: Option<(f64, String)> = None;
        for configuration in configurations {
            let mut together = 0.0;
            for learner in LEARNERS {
                let cell = self.cell(CHOICE, [learner, &configuration, ""])?;
                together += interquartile(&cell.sample(Quantity::All)?).estimate;
            }
            if best.as_ref().is_none_or(|(most, _)| together > *most) {
                best = Some((together, configuration));
            }
        }
        best.map(|(_, configuration)| configuration)
    }
}

impl Study {
    /// The cell of the configuration that is best for a learner by itself: that of the greatest interquartile mean over the whole of
    /// training on 2s3z. Nothing, as long as a run is missing.
    pub(super) fn best(&self, learner: &str) -> Option<&Cell> {
        let mut best: Option<(f64, &Cell)> = None;
        for configuration in self.configurations() {
            let cell = self.cell(CHOICE, [learner, &configuration, ""])?;
            let average = interquartile(&cell.sample(Quantity::All)?).estimate;
            if best.is_none_or(|(most, _)| average > most) {
                best = Some((average, cell));
            }
        }
        best.map(|(_, cell)| cell)
    }
}

/// The run of `entry` if it is finished: what is kept of it in `folder`, or its run folder, of which that is kept then.
fn finished(entry: &Entry, folder: &Path) -> anyhow::Result<Option<TrainingRun>> {
    let folder = folder.join(KEPT);
    let file = format!("{}.json", entry.name);
    let same = |run: &TrainingRun| run.config().is_ok_and(|config| config == entry.config);
    if let Some(run) = TrainingRun::load(&folder.join(&file)).ok().filter(same) {
        return Ok(Some(run));
    }
    let made = run_folder::read_description(&entry.folder).ok();
    let Some((config, description)) = made else {
        return Ok(None);
    };
    if config != entry.config || description.status != Status::Finished {
        return Ok(None);
    }
    let run = TrainingRun::of_folder(&entry.folder)?;
    fs::create_dir_all(&folder).with_context(|| format!("creating {}", folder.display()))?;
    let json = serde_json::to_string(&run)? + "\n";
    write(&folder, &file, json.as_bytes())?;
    Ok(Some(run))
}

impl Cell {
    /// An empty cell for runs as that of `entry`.
    fn for_run(entry: &Entry) -> Self {
        let Config {
            env,
            algorithm,
            run,
            ..
        } = &entry.config;
        let (map, learner) = (env.map().to_owned(), algorithm.name().to_owned());
        let seed = format!("-seed{}", run.seed);
        let kind = entry.name.strip_suffix(&seed).unwrap_or(&entry.name);
        let kind = kind
            .strip_prefix(&format!("{map}-{learner}"))
            .unwrap_or(kind);
        let kind = kind.trim_start_matches('-');
        let mut known = CONFIGURATIONS.iter().filter_map(|configuration| {
            let rest = kind.strip_prefix(configuration)?;
            let variant = match rest {
                "" => rest,
                _ => rest.strip_prefix('-')?,
            };
            Some(((*configuration).to_owned(), variant.to_owned()))
        });
        let (configuration, variant) = known.next().unwrap_or((kind.to_owned(), String::new()));
        Self {
            map,
            learner,
            configuration,
            variant,
            planned: 0,
            steps: run.steps_env,
            interval: entry.config.test.interval_steps_env,
            runs: BTreeMap::new(),
        }
    }

    /// As its runs are called, without the seed.
    pub(super) fn name(&self) -> String {
        let Self {
            map,
            learner,
            configuration,
            variant,
            ..
        } = self;
        let parts = [map, learner, configuration, variant];
        let parts: Vec<&str> = parts.into_iter().map(String::as_str).collect();
        parts.join("-").trim_end_matches('-').to_owned()
    }

    /// Whether all runs are there.
    pub(super) fn is_whole(&self) -> bool {
        self.planned > 0 && self.runs.len() == self.planned
    }

    /// A quantity of each finished run, by its seed.
    pub(super) fn of_runs(&self, quantity: Quantity) -> Vec<(u64, f64)> {
        let runs = self.runs.iter();
        runs.map(|(&seed, run)| (seed, quantity.of(&run.battle_won, self.interval)))
            .collect()
    }

    /// A quantity of all runs, if all are there.
    pub(super) fn sample(&self, quantity: Quantity) -> Option<Vec<f64>> {
        let values = self.of_runs(quantity).into_iter().map(|(_, value)| value);
        self.is_whole().then(|| values.collect())
    }

    /// Environment steps of the tests.
    pub(super) fn places(&self) -> Vec<u64> {
        let tests = self.runs.values().map(|run| run.battle_won.len()).max();
        let due = |test: u64| (test * self.interval).min(self.steps);
        (0..tests.unwrap_or(0) as u64).map(due).collect()
    }

    /// Each run's curve over environment steps.
    fn curves(&self) -> Vec<Vec<[f64; 2]>> {
        let places = self.places();
        let curve = |run: &TrainingRun| {
            let points = places.iter().zip(&run.battle_won);
            points.map(|(&x, &y)| [x as f64, y]).collect()
        };
        self.runs.values().map(curve).collect()
    }

    pub(super) fn levels(&self) -> Levels {
        let curves = self.curves();
        Levels(LEVELS.map(|level| Crossings::of(&curves, level)).into())
    }

    /// When each run first won this share of a test; never counts as one interval after the end.
    pub(super) fn steps_to(&self, level: f64) -> Option<Vec<f64>> {
        let never = (self.steps + self.interval) as f64;
        let curves = self.curves();
        let reached = curves
            .iter()
            .map(|curve| first_crossing(curve, level).unwrap_or(never));
        self.is_whole().then(|| reached.collect())
    }
}

impl Quantity {
    /// Those of the report's table.
    pub(super) const REPORTED: [Self; 5] = [
        Self::First,
        Self::At(500_000),
        Self::At(1_000_000),
        Self::End,
        Self::All,
    ];

    /// Of a run with these shares of battles won at its tests, `interval` steps apart.
    pub(super) fn of(self, won: &[f64], interval: u64) -> f64 {
        match self {
            Self::All => mean(&won[1.min(won.len())..]),
            Self::First => {
                let tests = &won[1.min(won.len())..];
                mean(&tests[..share_of(tests.len(), INITIAL)])
            }
            Self::At(step) => {
                let near = |test: &usize| (*test as u64 * interval).abs_diff(step) <= AROUND;
                let tests = (0..won.len()).filter(near).map(|test| won[test]);
                mean(&tests.collect::<Vec<f64>>())
            }
            Self::End => final_mean(won),
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::All => out.write_str("all tests"),
            Self::First => out.write_str("first tenth"),
            Self::At(step) => write!(out, "at {} k", step / 1000),
            Self::End => out.write_str("last tenth"),
        }
    }
}

/// The interquartile mean with its 95 % bootstrap interval.
pub(super) fn interquartile(sample: &[f64]) -> Interval {
    let sample = sample.to_vec();
    let bootstrap = Bootstrap {
        resamples: RESAMPLES,
        ..Bootstrap::default()
    };
    bootstrap.interval(&[sample], |tasks| Aggregate::InterquartileMean.of(tasks))
}
