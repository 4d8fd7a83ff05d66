//! Means, spreads and quantiles.

use serde::Serialize;

/// The quantiles that are shown.
pub const QUANTILES: [f64; 5] = [0.1, 0.25, 0.5, 0.75, 0.9];

/// What is shown of a distribution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Number of values.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Standard deviation of one value.
    pub sd: f64,
    /// Values at [`QUANTILES`].
    pub quantiles: [f64; 5],
}

impl Spread {
    /// The spread of `values`; `None` if there are none.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        if values.is_empty() {
            return None;
        }
        let count = values.len();
        let mean = values.iter().sum::<f64>() / count as f64;
        let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        Some(Self {
            count,
            mean,
            sd: (squares / (count as f64 - 1.0).max(1.0)).sqrt(),
            quantiles: QUANTILES.map(|part| quantile(&sorted, part)),
        })
    }

    /// Standard error of the mean.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.sd / (self.count as f64).sqrt()
    }

    /// The middle value.
    #[must_use]
    pub const fn median(&self) -> f64 {
        self.quantiles[2]
    }
}

/// The least value of `sorted` that at least the given part of all values does not exceed.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let rank = (part * sorted.len() as f64).ceil();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a part in [0, 1] of a length"
    )]
    let index = (rank as usize).clamp(1, sorted.len()) - 1;
    sorted[index]
}
