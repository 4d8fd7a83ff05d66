//! Whether one algorithm is better than another.

use super::mean;

/// The probability that a run of the first algorithm is better than a run of the second on the same task, averaged over tasks;
/// both have a list of runs for each task.
///
/// # Equation
/// mean over tasks of (1 / (n·m)) Σ_i Σ_j [x_i > y_j] + ½ [x_i = y_j], i in 0..n, j in 0..m: the Mann–Whitney U statistic over n·m.
///
/// # Panics
/// If the two do not have the same number of tasks.
///
/// # Examples
/// ```
/// let better = vec![vec![0.9, 0.5]];
/// let worse = vec![vec![0.5, 0.1]];
/// assert_eq!(mackrl::statistics::probability_of_improvement(&better, &worse), 0.875);
/// ```
#[must_use]
pub fn probability_of_improvement(first: &[Vec<f64>], second: &[Vec<f64>]) -> f64 {
    assert_eq!(first.len(), second.len(), "both have the same tasks");
    let of_task = |(first, second): (&Vec<f64>, &Vec<f64>)| {
        let wins: f64 = (first.iter())
            .flat_map(|x| second.iter().map(move |y| won(*x, *y)))
            .sum();
        wins / (first.len() * second.len()) as f64
    };
    mean(&first.iter().zip(second).map(of_task).collect::<Vec<_>>())
}

/// 1 for a win, ½ for a draw.
fn won(x: f64, y: f64) -> f64 {
    match x.partial_cmp(&y) {
        Some(std::cmp::Ordering::Greater) => 1.0,
        Some(std::cmp::Ordering::Equal) => 0.5,
        _ => 0.0,
    }
}
