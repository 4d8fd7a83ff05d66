//! The commands that look at many runs together.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use mackrl_run::recorded::{self, Selection};

use crate::args::{MOST, number};

/// Draw learning curves of many runs
///
/// Takes run folders and folders that hold them, such as the output of `mackrl sweep`. Runs that differ in nothing but the seed
/// are repetitions of one experiment and become one curve, one colour an algorithm, with the number of runs in brackets. Runs that
/// differ in anything else than seed and algorithm, in the version of the program or in map data are refused: tell them apart with
/// --by, or use them together with --mix.
///
/// Each run's curve goes straight from test to test; the average is taken where tests are due, up to where the shortest run ends.
///
/// Examples: mackrl plot runs/sweep -o curves.svg; mackrl plot runs/ablations -o iqm.png --statistic iqm --by algorithm.delegation
#[derive(Debug, Args)]
pub(crate) struct PlotArgs {
    #[command(flatten)]
    pub(crate) runs: RunsArgs,

    /// File to write, ending in .svg or .png; replaced if it is there
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,

    /// What is drawn: a name from metrics.jsonl [default: what the world calls success, in greedy
    /// tests: battles won on maps; the return where it calls nothing so]
    #[arg(long, value_name = "NAME")]
    pub(crate) metric: Option<String>,

    /// What it is drawn over
    #[arg(long, value_name = "AXIS", default_value = "steps")]
    pub(crate) x: CurveAxis,

    /// Average of the runs, and what the band around it is
    #[arg(long, value_name = "NAME", default_value = "mean")]
    pub(crate) statistic: CurveStatistic,

    /// Words above the picture [default: metric and map]
    #[arg(long, value_name = "TEXT")]
    pub(crate) title: Option<String>,

    /// Print the points as JSON instead of a sentence
    #[arg(long)]
    pub(crate) json: bool,
}

/// What a curve is drawn over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum CurveAxis {
    /// Environment steps, summed over the parallel environments.
    Steps,
    /// Seconds of training and testing, pauses left out: what sys/sps says, added up.
    WallClock,
}

impl CurveAxis {
    /// As runs are read over it.
    pub(crate) const fn recorded(self) -> recorded::Axis {
        match self {
            Self::Steps => recorded::Axis::Steps,
            Self::WallClock => recorded::Axis::WallClock,
        }
    }
}

/// An average and its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum CurveStatistic {
    /// The mean, with a band of one standard error on both sides, as in the paper.
    Mean,
    /// The interquartile mean, with its 95 % bootstrap interval.
    Iqm,
}

/// Say what many runs show together: averages with their uncertainty, comparisons, steps to a level
///
/// The score of a run is the mean of the last tenth of its tests, or its curve at --at N. For each algorithm on each map: the mean
/// with its 95 % interval by Student's t, and mean, median and interquartile mean, each with a 95 % stratified-bootstrap interval
/// (percentiles, 50 000 resamples), and after how many environment steps the runs first reach 50, 70 and 90 %: the median over all runs, where
/// a run that never does counts as the latest, with the number of runs that do. For each two algorithms: the probability that
/// a run of the one scores higher than a run of the other, with its interval, if there are 5 runs of each. With several maps the same over all of them, each
/// resample with every map.
///
/// Runs are selected and refused as by `mackrl plot`.
///
/// Examples: mackrl report runs/sweep; mackrl report runs/sweep --at 1000000 --json; mackrl report runs/sweep --export-marl-eval marl.json
#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    #[command(flatten)]
    pub(crate) runs: RunsArgs,

    /// What is judged: a name from metrics.jsonl [default: what the world calls success, in greedy
    /// tests: battles won on maps; the return where it calls nothing so]
    #[arg(long, value_name = "NAME")]
    pub(crate) metric: Option<String>,

    /// Score runs by their curve at this number of environment steps
    #[arg(long, value_name = "N", value_parser = number(0, MOST))]
    pub(crate) at: Option<u64>,

    /// Resamples of each interval
    #[arg(
        long,
        value_name = "N",
        default_value_t = 50_000,
        value_parser = number(100, 10_000_000)
    )]
    pub(crate) resamples: u64,

    /// Also write every test of every run in the JSON format of marl-eval, cut to equal lengths and numbers of runs
    #[arg(long, value_name = "FILE")]
    pub(crate) export_marl_eval: Option<PathBuf>,

    /// Print a JSON object instead of tables
    #[arg(long)]
    pub(crate) json: bool,
}

/// Which runs are looked at.
#[derive(Debug, Args)]
pub(crate) struct RunsArgs {
    /// Run folders, and folders that hold run folders
    #[arg(value_name = "DIR", required = true)]
    pub(crate) paths: Vec<PathBuf>,

    /// Runs on this map only
    #[arg(long, value_name = "MAP", help_heading = "Selection")]
    map: Option<String>,

    /// Tell runs apart by this setting too, such as algorithm.delegation; repeatable
    #[arg(long, value_name = "KEY", help_heading = "Selection")]
    by: Vec<String>,

    /// Take runs together that differ in settings, version or map data
    #[arg(long, help_heading = "Selection")]
    mix: bool,

    /// Use runs that are not finished too, as far as they have come
    #[arg(long, help_heading = "Selection")]
    unfinished: bool,
}

impl RunsArgs {
    /// What was asked for.
    pub(crate) fn selection(&self) -> Selection {
        Selection {
            map: self.map.clone(),
            by: self.by.clone(),
            mix: self.mix,
            unfinished: self.unfinished,
        }
    }
}
