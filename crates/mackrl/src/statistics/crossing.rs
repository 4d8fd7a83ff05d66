//! How soon a curve reaches a level.

use serde::{Deserialize, Serialize};

use super::median;

/// When the runs of an algorithm first reached a level.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Crossings {
    /// The level.
    pub level: f64,
    /// Runs that reached it.
    pub reached: usize,
    /// All runs.
    pub runs: usize,
    /// Median over all runs of where they first reached it. A run that never did counts as later than any other, so this is
    /// `None` unless more than half of the runs reached it.
    pub median: Option<f64>,
}

impl Crossings {
    /// Of the curves of some runs, each a list of (x, y) in ascending order of x.
    #[must_use]
    pub fn of(curves: &[Vec<[f64; 2]>], level: f64) -> Self {
        let crossings: Vec<Option<f64>> = (curves.iter())
            .map(|curve| first_crossing(curve, level))
            .collect();
        let late_if_never: Vec<f64> = (crossings.iter())
            .map(|crossing| crossing.unwrap_or(f64::INFINITY))
            .collect();
        Self {
            level,
            reached: crossings.iter().flatten().count(),
            runs: curves.len(),
            median: Some(median(&late_if_never)).filter(|median| median.is_finite()),
        }
    }
}

/// Where the curve through `points`, (x, y) in ascending order of x and joined by straight lines, first reaches `level`; a curve
/// that begins there reaches it at its first point.
///
/// # Examples
/// ```
/// let curve = [[0.0, 0.0], [10.0, 0.4], [20.0, 0.8], [30.0, 0.2]];
/// assert_eq!(mackrl::statistics::first_crossing(&curve, 0.5), Some(12.5));
/// assert_eq!(mackrl::statistics::first_crossing(&curve, 0.9), None);
/// ```
#[must_use]
pub fn first_crossing(points: &[[f64; 2]], level: f64) -> Option<f64> {
    let reached = points.iter().position(|&[_, y]| y >= level)?;
    let [x, y] = points[reached];
    let Some([previous_x, previous_y]) = reached.checked_sub(1).map(|before| points[before]) else {
        return Some(x);
    };
    Some(previous_x + (level - previous_y) / (y - previous_y) * (x - previous_x))
}

/// The height at `x` of the curve through `points`, (x, y) in ascending order of x and joined by straight lines; `None` outside.
#[must_use]
pub fn interpolate(points: &[[f64; 2]], x: f64) -> Option<f64> {
    let after = points.iter().position(|point| point[0] >= x)?;
    let [right, above] = points[after];
    if right <= x {
        return Some(above);
    }
    let [left, below] = points[after.checked_sub(1)?];
    Some(below + (x - left) / (right - left) * (above - below))
}
