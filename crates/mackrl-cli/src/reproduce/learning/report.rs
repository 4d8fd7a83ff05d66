//! A figure in numbers: what its JSON holds.

use mackrl::statistics::{
    Aggregate, Bootstrap, Interval, mean_and_standard_error, probability_of_improvement,
};
use mackrl_run::{provenance::Provenance, recorded::TrainingRun};
use serde::Serialize;

use super::{Arm, Cell, Curve, Curves, Difference, Figure, LearningOptions, Score};
use crate::reproduce::Claim;

/// Length of the paper's training in steps.
const PUBLISHED_LENGTH: f64 = 2_500_000.0;

/// A figure in numbers.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Report {
    /// Of which figure.
    #[serde(skip)]
    pub(crate) figure: &'static Figure,
    /// Repeats these numbers.
    pub(crate) command: String,
    /// Where the runs come from: one entry for each experiment.
    pub(crate) provenance: Vec<Provenance>,
    /// The map's name, if it can be chosen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) map: Option<String>,
    /// Seeds of each learner on each map.
    pub(crate) seeds: u64,
    /// Environment steps at each test of a curve over them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) steps: Vec<u64>,
    /// What is drawn.
    #[serde(flatten)]
    pub(crate) body: Body,
    /// Verdicts.
    pub(crate) claims: Vec<Claim>,
}

/// What [`Curves`] ask for.
#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Body {
    /// One for each map.
    Panels(Vec<Panel>),
    /// In their order.
    Moments(Vec<Moment>),
    /// MACKRL first.
    Variants(Vec<Variant>),
}

/// One map.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Panel {
    /// The map's name.
    pub(crate) map: String,
    /// Share of battles won in greedy tests.
    pub(crate) mackrl: Curve,
    /// Share of battles won in greedy tests.
    pub(crate) central_v: Curve,
    /// The published curves.
    pub(crate) published: &'static Published,
}

/// Published win rates on a map; all lists have one entry per step.
#[derive(Debug, Serialize)]
pub(crate) struct Published {
    /// Environment steps.
    pub(crate) steps: [u64; 13],
    /// Mean over 24 runs on 3m, 22 on 2s3z.
    pub(crate) mackrl: [f64; 13],
    /// Mean over 20 runs on 3m, 24 on 2s3z.
    pub(crate) central_v: [f64; 13],
}

/// Delegation during one interval of training, or during the first batch.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Moment {
    /// Environment steps at the interval's end; 0 for the first batch, which an untrained team played.
    pub(crate) steps: u64,
    /// By the number of commonly known enemies, from 0.
    pub(crate) rates: Vec<Rate>,
    /// The published rates at this share of training.
    pub(crate) published: &'static [f64],
    /// When these were published for, in steps of the paper's training.
    #[serde(skip)]
    steps_published: u64,
}

/// Published delegation: environment steps, of 2.5 million, and the rates by the number of commonly known enemies, from 0.
pub(crate) type PublishedMoment = (u64, [f64; 6]);

/// A delegation rate over seeds.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Rate {
    /// Mean over the seeds in which such pairs occurred; `None` if there are fewer than two.
    pub(crate) mean: Option<f64>,
    /// Its standard error.
    pub(crate) sem: Option<f64>,
    /// Seeds in which such pairs occurred.
    pub(crate) seeds: usize,
}

/// One arm in numbers.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Variant {
    #[serde(flatten)]
    pub(crate) arm: Arm,
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

/// An arm against MACKRL.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Versus {
    /// Final mean of the arm − that of MACKRL.
    pub(crate) difference: f64,
    /// Its standard error (Welch).
    pub(crate) error: f64,
    /// That a run of the arm ends higher than a run of MACKRL.
    pub(crate) probability_of_improvement: Interval,
}

/// The runs of a cell.
pub(super) struct Group<'a> {
    pub(super) cell: &'a Cell,
    pub(super) runs: &'a [TrainingRun],
}

impl Report {
    /// Of `runs`, which are in the order of `cells`, with as many of each.
    pub(super) fn new(
        figure: &'static Figure,
        options: &LearningOptions,
        map: Option<&str>,
        cells: &[Cell],
        runs: &[TrainingRun],
    ) -> Self {
        let groups: Vec<Group<'_>> = (cells.iter().zip(runs.chunks(runs.len() / cells.len())))
            .map(|(cell, runs)| Group { cell, runs })
            .collect();
        let body = Body::new(&figure.curves, &groups, options);
        let tests = match body {
            Body::Moments(_) => 0,
            _ => runs
                .iter()
                .map(|run| run.battle_won.len())
                .max()
                .unwrap_or(0),
        };
        let asked = map.map_or_else(String::new, |map| format!(" --map {map}"));
        Self {
            figure,
            command: options.command(figure.name) + &asked,
            provenance: TrainingRun::provenance_of(runs),
            map: map.map(str::to_owned),
            seeds: options.seeds,
            steps: options.steps_of(tests),
            claims: (figure.claims.iter())
                .map(|statement| statement.judge(&groups, &body, options.steps))
                .collect(),
            body,
        }
    }
}

