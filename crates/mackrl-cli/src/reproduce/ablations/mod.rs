//! `mackrl reproduce ablations`: where MACKRL's gain comes from.
//!
//! Each variant changes one setting of the preset, and nothing is tuned for any of them. "Always delegate" is Central-V with a
//! hierarchy that does nothing, so its curve also checks the implementation.

mod chart;
mod claims;
mod table;
mod variants;

use std::fs;

use anyhow::Context as _;
use claims::Finals;
use clap::Args;
use mackrl::statistics::{
    Aggregate, Bootstrap, Interval, mean_and_standard_error, probability_of_improvement,
};
use mackrl_run::{
    config::ConfigBuilder,
    provenance::Provenance,
    recorded::{TrainingRun, final_mean},
};
use serde::Serialize;
use variants::{Variant, variants};

use super::{
    Claim,
    learning::{Curve, Difference, Job, LearningOptions, train_all},
    write,
};
use crate::plot::SmallMultiples;

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

/// The ablations in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct AblationReport {
    /// Repeats these numbers.
    pub(crate) command: String,
    /// Where the runs come from: one entry for each experiment.
    pub(crate) provenance: Vec<Provenance>,
    /// The map's name.
    pub(crate) map: String,
    /// Seeds of each variant.
    pub(crate) seeds: u64,
    /// Environment steps at each test.
    pub(crate) steps: Vec<u64>,
    /// MACKRL first.
    pub(crate) variants: Vec<VariantReport>,
    /// Verdicts.
    pub(crate) claims: Vec<Claim>,
}

/// One variant in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct VariantReport {
    pub(crate) name: &'static str,
    pub(crate) label: &'static str,
    /// What is laid over the preset.
    pub(crate) settings: &'static [&'static str],
    /// What the comparison with MACKRL tells.
    pub(crate) question: &'static str,
    /// Share of battles won in greedy tests.
    pub(crate) curve: Curve,
    /// Mean over runs of the mean over the last tenth of the tests.
    pub(crate) final_mean: f64,
    /// Its standard error.
    pub(crate) final_error: f64,
    /// The interquartile mean of the same.
    pub(crate) final_iqm: Interval,
    /// Against MACKRL; nothing for MACKRL itself.
    pub(crate) versus_mackrl: Option<Versus>,
}

/// A variant against MACKRL.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Versus {
    /// Final mean of the variant − that of MACKRL.
    pub(crate) difference: f64,
    /// Its standard error (Welch).
    pub(crate) error: f64,
    /// That a run of the variant ends higher than a run of MACKRL.
    pub(crate) probability_of_improvement: Interval,
}

/// Makes all runs that are not there and writes the figure into the folder that `options` names.
///
/// # Errors
/// If a run fails or a file cannot be written.
pub(crate) fn run(options: &AblationOptions) -> anyhow::Result<AblationReport> {
    let (map, options) = (&options.map, options.learning.resolved());
    fs::create_dir_all(&options.out)
        .with_context(|| format!("creating the folder {}", options.out.display()))?;
    let variants = variants(
        &ConfigBuilder::new(crate::registry())
            .preset(&options.preset)?
            .build()?,
    );
    let jobs: Vec<Job> = (variants.iter())
        .flat_map(|variant| {
            (1..=options.seeds).map(|seed| Job::new(map, variant.name, variant.settings, seed))
        })
        .collect();
    let runs = train_all(&jobs, &options)?;
    let report = report(map, &options, &variants, &runs);
    let chart = report.chart();
    let json = serde_json::to_string_pretty(&report)? + "\n";
    write(&options.out, "ablations.json", json.as_bytes())?;
    write(&options.out, "ablations.svg", chart.to_svg().as_bytes())?;
    write(&options.out, "ablations.png", &chart.to_png()?)?;
    Ok(report)
}

