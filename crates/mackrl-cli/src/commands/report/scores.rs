//! One number for each run, and its curve.

use mackrl_run::recorded::{Axis, Grouping, Measurements, Series, final_mean};

use mackrl::statistics::interpolate;

use crate::failure::Failure;

/// The runs of an algorithm on a map.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cell {
    pub(super) map: String,
    pub(super) algorithm: String,
    /// One score for each run.
    pub(super) scores: Vec<f64>,
    /// One curve over environment steps for each run.
    pub(super) curves: Vec<Vec<[f64; 2]>>,
}

/// All runs by map and algorithm.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scores {
    /// In the order of maps, then of algorithms.
    pub(super) cells: Vec<Cell>,
    /// In order, each once.
    pub(super) maps: Vec<String>,
    /// In order, each once.
    pub(super) algorithms: Vec<String>,
}

impl Scores {
    /// Reads the runs of all series and scores them.
    ///
    /// # Errors
    /// If a run cannot be read, or is not as long as it is asked about.
    pub(super) fn read(grouping: &Grouping, metric: &str, at: Option<u64>) -> anyhow::Result<Self> {
        let cells = (grouping.series.iter())
            .map(|series| cell(series, metric, at))
            .collect::<anyhow::Result<_>>()?;
        let owned = |names: Vec<&str>| names.into_iter().map(str::to_owned).collect();
        Ok(Self {
            cells,
            maps: owned(grouping.maps()),
            algorithms: owned(grouping.names()),
        })
    }

    /// The scores of `algorithm` on each of `maps`, if it has runs on all of them.
    pub(super) fn on(&self, algorithm: &str, maps: &[&str]) -> Option<Vec<Vec<f64>>> {
        let of_map = |map: &&str| {
            let mut cells = self.cells.iter();
            let cell = cells.find(|cell| cell.map == **map && cell.algorithm == algorithm)?;
            Some(cell.scores.clone())
        };
        maps.iter().map(of_map).collect()
    }
}

fn cell(series: &Series, metric: &str, at: Option<u64>) -> anyhow::Result<Cell> {
    let mut cell = Cell {
        map: series.map.clone(),
        algorithm: series.name.clone(),
        scores: Vec::new(),
        curves: Vec::new(),
    };
    for run in &series.runs {
        let measurements = Measurements::read(run, metric)?;
        let curve = measurements.over(Axis::Steps);
        cell.scores.push(match at {
            None => final_mean(&measurements.values),
            Some(steps) => interpolate(&curve, steps as f64).ok_or_else(|| {
                let [first, last] =
                    [curve.first(), curve.last()].map(|point| point.map_or(0.0, |[x, _]| *x));
                Failure::Usage {
                    message: format!(
                        "--at {steps}: {} is known from {first} to {last} environment steps",
                        run.path.display()
                    ),
                }
            })?,
        });
        cell.curves.push(curve);
    }
    Ok(cell)
}
