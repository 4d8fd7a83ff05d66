//! What a figure claims, and the rules by which that is judged.

use mackrl::statistics::{Aggregate, Bootstrap, mean};
use mackrl_run::recorded::{TrainingRun, final_mean, share_of};

use super::{
    Difference,
    report::{Body, Group},
};
use crate::reproduce::{Claim, ClaimSource, Verdict, interval, number};

/// Share of the tests at the beginning of training that "initially" means.
const INITIAL_SHARE: f64 = 0.1;
/// A million of the paper's 2.5 million steps.
const MIDDLE_SHARE: f64 = 0.4;
/// How far two learners may lie apart and still be equal, in shares of battles won.
const EQUAL: f64 = 0.15;
/// MACKRL and Central-V, by the names of their arms.
const BOTH: [&str; 2] = ["mackrl", "central-v"];

/// A claim before it is judged.
#[derive(Debug)]
pub(crate) struct Statement {
    /// What is claimed.
    pub(crate) claim: &'static str,
    /// Who claims it.
    pub(crate) source: ClaimSource,
    /// Of which map of the figure, from 0.
    pub(crate) map: usize,
    /// Seeds of each learner, and environment steps of a run, without which it is not tested.
    pub(crate) needs: (usize, u64),
    /// When it holds.
    pub(crate) rule: Rule,
    /// What there is to say beside the evidence.
    pub(crate) remark: &'static str,
}

