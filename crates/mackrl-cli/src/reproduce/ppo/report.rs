//! What the runs show: the numbers of each learner on each map, and the verdicts on what is claimed.

use mackrl::statistics::{
    Aggregate, Bootstrap, Crossings, Interval, mean, mean_and_standard_error,
};
use mackrl_run::{
    provenance::Provenance,
    recorded::{TrainingRun, final_mean},
    training::Score,
};
use serde::Serialize;

use super::runs::{Cell, Kept};
use crate::reproduce::{Claim, ClaimSource, Verdict, learning::Difference};

/// Shares of battles until which steps are counted.
const LEVELS: [f64; 2] = [0.7, 0.9];
/// Runs of each of two learners from which on a claim about them is judged: intervals of fewer say nothing.
const RUNS_LEAST: usize = 3;
/// The learner that is asked about, and those that it is held against.
const OURS: &str = "mackrl-ppo";
const OTHERS: [&str; 2] = ["mappo", "ippo"];

/// The comparison.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Report {
    /// Where the runs come from: one entry for each experiment.
    pub(super) provenance: Vec<Provenance>,
    /// Runs that are finished, and all runs of the plan.
    pub(super) finished: usize,
    pub(super) planned: usize,
    /// Learners on maps, in the order of the plan.
    pub(super) rows: Vec<Row>,
    pub(super) claims: Vec<Claim>,
}

/// A learner on a map.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Row {
    pub(super) map: String,
    pub(super) learner: String,
    pub(super) runs: usize,
    pub(super) planned: usize,
    /// Environment steps of a run.
    pub(super) steps_env: u64,
    /// What the runs show, if any is finished.
    pub(super) found: Option<Found>,
}

/// What the runs of a learner on a map show.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Found {
    /// Share of battles won in the last tenth of a run's tests: mean over runs and its standard error.
    pub(super) won: f64,
    pub(super) won_error: f64,
    /// The interquartile mean of the same, with its interval.
    pub(super) iqm: Interval,
    /// When the levels were first reached.
    pub(super) steps_to: Vec<Crossings>,
    /// What the best weights of each run win in battles that neither training nor tests have seen, in the mean over runs.
    pub(super) best: Option<f64>,
    /// Minutes of a run on one thread, in the mean.
    pub(super) minutes: f64,
    /// Environment steps of the tests, and what was won there: mean over runs with standard error.
    pub(super) steps: Vec<u64>,
    pub(super) curve: Vec<(f64, f64)>,
}

impl Report {
    pub(super) fn new(cells: &[Cell]) -> Self {
        let runs = cells.iter().flat_map(|cell| &cell.runs);
        let runs: Vec<TrainingRun> = runs.map(|kept| kept.run.clone()).collect();
        Self {
            provenance: TrainingRun::provenance_of(&runs),
            finished: runs.len(),
            planned: cells.iter().map(|cell| cell.planned).sum(),
            rows: cells.iter().map(Row::new).collect(),
            claims: claims(cells),
        }
    }
}

impl Row {
    fn new(cell: &Cell) -> Self {
        Self {
            map: cell.map.clone(),
            learner: cell.learner.clone(),
            runs: cell.runs.len(),
            planned: cell.planned,
            steps_env: cell.steps_env,
            found: (!cell.runs.is_empty()).then(|| Found::new(cell)),
        }
    }
}

