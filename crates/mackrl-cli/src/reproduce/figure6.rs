//! `mackrl reproduce figure6`: win rates of MACKRL and Central-V during training, on `3m` and `2s3z`.
//!
//! Both learners have the same settings, those of a preset; nothing is tuned for either. Each claim of the paper is judged by a
//! rule that is written beside it, and the published curve stands beside ours. Our game is a simulation of the paper's, so
//! what carries over is the order of the learners, not the height of a curve.

use clap::Args;

use super::{
    ablations,
    learning::{Arm, Curves, Figure, LearningOptions, Published, Rule, Score, Statement},
};

/// Reproduce Figure 6: win rates of MACKRL and Central-V during training, on 3m and 2s3z.
///
/// Trains both learners with one preset, many seeds each, with a greedy test after every interval. A run that is finished in
/// the folder is not repeated, so the command can be stopped and given again.
///
/// Writes figure6-3m and figure6-2s3z as .svg and .png, and figure6.json, prints the curves beside the published ones, and
/// judges every claim of the paper: holds or does not, with the numbers.
///
/// Example: mackrl reproduce figure6 --seeds 10 --steps 2500000 --out runs/learning
#[derive(Debug, Clone, Args)]
pub(crate) struct Figure6Options {
    #[command(flatten)]
    pub(crate) learning: LearningOptions,
}

/// Number of 2s3z in the figure; 3m is the first.
const STALKERS: usize = 1;
/// MACKRL, whatever the preset's algorithm is.
pub(super) const MACKRL: Arm = Arm {
    settings: &["algorithm.name=mackrl"],
    ..ablations::MACKRL
};

/// Environment steps of the published points.
const STEPS: [u64; 13] = [
    50_000, 100_000, 200_000, 300_000, 500_000, 750_000, 1_000_000, 1_250_000, 1_500_000,
    1_750_000, 2_000_000, 2_250_000, 2_500_000,
];

/// The figure. What was published in November 2018 is read from the paper's vector graphics to about ±0.002.
pub(crate) static FIGURE: Figure = Figure {
    name: "figure6",
    section: "Figure 6: battles won during training",
    maps: &["3m", "2s3z"],
    arms: |_| vec![MACKRL, ablations::CENTRAL_V],
    curves: Curves::Maps(&[
        Published {
            steps: STEPS,
            mackrl: [
                0.63, 0.832, 0.866, 0.868, 0.907, 0.925, 0.915, 0.936, 0.929, 0.942, 0.946, 0.942,
                0.944,
            ],
            central_v: [
                0.73, 0.828, 0.876, 0.886, 0.883, 0.898, 0.914, 0.919, 0.905, 0.915, 0.919, 0.920,
                0.918,
            ],
        },
        Published {
            steps: STEPS,
            mackrl: [
                0.304, 0.358, 0.491, 0.534, 0.584, 0.627, 0.705, 0.737, 0.751, 0.756, 0.790, 0.826,
                0.846,
            ],
            central_v: [
                0.076, 0.084, 0.123, 0.155, 0.243, 0.346, 0.457, 0.564, 0.609, 0.675, 0.704, 0.752,
                0.773,
            ],
        },
    ]),
    heading: "Figure 6, share of battles won in greedy tests: mean ± standard error over seeds",
    title: "Battles won on {map}",
    subtitle: "Greedy tests during training, our simulator; mean over seeds, band ± one standard error",
    axes: ["Environment steps", "Share of battles won"],
    claims: &[
        Statement {
            claim: "On 3m, both methods win more than 90 % of battles at the end",
            rule: Rule::Ends(|mackrl, central_v| mackrl > 0.9 && central_v > 0.9),
            remark: "Published: 0.946 and 0.920.",
            ..Statement::PAPER
        },
        Statement {
            claim: "On 3m, Central-V, with a third of the parameters, initially learns faster",
            rule: Rule::Ahead(Score::First, ["central-v", "mackrl"]),
            remark: "Published at 50 000 steps: 0.73 against 0.63.",
            ..Statement::PAPER
        },
        Statement {
            claim: "On 3m, MACKRL achieves a higher final performance",
            rule: Rule::Ahead(Score::Last, ["mackrl", "central-v"]),
            remark: "Published: 0.946 against 0.920.",
            ..Statement::PAPER
        },
        Statement {
            claim: "On 2s3z, MACKRL learns faster",
            map: STALKERS,
            rule: Rule::Ahead(Score::All, ["mackrl", "central-v"]),
            remark: "Published: half of all battles are won after 207 000 steps, against 1.11 million.",
            ..Statement::PAPER
        },
        Statement {
            claim: "On 2s3z, MACKRL achieves a higher final performance",
            map: STALKERS,
            rule: Rule::Ahead(Score::Last, ["mackrl", "central-v"]),
            remark: "Published: 0.844 against 0.758.",
            ..Statement::PAPER
        },
        Statement {
            claim: "Aim: on 3m, MACKRL ends at 93 % or more and Central-V at 90 % or more",
            rule: Rule::Ends(|mackrl, central_v| mackrl >= 0.93 && central_v >= 0.9),
            ..Statement::OURS
        },
        Statement {
            claim: "Aim: on 2s3z, MACKRL ends at 85 % or more, and at 5 points or more above Central-V",
            map: STALKERS,
            rule: Rule::Ends(|mackrl, central_v| mackrl >= 0.85 && mackrl - central_v >= 0.05),
            ..Statement::OURS
        },
        Statement {
            claim: "Aim: on 2s3z, after two fifths of the training, the 95 % intervals of the two do not overlap",
            map: STALKERS,
            rule: Rule::Apart,
            remark: "Published after 1 million steps: 0.705 and 0.457.",
            ..Statement::OURS
        },
    ],
};

