//! `mackrl reproduce ablations`: where MACKRL's gain comes from.
//!
//! Each variant changes one setting of the preset, and nothing is tuned for any of them. "Always delegate" is Central-V with a
//! hierarchy that does nothing, so its curve also checks the implementation.

use clap::Args;
use mackrl_run::config::Config;

use super::learning::{Arm, Curves, Figure, LearningOptions, Rule, Score, Statement};

/// Show where MACKRL's gain comes from: one plot of nine learners that differ in one thing each.
///
/// Always delegate, never delegate where there is common knowledge, one fixed partition, five of them, a uniform selector, the
/// other features of common knowledge, a critic that does not see the last actions; beside MACKRL and Central-V.
///
/// Writes ablations.svg, ablations.png and ablations.json, and prints a table. Runs that are finished in the folder, also by
/// figure6 or figure7, are not repeated; unfinished ones go on.
///
/// Example: mackrl reproduce ablations --seeds 5 --steps 1000000 --out runs/learning
#[derive(Debug, Clone, Args)]
pub(crate) struct AblationOptions {
    #[command(flatten)]
    pub(crate) learning: LearningOptions,

    /// Map to learn on.
    #[arg(long, value_name = "MAP", default_value = "2s3z")]
    pub(crate) map: String,
}

/// MACKRL itself, which all others are compared with.
pub(super) const MACKRL: Arm = Arm {
    name: "mackrl",
    label: "MACKRL",
    settings: &[],
    question: "what everything is compared with",
};

/// Without any hierarchy.
pub(super) const CENTRAL_V: Arm = Arm {
    name: "central-v",
    label: "Central-V",
    settings: &["algorithm.name=central-v"],
    question: "what the hierarchy adds to independent agents with a central critic",
};

const OTHERS: [Arm; 6] = [
    Arm {
        name: "always-delegate",
        label: "always delegate",
        settings: &["algorithm.delegation=always"],
        question: "whether the gain comes from acting jointly: without it, this is Central-V",
    },
    Arm {
        name: "never-delegate",
        label: "never delegate",
        settings: &["algorithm.delegation=never"],
        question: "whether pairs have to learn when not to act jointly",
    },
    Arm {
        name: "one-partition",
        label: "one partition",
        settings: &["algorithm.partitions=sampled:1"],
        question: "whether it matters who acts with whom",
    },
    Arm {
        name: "five-partitions",
        label: "5 partitions",
        settings: &["algorithm.partitions=sampled:5"],
        question: "how many partitions are needed",
    },
    Arm {
        name: "uniform-selector",
        label: "uniform selector",
        settings: &["algorithm.selector=uniform"],
        question: "whether the choice of the partition has to be learned",
    },
    Arm {
        name: "state-only-critic",
        label: "critic without last actions",
        settings: &["env.state_last_action=false"],
        question: "whether the critic has to know what was done last",
    },
];

const THIN: Arm = Arm {
    name: "thin-features",
    label: "thin features",
    settings: &["algorithm.common_knowledge=thin"],
    question: "what health, shield and unit type in the common knowledge are worth",
};
const COMPLETE: Arm = Arm {
    name: "complete-features",
    label: "complete features",
    settings: &["algorithm.common_knowledge=complete"],
    question: "what health, shield and unit type in the common knowledge are worth",
};

/// The figure.
pub(crate) static FIGURE: Figure = Figure {
    name: "ablations",
    section: "Ablations: where the gain comes from",
    maps: &["2s3z"],
    arms: variants,
    curves: Curves::Variants,
    heading: "Ablations on {map}: share of battles won, mean of the last tenth of a run's tests",
    title: "What MACKRL's parts are worth on {map}",
    subtitle: "Greedy tests during training; mean of {seeds} seeds, band ± one standard error. The number: final win rate against MACKRL's",
    axes: ["Environment steps", "Share of battles won"],
    claims: &[
        Statement {
            claim: "A team that always delegates learns as Central-V does",
            rule: Rule::Equal(["always-delegate", "central-v"]),
            remark: "Both start from weights of their own, so single runs differ.",
            ..Statement::OURS
        },
        Statement {
            claim: "The gain comes from acting jointly: a team that always delegates ends lower than MACKRL",
            rule: Rule::Ahead(Score::Last, ["mackrl", "always-delegate"]),
            ..Statement::OURS
        },
    ],
};