impl Found {
    fn new(cell: &Cell) -> Self {
        let last = ends(cell);
        let (won, won_error) = mean_and_standard_error(&last);
        let tests = cell.runs.iter().map(|kept| kept.run.battle_won.len()).min();
        let due = |test: usize| (test as u64 * cell.interval).min(cell.steps_env);
        let steps: Vec<u64> = (0..tests.unwrap_or(0)).map(due).collect();
        let at = |test: usize| -> Vec<f64> {
            let runs = cell.runs.iter();
            runs.map(|kept| kept.run.battle_won[test]).collect()
        };
        let curve_of = |kept: &Kept| -> Vec<[f64; 2]> {
            let won = kept.run.battle_won.iter();
            steps
                .iter()
                .zip(won)
                .map(|(&step, &won)| [step as f64, won])
                .collect()
        };
        let curves: Vec<Vec<[f64; 2]>> = cell.runs.iter().map(curve_of).collect();
        let best = |kept: &Kept| {
            kept.beside
                .teams
                .as_ref()?
                .best
                .as_ref()
                .map(|score: &Score| score.mean)
        };
        let best: Option<Vec<f64>> = cell.runs.iter().map(best).collect();
        let minutes = cell.runs.iter().map(|kept| kept.beside.wall_s / 60.0);
        Self {
            won,
            won_error,
            iqm: Bootstrap::default().interval(std::slice::from_ref(&last), |tasks| {
                Aggregate::InterquartileMean.of(tasks)
            }),
            steps_to: LEVELS.map(|level| Crossings::of(&curves, level)).into(),
            best: best.map(|shares| mean(&shares)),
            minutes: mean(&minutes.collect::<Vec<_>>()),
            curve: (0..steps.len())
                .map(|test| mean_and_standard_error(&at(test)))
                .collect(),
            steps,
        }
    }
}

/// What each run wins at its end: the mean of the last tenth of its tests.
fn ends(cell: &Cell) -> Vec<f64> {
    let runs = cell.runs.iter();
    runs.map(|kept| final_mean(&kept.run.battle_won)).collect()
}

/// What each run wins in the mean over all its tests: how fast it learns, and where to.
fn areas(cell: &Cell) -> Vec<f64> {
    cell.runs
        .iter()
        .map(|kept| mean(&kept.run.battle_won))
        .collect()
}

/// Two learners on the maps on which both have enough runs.
struct Duel<'a> {
    other: &'static str,
    maps: Vec<(&'a str, [&'a Cell; 2])>,
    /// Maps on which there are too few.
    lacking: Vec<&'a str>,
}

impl<'a> Duel<'a> {
    fn new(other: &'static str, cells: &'a [Cell]) -> Self {
        let (mut maps, mut lacking) = (Vec::new(), Vec::new());
        for ours in cells.iter().filter(|cell| cell.learner == OURS) {
            let is_other = |cell: &&Cell| cell.map == ours.map && cell.learner == other;
            let Some(theirs) = cells.iter().find(is_other) else {
                continue;
            };
            match [ours, theirs]
                .iter()
                .all(|cell| cell.runs.len() >= RUNS_LEAST)
            {
                true => maps.push((&*ours.map, [ours, theirs])),
                false => lacking.push(&*ours.map),
            }
        }
        Self {
            other,
            maps,
            lacking,
        }
    }

    /// The differences by a score, map by map, in words, and those on which the first is ahead and behind.
    fn differences(&self, score: fn(&Cell) -> Vec<f64>) -> (String, Vec<&'a str>, Vec<&'a str>) {
        let (mut words, mut ahead, mut behind) = (Vec::new(), Vec::new(), Vec::new());
        for (map, [ours, theirs]) in &self.maps {
            let difference = Difference::between(&score(ours), &score(theirs));
            words.push(format!("{map} {difference}"));
            if difference.is_ahead() {
                ahead.push(*map);
            }
            if Difference::between(&score(theirs), &score(ours)).is_ahead() {
                behind.push(*map);
            }
        }
        (words.join(", "), ahead, behind)
    }
}

/// What is claimed of the two learners of a duel.
struct Statement {
    /// Between the two names.
    words: &'static str,
    /// On how many maps.
    maps: &'static str,
    measured: &'static str,
    score: fn(&Cell) -> Vec<f64>,
    /// The rule, for the number of maps on which the first is ahead and behind.
    holds: fn(usize, usize) -> bool,
}

const STATEMENTS: [Statement; 3] = [
    Statement {
        words: "ends at least level with",
        maps: "every map",
        measured: "Battles won at the end",
        score: ends,
        holds: |_, behind| behind == 0,
    },
    Statement {
        words: "ends ahead of",
        maps: "at least one map",
        measured: "Battles won at the end",
        score: ends,
        holds: |ahead, _| ahead > 0,
    },
    Statement {
        words: "learns at least as fast as",
        maps: "every map",
        measured: "Battles won in the mean over all tests",
        score: areas,
        holds: |_, behind| behind == 0,
    },
];

