//! `mackrl reproduce figure7`: how often pairs delegate, by how many enemies they commonly know, during training on `2s3z`.
//!
//! Uses the MACKRL runs of Figure 6; those that are finished in the folder are not repeated. As in the paper, only pairs with
//! some common knowledge count, of the partitions that were chosen.

use clap::Args;

use super::{
    figure6,
    learning::{Curves, Figure, LearningOptions, Rule, Statement},
};

/// Reproduce Figure 7: how often pairs delegate, by how many enemies they commonly know, on 2s3z.
///
/// Trains MACKRL as figure6 does, and looks at four moments of training. Runs that figure6 has finished in
/// the same folder are used as they are.
///
/// Writes figure7.svg, figure7.png and figure7.json, prints the rates beside the published ones, and judges what the paper says.
///
/// Example: mackrl reproduce figure7 --seeds 10 --steps 2500000 --out runs/learning
#[derive(Debug, Clone, Args)]
pub(crate) struct Figure7Options {
    #[command(flatten)]
    pub(crate) learning: LearningOptions,
}

/// The figure. The paper looked at moments of its 2.5 million steps; what it shows at 400 steps can only be the first batch. Its rates
/// are read from its vector graphics.
pub(crate) static FIGURE: Figure = Figure {
    name: "figure7",
    section: "Figure 7: when pairs delegate",
    maps: &["2s3z"],
    arms: |_| vec![figure6::MACKRL],
    curves: Curves::Moments(&[
        (0, [0.046, 0.047, 0.034, 0.032, 0.031, 0.023]),
        (500_000, [0.093, 0.391, 0.149, 0.030, 0.003, 0.002]),
        (1_200_000, [0.158, 0.680, 0.176, 0.033, 0.000, 0.001]),
        (1_600_000, [0.137, 0.636, 0.932, 0.229, 0.002, 0.001]),
    ]),
    heading: "Figure 7, share of chosen pairs that delegate on 2s3z, by commonly known enemies: mean of {seeds} seeds",
    title: "Delegation by commonly known enemies, 2s3z",
    subtitle: "Chosen pairs with common knowledge; mean of {seeds} seeds, band ± one standard error",
    axes: [
        "Enemies in the pair's common knowledge",
        "Share of pairs that delegate",
    ],
    claims: &[
        Statement {
            claim: "At the beginning of training, the pair controller delegates only rarely",
            // The first batch is that of an untrained team, however long the run.
            needs: (5, 1_000),
            rule: Rule::Delegates {
                moment: 0,
                enemies: &[0, 1, 2, 3, 4, 5],
                rule: (|rate| rate < 0.1, "less than 0.1 of each"),
            },
            ..Statement::PAPER
        },
        Statement {
            claim: "Later it delegates in most situations in which few enemies are commonly known",
            rule: Rule::Delegates {
                moment: 3,
                enemies: &[1, 2],
                rule: (|rate| rate >= 0.5, "at least 0.5 of each"),
            },
            ..Statement::PAPER
        },
        Statement {
            claim: "Later it coordinates where common knowledge is substantial",
            rule: Rule::Delegates {
                moment: 3,
                enemies: &[4, 5],
                rule: (|rate| rate < 0.05, "less than 0.05 of each"),
            },
            ..Statement::PAPER
        },
    ],
};

#[cfg(test)]
mod tests {
    use mackrl_run::{config::Config, recorded::TrainingRun};

    use super::*;
    use crate::reproduce::Chart;

    #[test]
    fn every_moment_has_a_panel_of_its_own_with_the_published_curve() {
        let rates = vec![vec![Some(0.5); 6]; 2];
        let run = || TrainingRun::new(&Config::default(), vec![0.0, 0.5], rates.clone());
        let charts = FIGURE.report(None, &[run(), run()]).charts();
        let [(_, Chart::Multiples(chart))] = &charts[..] else {
            panic!("one chart of several panels, found {}", charts.len());
        };
        let Curves::Moments(published) = FIGURE.curves else {
            panic!("moments");
        };
        assert_eq!(chart.panels.len(), published.len());
        for (panel, (_, rates)) in chart.panels.iter().zip(published) {
            let named = panel.series.iter().filter(|series| series.name.is_some());
            let named: Vec<_> = named.collect();
            assert_eq!(named[1].name.as_deref(), Some("published 2018"));
            let heights: Vec<f64> = named[1].points.iter().map(|point| point.y).collect();
            assert_eq!(heights, rates);
        }
        let notes: std::collections::BTreeSet<&str> =
            chart.panels.iter().map(|panel| &*panel.note).collect();
        assert_eq!(notes.len(), published.len(), "{notes:?}");
    }
}
