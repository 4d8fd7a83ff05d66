//! What the protocol claims, and when that holds: written before the runs were made.

use serde::Serialize;

use super::study::{CHOICE, Cell, LEARNED, LEARNERS, Quantity, Study, interquartile};
use crate::reproduce::{ClaimSource, Verdict, interval};

/// How far below "level" may lie and still be level, in shares of battles won.
const LEVEL: f64 = 0.05;
/// How far two learners may lie apart and still be equal.
const EQUAL: f64 = 0.15;

/// A claim before it is judged.
#[derive(Debug)]
pub(super) struct Statement {
    pub(super) claim: &'static str,
    pub(super) source: ClaimSource,
    map: &'static str,
    /// Two learners, each with what is changed in the configuration; empty for nothing.
    pair: [[&'static str; 2]; 2],
    /// Seeds of either learner, and environment steps of a run, without which it is not tested.
    needs: (usize, u64),
    rule: Rule,
    remark: &'static str,
}

/// When a claim about the first and the second of a pair holds. Intervals are 95 % bootstrap intervals of interquartile means over
/// seeds; differences are paired by seed.
#[derive(Debug, Clone, Copy)]
enum Rule {
    /// The interval of the first lies above that of the second.
    Apart(Quantity),
    /// The interval of first − second lies above this number.
    Above(Quantity, f64),
    /// The interval of first − second lies within 0 ± this number.
    Within(Quantity, f64),
    /// The interval of (steps of the second − steps of the first) to this level lies above 0.
    Sooner(f64),
    /// No run of the first lies below this number.
    NoneBelow(Quantity, f64),
    /// The intervals of both lie above this number.
    BothAbove(Quantity, f64),
}

/// A verdict with its evidence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Judgement {
    pub(super) verdict: Verdict,
    pub(super) evidence: String,
}

const MACKRL: [&str; 2] = [LEARNERS[0], ""];
const CENTRAL_V: [&str; 2] = [LEARNERS[1], ""];

impl Statement {
    const ON_2S3Z: Self = Self {
        claim: "",
        source: ClaimSource::Reproduction,
        map: "2s3z",
        pair: [MACKRL, CENTRAL_V],
        needs: (16, 2_500_000),
        rule: Rule::Above(Quantity::End, 0.0),
        remark: "",
    };
    const PAPER_ON_2S3Z: Self = Self {
        source: ClaimSource::Paper,
        ..Self::ON_2S3Z
    };
    const PAPER_ON_3M: Self = Self {
        map: "3m",
        ..Self::PAPER_ON_2S3Z
    };
    const ABLATION: Self = Self {
        needs: (10, 1_000_000),
        rule: Rule::Above(Quantity::All, 0.0),
        ..Self::ON_2S3Z
    };
}

/// Of Figure 6.
pub(super) const CLAIMS: &[Statement] = &[
    Statement {
        claim: "On 2s3z, MACKRL learns faster: it wins more over the whole of training",
        rule: Rule::Above(Quantity::All, 0.0),
        ..Statement::PAPER_ON_2S3Z
    },
    Statement {
        claim: "On 2s3z, MACKRL learns faster: half of a test is won after fewer steps",
        rule: Rule::Sooner(0.5),
        remark: "Published: 207 000 steps against 1.11 million.",
        ..Statement::PAPER_ON_2S3Z
    },
    Statement {
        claim: "On 2s3z, MACKRL achieves a higher final performance",
        remark: "Published: 0.844 against 0.758.",
        ..Statement::PAPER_ON_2S3Z
    },
    Statement {
        claim: "On 2s3z after a million steps, MACKRL is ahead by intervals that do not overlap",
        rule: Rule::Apart(Quantity::At(1_000_000)),
        remark: "Published: 0.705 against 0.457.",
        ..Statement::ON_2S3Z
    },
    Statement {
        claim: "On 2s3z, MACKRL ends at least level: not lower by more than 5 points",
        rule: Rule::Above(Quantity::End, -LEVEL),
        ..Statement::ON_2S3Z
    },
    Statement {
        claim: "On 2s3z, no MACKRL run ends below one half",
        rule: Rule::NoneBelow(Quantity::End, 0.5),
        ..Statement::ON_2S3Z
    },
    Statement {
        claim: "On 3m, both methods win more than 90 % of battles at the end",
        rule: Rule::BothAbove(Quantity::End, 0.9),
        remark: "Published: 0.946 and 0.920.",
        ..Statement::PAPER_ON_3M
    },
    Statement {
        claim: "On 3m, Central-V, with a third of the parameters, initially learns faster",
        pair: [CENTRAL_V, MACKRL],
        rule: Rule::Above(Quantity::First, 0.0),
        remark: "Published at 50 000 steps: 0.73 against 0.63.",
        ..Statement::PAPER_ON_3M
    },
    Statement {
        claim: "On 3m, MACKRL achieves a higher final performance",
        remark: "Published: 0.946 against 0.920.",
        ..Statement::PAPER_ON_3M
    },
];

/// Of the ablations: which part of the gain is joint action?
pub(super) const ABLATIONS: &[Statement] = &[
    Statement {
        claim: "A team that always delegates learns as Central-V does",
        pair: [[LEARNERS[0], "always"], [LEARNERS[1], "small"]],
        rule: Rule::Within(Quantity::All, EQUAL),
        remark: "Both start from weights of their own, so single runs differ.",
        ..Statement::ABLATION
    },
    Statement {
        claim: "The gain comes from acting jointly: MACKRL wins more than a team that always delegates",
        pair: [LEARNED, [LEARNERS[0], "always"]],
        ..Statement::ABLATION
    },
    Statement {
        claim: "The gain does not come from size: MACKRL wins more than a Central-V with as many parameters",
        pair: [LEARNED, [LEARNERS[1], "large"]],
        ..Statement::ABLATION
    },
    Statement {
        claim: "Learning when to delegate helps: MACKRL wins more than a team that acts jointly wherever it can",
        pair: [LEARNED, [LEARNERS[0], "never"]],
        ..Statement::ABLATION
    },
    Statement {
        claim: "Learning the partition helps: MACKRL wins more than with a uniform selector",
        pair: [LEARNED, [LEARNERS[0], "uniform-selector"]],
        ..Statement::ABLATION
    },
    Statement {
        claim: "A choice of partitions helps: MACKRL wins more than with one fixed partition",
        pair: [LEARNED, [LEARNERS[0], "one-partition"]],
        ..Statement::ABLATION
    },
    Statement {
        claim: "Health, shield and unit type in the common knowledge help",
        pair: [[LEARNERS[0], "complete-features"], LEARNED],
        ..Statement::ABLATION
    },
];

impl Statement {
    /// The verdict under a configuration.
    pub(super) fn judge(&self, study: &Study, configuration: &str) -> Judgement {
        let cell =
            |[learner, variant]: [&str; 2]| study.cell(self.map, [learner, configuration, variant]);
        self.judge_cells(self.pair.map(cell))
    }

