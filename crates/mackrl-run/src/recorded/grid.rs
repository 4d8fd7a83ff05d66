//! Curves of several runs at common places.

use crate::error::Result;
use mackrl::statistics::interpolate;

use super::{Axis, Measurements, Series};

/// Places of a curve over seconds, and at most twice as many over steps.
const PLACES: usize = 200;

/// The runs of a series at common places.
#[derive(Debug, Clone, PartialEq)]
pub struct Gridded {
    /// Where, in ascending order.
    pub places: Vec<f64>,
    /// For each place, the height of each run's curve.
    pub heights: Vec<Vec<f64>>,
}

impl Gridded {
    /// Reads the curves of a series between the places where tests are due (over seconds, at even distances), from where all
    /// have begun to where the shortest ends.
    ///
    /// # Errors
    /// If a run cannot be read.
    pub fn read(series: &Series, metric: &str, axis: Axis) -> Result<Self> {
        let curves = (series.runs.iter())
            .map(|run| Ok(Measurements::read(run, metric)?.over(axis)))
            .collect::<Result<Vec<_>>>()?;
        let interval = match axis {
            Axis::Steps => series.interval(metric),
            Axis::WallClock => shortest(&curves) / PLACES as f64,
        };
        Ok(Self::of(&curves, interval))
    }

    /// Of curves that each have a point, at the multiples of `interval`.
    fn of(curves: &[Vec<[f64; 2]>], interval: f64) -> Self {
        let end = shortest(curves);
        // An interval that is shorter than a pixel shows nothing more.
        let interval = interval
            .max(end / (2 * PLACES) as f64)
            .max(f64::MIN_POSITIVE);
        let mut gridded = Self {
            places: Vec::new(),
            heights: Vec::new(),
        };
        for number in 0..=2 * PLACES {
            let place = number as f64 * interval;
            let heights: Option<Vec<f64>> =
                (curves.iter().map(|curve| interpolate(curve, place))).collect();
            if let Some(heights) = heights {
                gridded.places.push(place);
                gridded.heights.push(heights);
            }
        }
        gridded
    }
}

impl Series {
    /// Environment steps between two numbers of a metric.
    pub fn interval(&self, metric: &str) -> f64 {
        let interval = |config: &crate::config::Config| match metric.starts_with("test_") {
            true => config.test.interval_steps_env,
            false => config.run.metrics_interval_steps_env,
        };
        let intervals = self.runs.iter().map(|run| interval(&run.config));
        intervals.max().unwrap_or(1) as f64
    }
}

/// Where the shortest curve ends.
fn shortest(curves: &[Vec<[f64; 2]>]) -> f64 {
    let ends = curves.iter().filter_map(|curve| curve.last());
    ends.map(|[x, _]| *x).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_read_where_tests_are_due_as_far_as_all_of_them_go() {
        let curves = [
            vec![[0.0, 0.0], [12.0, 1.2], [20.0, 2.0]],
            vec![[0.0, 5.0], [35.0, 5.0]],
        ];
        let gridded = Gridded::of(&curves, 10.0);
        assert_eq!(gridded.places, [0.0, 10.0, 20.0]);
        assert_eq!(gridded.heights, [[0.0, 5.0], [1.0, 5.0], [2.0, 5.0]]);
    }

    #[test]
    fn a_long_run_with_many_tests_has_no_more_places_than_pixels() {
        let curve = vec![[0.0, 0.0], [1e9, 1.0]];
        let gridded = Gridded::of(&[curve], 10.0);
        assert_eq!(gridded.places.len(), 2 * PLACES + 1);
        assert_eq!(gridded.places.last(), Some(&1e9));
    }
}