/// When a claim holds. Arms are called by their names.
#[derive(Debug)]
pub(crate) enum Rule {
    /// The final means of MACKRL and Central-V are like this.
    Ends(fn(f64, f64) -> bool),
    /// The first scores higher than the second: the 95 % interval of the difference, by Student's t, lies above 0.
    Ahead(Score, [&'static str; 2]),
    /// Both end equally high: that interval lies within 0 ± [`EQUAL`].
    Equal([&'static str; 2]),
    /// After two fifths of the training, the interval of MACKRL is above that of Central-V.
    Apart,
    /// All delegation rates at a moment are like this.
    Delegates {
        /// Its number among the figure's.
        moment: usize,
        /// Numbers of commonly known enemies.
        enemies: &'static [usize],
        /// The rule for each rate, and in words.
        rule: (fn(f64) -> bool, &'static str),
    },
}

/// One number for a run.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Score {
    /// Over the first tests after the one before training.
    First,
    /// Over all tests.
    All,
    /// Over the last tests.
    Last,
    /// Over the last tests of the first two fifths of the training.
    Middle,
}

impl Score {
    /// The score of each run.
    pub(super) fn of_all(self, runs: &[TrainingRun]) -> Vec<f64> {
        runs.iter().map(|run| self.of(&run.battle_won)).collect()
    }

    fn of(self, won: &[f64]) -> f64 {
        match self {
            Self::First => {
                let won = &won[1.min(won.len() - 1)..];
                mean(&won[..share_of(won.len(), INITIAL_SHARE)])
            }
            Self::All => mean(won),
            Self::Last => final_mean(won),
            Self::Middle => final_mean(&won[..share_of(won.len(), MIDDLE_SHARE)]),
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::First => "Mean of the first tenth of the tests",
            Self::All => "Mean over all tests of a run",
            Self::Last => "Mean of the last tenth of the tests",
            Self::Middle => "Mean of the last tenth of the tests so far",
        }
    }
}

impl Statement {
    /// What the paper claims is laid over this: a first map, and no remark.
    pub(crate) const PAPER: Self = Self {
        claim: "",
        source: ClaimSource::Paper,
        map: 0,
        needs: (5, 1_000_000),
        rule: Rule::Apart,
        remark: "",
    };
    /// The same for what this project claims.
    pub(crate) const OURS: Self = Self {
        source: ClaimSource::Reproduction,
        ..Self::PAPER
    };

    /// The verdict, of runs of `steps` environment steps.
    pub(super) fn judge(&self, groups: &[Group<'_>], body: &Body, steps: u64) -> Claim {
        let (seeds_needed, steps_needed) = self.needs;
        let seeds = groups.iter().map(|group| group.runs.len()).min();
        let seeds = seeds.unwrap_or_default();
        let (verdict, evidence) = if seeds >= seeds_needed && steps >= steps_needed {
            let (holds, evidence) = self.rule.apply(|names| self.arms(names, groups), body);
            (Verdict::of(holds), evidence)
        } else {
            let evidence = format!(
                "Needs {seeds_needed} seeds of each learner and {steps_needed} environment steps; there are {seeds} seeds of {steps} \
                 steps."
            );
            (Verdict::NotTested, evidence)
        };
        Claim {
            claim: self.claim.to_owned(),
            source: self.source,
            verdict,
            evidence: format!("{evidence} {}", self.remark).trim_end().to_owned(),
        }
    }

    /// The runs of two arms on the map that is spoken of.
    fn arms<'a>(&self, names: [&str; 2], groups: &'a [Group<'a>]) -> [&'a Group<'a>; 2] {
        names.map(|name| {
            let mut of_arm = groups.iter().filter(|group| group.cell.arm.name == name);
            of_arm
                .nth(self.map)
                .expect("claims are about arms and maps of their figure")
        })
    }
}

impl Rule {
    /// Whether it is satisfied, and the numbers that tell.
    fn apply<'a>(
        &self,
        arms: impl Fn([&str; 2]) -> [&'a Group<'a>; 2],
        body: &Body,
    ) -> (bool, String) {
        let compared = |score: Score, names: [&str; 2]| {
            let [first, second] = arms(names);
            let difference =
                Difference::between(&score.of_all(first.runs), &score.of_all(second.runs));
            let [first, second] = [first, second].map(|group| group.cell.arm.label);
            let evidence = format!("{}, {first} − {second}: {difference}", score.name());
            (difference, evidence)
        };
        match self {
            Self::Ends(holds) => {
                let [mackrl, central_v] =
                    arms(BOTH).map(|group| mean(&Score::Last.of_all(group.runs)));
                let evidence = format!(
                    "{}: MACKRL {mackrl:.3}, Central-V {central_v:.3}.",
                    Score::Last.name()
                );
                (holds(mackrl, central_v), evidence)
            }
            Self::Ahead(score, names) => {
                let (difference, evidence) = compared(*score, *names);
                (
                    difference.is_ahead(),
                    evidence + "; ahead means that the 95 % interval lies above 0.",
                )
            }
            Self::Equal(names) => {
                let (difference, evidence) = compared(Score::Last, *names);
                let [low, high] = difference.interval();
                (
                    low > -EQUAL && high < EQUAL,
                    format!(
                        "{evidence}; equal means that the 95 % interval lies within ± {EQUAL}."
                    ),
                )
            }
            Self::Apart => {
                let [mackrl, central_v] = arms(BOTH).map(|group| {
                    let runs = Score::Middle.of_all(group.runs);
                    Bootstrap::default().interval(&[runs], |tasks| Aggregate::Mean.of(tasks))
                });
                let evidence = format!(
                    "{}, with its bootstrap interval: MACKRL {}, Central-V {}.",
                    Score::Middle.name(),
                    interval(mackrl),
                    interval(central_v)
                );
                (mackrl.low > central_v.high, evidence)
            }
            Self::Delegates {
                moment,
                enemies,
                rule: (holds, words),
            } => {
                let Body::Moments(moments) = body else {
                    unreachable!("claims about delegation belong to a figure of delegation");
                };
                let moment = &moments[*moment];
                let mut rates = enemies.iter().map(|&enemies| moment.rates[enemies].mean);
                let published = enemies
                    .iter()
                    .map(|&enemies| Some(moment.published[enemies]));
                let evidence = format!(
                    "With {enemies:?} commonly known enemies, {}: {}; the rule asks for {words}. Published: {}.",
                    moment.when(),
                    listed(rates.clone()),
                    listed(published)
                );
                (rates.all(|rate| rate.is_some_and(holds)), evidence)
            }
        }
    }
}

fn listed(rates: impl Iterator<Item = Option<f64>>) -> String {
    rates.map(number).collect::<Vec<_>>().join(", ")
}
