//! The figures that show learning, as data.
//!
//! A [`Figure`] says what to train, what to draw, what was published and what is claimed. One engine makes the runs of any of them, and
//! one [`Report`] has its numbers, its charts, its table and its verdicts, so that a figure is a value and not a module of code.
//!
//! The runs are made as those of a sweep: each has a process and a run folder of its own, below `training/` in the folder of the
//! figure, and goes on where it was if it was stopped. What the figures need of a finished run is kept beside it in a small file in
//! `runs/`, which is all that has to be kept: a run whose file holds the same configuration is not repeated. Runs use one
//! thread each, because many runs side by side use a machine better than one run on all of it, and because their number of
//! threads changes no result.

mod chart;
mod curve;
mod options;
mod report;
mod statement;
mod table;
mod train;

use mackrl_run::config::{Config, ConfigBuilder};
#[cfg(test)]
use mackrl_run::recorded::TrainingRun;
use serde::Serialize;

use super::{make_folder, save};
pub(crate) use chart::{line, published_rates, win_rates};
pub(crate) use curve::{Curve, Difference};
pub(crate) use options::LearningOptions;
#[cfg(test)]
pub(crate) use report::Variant;
pub(crate) use report::{Body, Panel, Published, PublishedMoment, Report};
pub(crate) use statement::{Rule, Score, Statement};
use train::{Job, train_all};

/// A figure of learning. In its texts, `{map}` and `{seeds}` stand for the map and the number of seeds.
#[derive(Debug)]
pub(crate) struct Figure {
    /// Its command, with which the names of its files begin.
    pub(crate) name: &'static str,
    /// Above its section of the page of all figures: what it is, a colon, what it shows.
    pub(crate) section: &'static str,
    /// Maps to learn on, unless another is asked for.
    pub(crate) maps: &'static [&'static str],
    /// Who learns on each of them, for a preset.
    pub(crate) arms: fn(&Config) -> Vec<Arm>,
    /// What the curves are.
    pub(crate) curves: Curves,
    /// First line of its table.
    pub(crate) heading: &'static str,
    /// Above its charts.
    pub(crate) title: &'static str,
    /// Below the title.
    pub(crate) subtitle: &'static str,
    /// Below and beside its charts.
    pub(crate) axes: [&'static str; 2],
    /// What is claimed.
    pub(crate) claims: &'static [Statement],
}

/// What a figure shows of its runs.
#[derive(Debug)]
pub(crate) enum Curves {
    /// Win rates of MACKRL and Central-V, the first two arms, in a chart for each map, beside what was published for it.
    Maps(&'static [Published]),
    /// How often pairs delegate, by the enemies they commonly know, at the moments at which that was published.
    Moments(&'static [PublishedMoment]),
    /// Win rates of each arm against those of the first, in a panel for each.
    Variants,
}

/// Some settings laid over a preset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) struct Arm {
    /// In names of files.
    pub(crate) name: &'static str,
    /// In the legend.
    pub(crate) label: &'static str,
    /// What is laid over the preset.
    pub(crate) settings: &'static [&'static str],
    /// What the comparison with MACKRL tells.
    pub(crate) question: &'static str,
}

/// An arm on a map, of which there is a run for each seed.
#[derive(Debug, Clone)]
pub(crate) struct Cell {
    map: String,
    arm: Arm,
}

impl Figure {
    /// Makes all runs that are not there and writes the figure into the folder that `options` names; on `map`, if one is asked for.
    ///
    /// # Errors
    /// If a run fails or a file cannot be written.
    pub(crate) fn run(
        &'static self,
        options: &LearningOptions,
        map: Option<&str>,
    ) -> anyhow::Result<Report> {
        let options = options.resolved();
        make_folder(&options.out)?;
        let cells = self.cells(&options, map)?;
        let jobs: Vec<Job<'_>> = (cells.iter())
            .flat_map(|cell| (1..=options.seeds).map(move |seed| Job { cell, seed }))
            .collect();
        let runs = train_all(&jobs, &options)?;
        let report = Report::new(self, &options, map, &cells, &runs);
        save(&options.out, self.name, &report, &report.charts())?;
        Ok(report)
    }

    /// Maps, then arms: the order of the runs.
    pub(crate) fn cells(
        &self,
        options: &LearningOptions,
        map: Option<&str>,
    ) -> anyhow::Result<Vec<Cell>> {
        let preset = ConfigBuilder::new(crate::registry())
            .preset(&options.preset)?
            .build()?;
        let arms = (self.arms)(&preset);
        let maps = map.map_or_else(|| self.maps.to_vec(), |map| vec![map]);
        let on = |map: &str, arm: Arm| Cell {
            map: map.to_owned(),
            arm,
        };
        Ok((maps.iter())
            .flat_map(|map| arms.iter().map(move |&arm| on(map, arm)))
            .collect())
    }

    /// The report of runs of which each cell has as many.
    #[cfg(test)]
    pub(crate) fn report(&'static self, map: Option<&str>, runs: &[TrainingRun]) -> Report {
        let cells = self.cells(&LearningOptions::default(), map).unwrap();
        let options = LearningOptions {
            seeds: (runs.len() / cells.len()) as u64,
            steps: 1_000_000,
            ..LearningOptions::default()
        };
        Report::new(self, &options, map, &cells, runs)
    }
}