impl Group<'_> {
    fn curve(&self) -> Curve {
        let runs: Vec<&[f64]> = self.runs.iter().map(|run| &*run.battle_won).collect();
        Curve::of(&runs)
    }
}

impl Body {
    fn new(curves: &Curves, groups: &[Group<'_>], options: &LearningOptions) -> Self {
        match curves {
            Curves::Maps(published) => {
                let panel = |(pair, published): (&[Group<'_>], &'static Published)| Panel {
                    map: pair[0].cell.map.clone(),
                    mackrl: pair[0].curve(),
                    central_v: pair[1].curve(),
                    published,
                };
                Self::Panels(groups.chunks(2).zip(*published).map(panel).collect())
            }
            Curves::Moments(published) => {
                let moment = |published| Moment::new(published, groups[0].runs, options);
                Self::Moments(published.iter().map(moment).collect())
            }
            Curves::Variants => {
                let mackrl = Score::Last.of_all(groups[0].runs);
                let variant =
                    |(number, group)| Variant::new(group, (number > 0).then_some(&mackrl));
                Self::Variants(groups.iter().enumerate().map(variant).collect())
            }
        }
    }
}

impl Moment {
    fn new(
        (steps, published): &'static PublishedMoment,
        runs: &[TrainingRun],
        options: &LearningOptions,
    ) -> Self {
        let interval = interval_at(*steps as f64 / PUBLISHED_LENGTH, options);
        Self {
            steps: (interval as u64 * options.interval).min(options.steps),
            rates: (0..published.len())
                .map(|enemies| Rate::new(runs, interval, enemies))
                .collect(),
            published,
            steps_published: *steps,
        }
    }

    /// When that was, in words.
    pub(super) fn when(&self) -> String {
        match self.steps {
            0 => "in the first batch".to_owned(),
            steps => format!("after {} k steps", steps / 1_000),
        }
    }

    /// When the published rates are from, in words.
    pub(super) fn when_published(&self) -> String {
        match self.steps_published {
            0 => "published: after 400 steps".to_owned(),
            steps => format!("published: after {} k steps", steps / 1_000),
        }
    }
}

/// The number of the test that ends the interval in which a share of training is reached; 0 stands for the first batch.
fn interval_at(share: f64, options: &LearningOptions) -> usize {
    let tests = usize::try_from(options.steps / options.interval)
        .unwrap_or(usize::MAX)
        .max(1);
    let reached =
        |test: &usize| *test as f64 * options.interval as f64 >= share * options.steps as f64;
    (0..=tests).find(reached).unwrap_or(tests)
}

impl Rate {
    fn new(runs: &[TrainingRun], interval: usize, enemies: usize) -> Self {
        let of_run = |run: &TrainingRun| *run.delegation.get(interval)?.get(enemies)?;
        let rates: Vec<f64> = runs.iter().filter_map(of_run).collect();
        let statistics = (rates.len() > 1).then(|| mean_and_standard_error(&rates));
        Self {
            mean: statistics.map(|(mean, _)| mean),
            sem: statistics.map(|(_, error)| error),
            seeds: rates.len(),
        }
    }
}

impl Variant {
    fn new(group: &Group<'_>, mackrl: Option<&Vec<f64>>) -> Self {
        let own = Score::Last.of_all(group.runs);
        let (final_mean, final_error) = mean_and_standard_error(&own);
        Self {
            arm: group.cell.arm,
            curve: group.curve(),
            final_mean,
            final_error,
            final_iqm: Bootstrap::default().interval(std::slice::from_ref(&own), |tasks| {
                Aggregate::InterquartileMean.of(tasks)
            }),
            versus_mackrl: mackrl.map(|mackrl| Versus::new(&own, mackrl)),
        }
    }
}

impl Versus {
    fn new(own: &[f64], mackrl: &[f64]) -> Self {
        let Difference { mean, error, .. } = Difference::between(own, mackrl);
        let both = [own.to_vec(), mackrl.to_vec()];
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
    use super::*;

    #[test]
    fn moments_are_the_same_shares_of_a_shorter_training() {
        let options = |steps, interval| LearningOptions {
            steps,
            interval,
            ..LearningOptions::default()
        };
        let long = options(2_500_000, 25_000);
        assert_eq!(
            [0.0, 0.2, 0.48, 0.64].map(|share| interval_at(share, &long)),
            [0, 20, 48, 64]
        );
        assert_eq!(interval_at(0.64, &options(1_000, 1_000)), 1);
    }
}