/// All learners for a preset: MACKRL first, and the kind of features that the preset does not have last.
fn variants(preset: &Config) -> Vec<Arm> {
    let features = match preset.algorithm.text("common_knowledge") {
        "thin" => COMPLETE,
        _ => THIN,
    };
    [&[MACKRL, CENTRAL_V], &OTHERS[..], &[features]].concat()
}

#[cfg(test)]
mod tests {
    use mackrl_run::{config::ConfigBuilder, recorded::TrainingRun};

    use super::*;
    use crate::reproduce::{
        Verdict,
        learning::{Body, Report, Variant},
    };

    /// Six runs of each variant: MACKRL ends at 0.8, number n at 0.8 − n/10, all ± 0.05.
    fn example() -> Report {
        let runs: Vec<TrainingRun> = (0..9)
            .flat_map(|number| {
                let end = 0.8 - f64::from(number) / 10.0;
                [-0.05, 0.05].repeat(3).into_iter().map(move |noise| {
                    TrainingRun::new(&Config::default(), vec![0.0, 0.3, end + noise], Vec::new())
                })
            })
            .collect();
        FIGURE.report(Some("2s3z"), &runs)
    }

    fn compared(report: &Report) -> &[Variant] {
        let Body::Variants(variants) = &report.body else {
            panic!("the ablations show variants");
        };
        variants
    }

    #[test]
    fn every_variant_is_compared_with_mackrl() {
        let report = example();
        let variants = compared(&report);
        assert_eq!(variants.len(), 9);
        assert_eq!(variants[0].versus_mackrl, None);
        let third = &variants[3];
        assert!((third.final_mean - 0.5).abs() < 1e-12, "{third:?}");
        let versus = third.versus_mackrl.unwrap();
        assert!((versus.difference + 0.3).abs() < 1e-12, "{versus:?}");
        assert_eq!(versus.probability_of_improvement.estimate, 0.0);
        assert_eq!(report.steps, [0, 1_000, 2_000]);
    }

    #[test]
    fn a_team_that_always_delegates_is_held_against_central_v() {
        let claim = &example().claims[0];
        // The interval reaches from −0.17 to −0.03, which is not within ± 0.15.
        assert_eq!(claim.verdict, Verdict::DoesNotHold, "{claim:?}");
        assert!(
            claim.evidence.contains("-0.100 [-0.170, -0.030]"),
            "{claim:?}"
        );
        let gain = &example().claims[1];
        assert_eq!(gain.verdict, Verdict::Holds, "{gain:?}");
        assert!(
            gain.evidence.contains("+0.200 [+0.130, +0.270]"),
            "{gain:?}"
        );
    }

    #[test]
    fn the_plot_has_a_panel_for_each_variant_and_the_table_a_row() {
        let report = example();
        let svg = report.charts()[0].1.to_svg();
        let text = report.to_string();
        for variant in compared(&report) {
            let row = format!("{} (6)", variant.arm.label);
            assert!(
                svg.contains(variant.arm.label) && text.contains(&row),
                "{row}"
            );
        }
        assert_eq!(svg.matches("<clipPath").count(), 8);
        assert!(svg.contains("−0.30 ± 0.03"), "{svg}");
    }

    #[test]
    fn every_variant_differs_from_the_preset_in_what_it_says_and_in_nothing_else() {
        let mut presets = 0;
        for preset in crate::registry().presets() {
            // A map on which no variant is impossible, as the figure's.
            let base = ConfigBuilder::new(crate::registry())
                .preset(preset.name)
                .unwrap();
            let base = base.set("env.map=2s3z").unwrap();
            let config = base.build().unwrap();
            // What is varied is the hierarchy of pairs under the paper's learner.
            let varied = ["algorithm.name", "algorithm.levels"].map(|key| config.get(key));
            if varied != ["mackrl", "pairs"].map(|value| Some(value.into())) {
                continue;
            }
            presets += 1;
            for variant in variants(&config).into_iter().skip(1) {
                let changed = (variant.settings.iter())
                    .try_fold(base.clone(), |builder, setting| builder.set(setting))
                    .unwrap();
                let changed = changed.build().unwrap();
                // Central-V has no settings of the hierarchy.
                let differing = changed.keys();
                let differing = differing.filter(|key| changed.get(key) != config.get(key));
                assert_eq!(differing.count(), 1, "{} of {}", variant.name, preset.name);
            }
        }
        assert!(presets >= 2, "paper and paper-code");
    }
}
