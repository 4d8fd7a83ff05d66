//! The published Figure 6, read from the vector graphics of the paper (November 2018) to about ±0.002.

use serde::Serialize;

/// Published win rates; all lists have one entry per step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Published {
    /// Environment steps.
    pub(crate) steps: Vec<u64>,
    /// Mean over 24 runs on 3m, 22 on 2s3z.
    pub(crate) mackrl: Vec<f64>,
    /// Mean over 20 runs on 3m, 24 on 2s3z.
    pub(crate) central_v: Vec<f64>,
}

const STEPS: [u64; 13] = [
    50_000, 100_000, 200_000, 300_000, 500_000, 750_000, 1_000_000, 1_250_000, 1_500_000,
    1_750_000, 2_000_000, 2_250_000, 2_500_000,
];

const MARINES_MACKRL: [f64; 13] = [
    0.63, 0.832, 0.866, 0.868, 0.907, 0.925, 0.915, 0.936, 0.929, 0.942, 0.946, 0.942, 0.944,
];
const MARINES_CENTRAL_V: [f64; 13] = [
    0.73, 0.828, 0.876, 0.886, 0.883, 0.898, 0.914, 0.919, 0.905, 0.915, 0.919, 0.920, 0.918,
];
const STALKERS_MACKRL: [f64; 13] = [
    0.304, 0.358, 0.491, 0.534, 0.584, 0.627, 0.705, 0.737, 0.751, 0.756, 0.790, 0.826, 0.846,
];
const STALKERS_CENTRAL_V: [f64; 13] = [
    0.076, 0.084, 0.123, 0.155, 0.243, 0.346, 0.457, 0.564, 0.609, 0.675, 0.704, 0.752, 0.773,
];

/// The published curves of a map.
pub(super) fn published(map: &str) -> Published {
    let (mackrl, central_v) = match map {
        "3m" => (MARINES_MACKRL, MARINES_CENTRAL_V),
        _ => (STALKERS_MACKRL, STALKERS_CENTRAL_V),
    };
    Published {
        steps: STEPS.to_vec(),
        mackrl: mackrl.to_vec(),
        central_v: central_v.to_vec(),
    }
}
