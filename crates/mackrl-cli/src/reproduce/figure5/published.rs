//! The published curves.

use mackrl_env::matrix_game::ObservationDistribution;

use super::report::{Published, Quantity};

/// What was published for this game.
pub(super) fn published(distribution: ObservationDistribution) -> Published {
    match distribution {
        ObservationDistribution::Y2018 => Published {
            source:
                "Figure 5 of the paper (November 2018), read from its vector graphics to ±0.002"
                    .into(),
            label: "2018".into(),
            quantity: Quantity::Train,
            points: (0..=10).map(|tenth| f64::from(tenth) / 10.0).collect(),
            iac: vec![
                0.654, 0.663, 0.695, 0.721, 0.737, 0.762, 0.786, 0.819, 0.834, 0.856, 0.868,
            ],
            jal: vec![
                0.498, 0.548, 0.598, 0.647, 0.697, 0.747, 0.797, 0.846, 0.896, 0.946, 0.996,
            ],
            mackrl: vec![
                0.621, 0.660, 0.705, 0.741, 0.778, 0.810, 0.848, 0.887, 0.924, 0.959, 0.996,
            ],
        },
        ObservationDistribution::NeurIps2019 => Published {
            source: "the NeurIPS 2019 poster, digitised to ±0.003".into(),
            label: "2019".into(),
            quantity: Quantity::Test,
            points: (0..=5).map(|fifth| f64::from(2 * fifth) / 10.0).collect(),
            iac: vec![0.772, 0.770, 0.775, 0.768, 0.771, 0.773],
            jal: vec![0.50, 0.575, 0.650, 0.725, 0.800, 0.875],
            mackrl: vec![0.762, 0.780, 0.790, 0.813, 0.832, 0.875],
        },
    }
}