/// The verdicts.
fn claims(cells: &[Cell]) -> Vec<Claim> {
    let mut claims = Vec::new();
    let named = |maps: &[&str]| match maps {
        [] => "none".to_owned(),
        maps => maps.join(", "),
    };
    for duel in OTHERS.map(|other| Duel::new(other, cells)) {
        for statement in STATEMENTS {
            let Statement {
                words,
                maps,
                measured,
                score,
                holds,
            } = statement;
            let claim = format!("MACKRL-PPO {words} {} on {maps}", duel.other.to_uppercase());
            if duel.maps.is_empty() || !duel.lacking.is_empty() {
                let there = match &duel.lacking[..] {
                    [] => "the plan has none of one of them".to_owned(),
                    lacking => format!("there are fewer on {}", lacking.join(", ")),
                };
                claims.push(Claim {
                    claim,
                    source: ClaimSource::Reproduction,
                    verdict: Verdict::NotTested,
                    evidence: format!("Needs {RUNS_LEAST} runs of each on every map; {there}."),
                });
                continue;
            }
            let (differences, ahead, behind) = duel.differences(score);
            claims.push(Claim {
                claim,
                source: ClaimSource::Reproduction,
                verdict: Verdict::of(holds(ahead.len(), behind.len())),
                evidence: format!(
                    "{measured}, difference: {differences}; ahead on {}, behind on {}, where the 95 % interval does not reach 0.",
                    named(&ahead),
                    named(&behind)
                ),
            });
        }
    }
    claims
}

#[cfg(test)]
mod tests {
    use mackrl_run::config::Config;

    use super::{super::runs::Beside, *};

    /// A learner on a map, with a run for each share of battles that it wins at its end.
    fn cell(map: &str, learner: &str, ends: &[f64]) -> Cell {
        let kept = |&end: &f64| Kept {
            run: TrainingRun::new(&Config::default(), vec![0.0, end / 2.0, end], Vec::new()),
            beside: Beside {
                wall_s: 90.0,
                teams: None,
            },
        };
        Cell {
            map: map.to_owned(),
            learner: learner.to_owned(),
            planned: 5,
            steps_env: 200,
            interval: 100,
            runs: ends.iter().map(kept).collect(),
        }
    }

    #[test]
    fn a_row_has_the_numbers_of_its_runs() {
        let report = Report::new(&[cell("3m", "mappo", &[0.8, 1.0]), cell("3m", "ippo", &[])]);
        assert_eq!((report.finished, report.planned), (2, 10));
        let found = report.rows[0].found.as_ref().unwrap();
        assert!((found.won - 0.9).abs() < 1e-12 && (found.won_error - 0.1).abs() < 1e-12);
        assert_eq!(found.steps, [0, 100, 200]);
        assert_eq!(found.steps_to[0].reached, 2);
        assert_eq!(found.steps_to[1].reached, 1);
        assert_eq!((found.minutes, found.best), (1.5, None));
        assert!(report.rows[1].found.is_none());
    }

    #[test]
    fn claims_are_judged_when_there_are_runs_enough() {
        let (low, high) = ([0.5, 0.51, 0.52], [0.9, 0.91, 0.92]);
        let cells = |ours: &[f64]| {
            vec![
                cell("3m", "mackrl-ppo", ours),
                cell("3m", "mappo", &low),
                cell("3m", "ippo", &high),
            ]
        };
        let verdicts = |ours: &[f64]| -> Vec<bool> {
            let report = Report::new(&cells(ours));
            (report.claims.iter())
                .map(|claim| claim.verdict == Verdict::Holds)
                .collect()
        };
        assert_eq!(verdicts(&low), [true, false, true, false, false, false]);
        assert_eq!(verdicts(&high), [true, true, true, true, false, true]);
        let few = Report::new(&cells(&low[..2]));
        assert_eq!(few.claims.len(), 6);
        for claim in &few.claims {
            assert_eq!(claim.verdict, Verdict::NotTested, "{}", claim.claim);
            assert!(
                claim.evidence.ends_with("there are fewer on 3m."),
                "{claim:?}"
            );
        }
    }
}