fn report(
    map: &str,
    options: &LearningOptions,
    variants: &[Variant],
    runs: &[TrainingRun],
) -> AblationReport {
    let by_variant: Vec<&[TrainingRun]> = runs.chunks(runs.len() / variants.len()).collect();
    let finals = |runs: &[TrainingRun]| -> Vec<f64> {
        (runs.iter().map(|run| final_mean(&run.battle_won))).collect()
    };
    let mackrl = finals(by_variant[0]);
    let of = |(number, (variant, runs)): (usize, (&Variant, &&[TrainingRun]))| {
        let own = finals(runs);
        let (final_mean, final_error) = mean_and_standard_error(&own);
        VariantReport {
            name: variant.name,
            label: variant.label,
            settings: variant.settings,
            question: variant.question,
            curve: Curve::of(&(runs.iter().map(|run| &*run.battle_won)).collect::<Vec<_>>()),
            final_mean,
            final_error,
            final_iqm: Bootstrap::default().interval(std::slice::from_ref(&own), |tasks| {
                Aggregate::InterquartileMean.of(tasks)
            }),
            versus_mackrl: (number > 0).then(|| Versus::of(&own, &mackrl)),
        }
    };
    let variants: Vec<VariantReport> = (variants.iter().zip(&by_variant))
        .enumerate()
        .map(of)
        .collect();
    let finals_of = |name: &str| -> Vec<f64> {
        let place = variants.iter().position(|variant| variant.name == name);
        place.map_or_else(Vec::new, |place| finals(by_variant[place]))
    };
    let tests = variants.iter().map(|variant| variant.curve.mean.len());
    AblationReport {
        command: format!("{} --map {map}", options.command("ablations")),
        provenance: TrainingRun::provenance_of(runs),
        map: map.to_owned(),
        seeds: options.seeds,
        steps: options.steps_of(tests.max().unwrap_or(0)),
        claims: claims::claims(&Finals {
            mackrl,
            central_v: finals_of("central-v"),
            always_delegate: finals_of("always-delegate"),
        }),
        variants,
    }
}

impl AblationReport {
    /// The plot.
    pub(crate) fn chart(&self) -> SmallMultiples {
        chart::chart(self)
    }
}

impl Versus {
    fn of(variant: &[f64], mackrl: &[f64]) -> Self {
        let Difference { mean, error } = Difference::between(variant, mackrl);
        let both = [variant.to_vec(), mackrl.to_vec()];
        Self {
            difference: mean,
            error,
            probability_of_improvement: Bootstrap::default().interval(&both, |strata| {
                probability_of_improvement(&strata[..1], &strata[1..])
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use mackrl_run::config::Config;

    use super::*;

    /// Two runs of each variant: MACKRL ends at 0.8, number n at 0.8 − n/10, all ± 0.05.
    fn example() -> AblationReport {
        let preset = ConfigBuilder::new(crate::registry())
            .preset("paper")
            .unwrap();
        let variants = variants(&preset.build().unwrap());
        let runs: Vec<TrainingRun> = (0..variants.len())
            .flat_map(|number| {
                let end = 0.8 - number as f64 / 10.0;
                [-0.05, 0.05].map(|noise| {
                    TrainingRun::new(&Config::default(), vec![0.0, 0.3, end + noise], Vec::new())
                })
            })
            .collect();
        report("2s3z", &LearningOptions::default(), &variants, &runs)
    }

    #[test]
    fn every_variant_is_compared_with_mackrl() {
        let report = example();
        assert_eq!(report.variants.len(), 9);
        assert_eq!(report.variants[0].versus_mackrl, None);
        let third = &report.variants[3];
        assert!((third.final_mean - 0.5).abs() < 1e-12, "{third:?}");
        let versus = third.versus_mackrl.unwrap();
        assert!((versus.difference + 0.3).abs() < 1e-12, "{versus:?}");
        assert_eq!(versus.probability_of_improvement.estimate, 0.0);
        assert_eq!(report.steps, [0, 1_000, 1_000]);
    }

    #[test]
    fn a_team_that_always_delegates_is_held_against_central_v() {
        let claim = &example().claims[0];
        // 0.1 is less than two standard errors of 0.071.
        assert!(claim.holds, "{claim:?}");
        assert!(claim.evidence.contains("-0.100 ± 0.071"), "{claim:?}");
        let gain = &example().claims[1];
        assert!(
            gain.holds && gain.evidence.contains("+0.200 ± 0.071"),
            "{gain:?}"
        );
    }

    #[test]
    fn the_plot_has_a_panel_for_each_variant_and_the_table_a_row() {
        let report = example();
        let svg = report.chart().to_svg();
        let text = report.to_string();
        for variant in &report.variants {
            let row = format!("{} (2)", variant.label);
            assert!(svg.contains(variant.label) && text.contains(&row), "{row}");
        }
        assert_eq!(svg.matches("<clipPath").count(), 8);
        assert!(svg.contains("−0.30 ± 0.07"), "{svg}");
    }
}