#[cfg(test)]
mod tests {
    use mackrl_run::{config::Config, recorded::TrainingRun};

    use super::*;
    use crate::reproduce::Verdict;

    /// Six runs, of ten tests each, that win `middle` up to two fifths of the training and `end` from there on, give or take 0.01.
    fn runs(middle: f64, end: f64) -> Vec<TrainingRun> {
        let run = |noise: f64| {
            let won: Vec<f64> = (1..=10)
                .map(|test| noise + if test <= 4 { middle } else { end })
                .collect();
            TrainingRun::new(&Config::default(), won, Vec::new())
        };
        [-0.01, 0.01].repeat(3).into_iter().map(run).collect()
    }

    /// Which of the three aims hold.
    fn aims(marines: [f64; 2], stalkers: [[f64; 2]; 2]) -> [bool; 3] {
        let ends = marines.map(|end| [0.5, end]);
        let all: Vec<TrainingRun> = (ends.into_iter().chain(stalkers))
            .flat_map(|[middle, end]| runs(middle, end))
            .collect();
        let claims = FIGURE.report(None, &all).claims;
        assert_eq!(claims.len(), 8);
        [5, 6, 7].map(|aim| claims[aim].verdict == Verdict::Holds)
    }

    #[test]
    fn two_seeds_or_short_runs_judge_nothing() {
        let groups = |seeds: usize| -> Vec<TrainingRun> {
            let cells = [[0.7, 0.99], [0.1, 0.2], [0.7, 0.99], [0.1, 0.2]];
            let runs = cells.map(|[middle, end]| runs(middle, end));
            runs.into_iter()
                .flat_map(|runs| runs[..seeds].to_vec())
                .collect()
        };
        for claim in FIGURE.report(None, &groups(2)).claims {
            assert_eq!(claim.verdict, Verdict::NotTested, "{}", claim.claim);
            assert!(
                claim.evidence.starts_with("Needs 5 seeds"),
                "{}",
                claim.evidence
            );
        }
        let claims = FIGURE.report(None, &groups(5)).claims;
        assert!(
            claims
                .iter()
                .all(|claim| claim.verdict != Verdict::NotTested)
        );
    }

    #[test]
    fn aims_hold_where_every_number_is_reached() {
        let reached = [[0.70, 0.86], [0.45, 0.80]];
        assert_eq!(aims([0.94, 0.91], reached), [true; 3]);
        assert_eq!(aims([0.92, 0.91], reached), [false, true, true]);
        assert_eq!(aims([0.94, 0.89], reached), [false, true, true]);
        assert_eq!(
            aims([0.94, 0.91], [[0.70, 0.86], [0.45, 0.82]]),
            [true, false, true]
        );
        assert_eq!(
            aims([0.94, 0.91], [[0.46, 0.86], [0.45, 0.80]]),
            [true, true, false]
        );
    }
}