    /// The verdict on each learner under the configuration that is best for it; nothing for claims about anything but the two
    /// learners on the map on which configurations are chosen.
    pub(super) fn judge_best(&self, study: &Study) -> Option<Judgement> {
        let compares = self.map == CHOICE && self.pair == [MACKRL, CENTRAL_V];
        let cells = LEARNERS.map(|learner| study.best(learner));
        (compares && cells.iter().all(Option::is_some)).then(|| self.judge_cells(cells))
    }

    fn judge_cells(&self, cells: [Option<&Cell>; 2]) -> Judgement {
        let (seeds, steps) = self.needs;
        let is_enough =
            |cell: &Cell| cell.is_whole() && cell.planned >= seeds && cell.steps >= steps;
        if let [Some(first), Some(second)] = cells
            && is_enough(first)
            && is_enough(second)
        {
            let (holds, evidence) = self.rule.apply(first, second);
            let evidence = format!("{evidence} {}", self.remark);
            let verdict = if holds {
                Verdict::Holds
            } else {
                Verdict::DoesNotHold
            };
            return Judgement {
                verdict,
                evidence: evidence.trim_end().to_owned(),
            };
        }
        let there = self
            .pair
            .iter()
            .zip(cells)
            .map(|([learner, variant], cell)| {
                let name = format!("{learner} {variant}");
                let there = match cell {
                    Some(cell) => format!("{} of {} steps", cell.runs.len(), cell.steps),
                    None => "no plan".to_owned(),
                };
                format!("{} on {}: {there}", name.trim_end(), self.map)
            });
        let there: Vec<String> = there.collect();
        Judgement {
            verdict: Verdict::NotTested,
            evidence: format!(
                "needs {seeds} runs of either, of {steps} steps; there are, of {}.",
                there.join(", of ")
            ),
        }
    }
}

impl Rule {
    /// Whether it is satisfied, and the numbers that tell.
    fn apply(self, first: &Cell, second: &Cell) -> (bool, String) {
        let sample = |cell: &Cell, quantity| cell.sample(quantity).unwrap_or_default();
        let names = [first, second].map(|cell| format!("{} {}", cell.learner, cell.variant));
        let [one, other] = names.each_ref().map(|name| name.trim_end());
        let difference = |quantity: Quantity| {
            let of = interquartile(&differences(first, second, |cell| cell.of_runs(quantity)));
            let evidence = format!("{quantity}, {one} − {other}, paired: {}", interval(of));
            (of, evidence)
        };
        let each = |quantity: Quantity| {
            let [a, b] = [first, second].map(|cell| interquartile(&sample(cell, quantity)));
            let evidence = format!("{quantity}: {one} {}, {other} {}", interval(a), interval(b));
            (a, b, evidence)
        };
        match self {
            Self::Apart(quantity) => {
                let (a, b, evidence) = each(quantity);
                (a.low > b.high, evidence + ".")
            }
            Self::Above(quantity, least) => {
                let (of, evidence) = difference(quantity);
                (
                    of.low > least,
                    format!("{evidence}; the interval is to lie above {least}."),
                )
            }
            Self::Within(quantity, most) => {
                let (of, evidence) = difference(quantity);
                let holds = of.low > -most && of.high < most;
                (
                    holds,
                    format!("{evidence}; the interval is to lie within ± {most}."),
                )
            }
            Self::Sooner(level) => {
                let steps = |cell: &Cell| -> Vec<(u64, f64)> {
                    let steps = cell.steps_to(level).unwrap_or_default();
                    cell.runs.keys().copied().zip(steps).collect()
                };
                let of = interquartile(&differences(second, first, steps));
                let [low, estimate, high] =
                    [of.low, of.estimate, of.high].map(|steps| steps / 1000.0);
                let evidence = format!(
                    "Steps to {level}, {other} − {one}, paired: {estimate:.0} k [{low:.0} k, {high:.0} k]; a run that never gets there counts as one test after the end."
                );
                (of.low > 0.0, evidence)
            }
            Self::NoneBelow(quantity, least) => {
                let runs = first.of_runs(quantity);
                let low: Vec<String> = (runs.iter())
                    .filter(|(_, value)| *value < least)
                    .map(|(seed, value)| format!("seed {seed} {value:.3}"))
                    .collect();
                let lowest = runs.iter().map(|(_, value)| *value).fold(1.0, f64::min);
                let evidence = format!(
                    "{quantity}: {} of {} {one} runs below {least}, the lowest {lowest:.3}{}{}.",
                    low.len(),
                    runs.len(),
                    if low.is_empty() { "" } else { ": " },
                    low.join(", ")
                );
                (low.is_empty(), evidence)
            }
            Self::BothAbove(quantity, least) => {
                let (a, b, evidence) = each(quantity);
                (
                    a.low > least && b.low > least,
                    format!("{evidence}; both intervals are to lie above {least}."),
                )
            }
        }
    }
}

/// Of seeds that both cells have, a number of the first less that of the second.
pub(super) fn differences(
    first: &Cell,
    second: &Cell,
    of: impl Fn(&Cell) -> Vec<(u64, f64)>,
) -> Vec<f64> {
    let others = of(second);
    let difference = |(seed, value): (u64, f64)| {
        let (_, other) = others.iter().find(|(other, _)| *other == seed)?;
        Some(value - other)
    };
    of(first).into_iter().filter_map(difference).collect()
}
