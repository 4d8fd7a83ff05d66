//! What a comparison claims, and the rules by which that is judged.

use mackrl::statistics::mean;
use mackrl_run::recorded::final_mean;

use super::runs::Cell;
use crate::reproduce::{Claim, ClaimSource, Verdict, learning::Difference};

/// Tests that are averaged where a score is that of a moment: one test says little.
const TESTS_OF_A_MOMENT: usize = 5;

/// A claim about two learners before it is judged.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Statement {
    /// What is claimed.
    pub(crate) claim: &'static str,
    /// Who claims it.
    pub(crate) source: ClaimSource,
    /// The two learners.
    pub(crate) pair: [&'static str; 2],
    /// On which maps.
    pub(crate) maps: Maps,
    /// What is compared.
    pub(crate) score: Score,
    /// When it holds on a map.
    pub(crate) rule: Rule,
    /// Runs of each learner from which on it is judged: at least 2.
    pub(crate) runs_least: usize,
    /// Environment steps that these runs need to have.
    pub(crate) steps_env_least: u64,
}

/// On which maps a claim has to hold.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Maps {
    /// On each that the plan has.
    Every,
    /// On one of them at least.
    Some,
    /// On this one.
    On(&'static str),
}

/// One number for a run: shares of battles won in greedy tests.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Score {
    /// In the last tenth of the tests.
    End,
    /// In the mean over all tests: how fast it learns, and where to.
    All,
    /// After so many environment steps: in the tests about then.
    At(u64),
}

/// When a claim holds on a map; differences are of means over runs, with 95 % intervals by Student's t (Welch).
#[derive(Debug, Clone, Copy)]
pub(crate) enum Rule {
    /// The interval of the difference lies above so much.
    AheadBy(f64),
    /// It does not lie below 0.
    NotBehind,
}

impl Score {
    /// The score of each run that has one.
    pub(super) fn of_all(self, cell: &Cell) -> Vec<f64> {
        let runs = cell.runs.iter();
        runs.filter_map(|kept| self.of(cell, &kept.run.battle_won))
            .collect()
    }

    fn of(self, cell: &Cell, won: &[f64]) -> Option<f64> {
        match self {
            Self::End => Some(final_mean(won)),
            Self::All => Some(mean(won)),
            Self::At(steps_env) => {
                let test = usize::try_from(steps_env / cell.interval.max(1)).ok()?;
                won.get(test)?;
                // Those about the moment, or the last ones where the run ends with it.
                let end = (test + TESTS_OF_A_MOMENT / 2 + 1).min(won.len());
                Some(mean(&won[end.saturating_sub(TESTS_OF_A_MOMENT)..end]))
            }
        }
    }

    fn name(self) -> String {
        match self {
            Self::End => "Battles won at the end".to_owned(),
            Self::All => "Battles won in the mean over all tests".to_owned(),
            Self::At(steps_env) => format!("Battles won after {} k steps", steps_env / 1000),
        }
    }
}

/// The two learners of a statement on a map, and their difference.
struct Compared<'a> {
    map: &'a str,
    difference: Difference,
}

impl Statement {
    /// The verdict.
    pub(super) fn judge(&self, cells: &[Cell]) -> Claim {
        let (mut compared, mut lacking) = (Vec::new(), Vec::new());
        let [first, second] = self.pair;
        for ours in cells.iter().filter(|cell| cell.learner == first) {
            let is_other = |cell: &&Cell| cell.map == ours.map && cell.learner == second;
            let is_meant = !matches!(self.maps, Maps::On(map) if map != ours.map);
            let Some(theirs) = cells.iter().find(is_other).filter(|_| is_meant) else {
                continue;
            };
            match [ours, theirs].map(|cell| self.scores(cell)) {
                [Some(ours_scores), Some(theirs_scores)] => compared.push(Compared {
                    map: &ours.map,
                    difference: Difference::between(&ours_scores, &theirs_scores),
                }),
                _ => lacking.push(&*ours.map),
            }
        }
        if compared.is_empty() || !lacking.is_empty() {
            return self.claim(Verdict::NotTested, self.needs(&lacking));
        }
        let mut holding = compared.iter().map(|one| self.rule.holds(one.difference));
        let holds = match self.maps {
            Maps::Some => holding.any(|holds| holds),
            Maps::Every | Maps::On(_) => holding.all(|holds| holds),
        };
        self.claim(Verdict::of(holds), self.evidence(&compared))
    }

    fn claim(&self, verdict: Verdict, evidence: String) -> Claim {
        Claim {
            claim: self.claim.to_owned(),
            source: self.source,
            verdict,
            evidence,
        }
    }

    /// The scores of the runs, if there are enough of them and they have enough steps.
    fn scores(&self, cell: &Cell) -> Option<Vec<f64>> {
        let scores = self.score.of_all(cell);
        let enough = scores.len() >= self.runs_least && cell.steps_env >= self.steps_env_least;
        enough.then_some(scores)
    }

    /// What the claim needs, on these maps, to be judged.
    fn needs(&self, lacking: &[&str]) -> String {
        let Self {
            pair: [first, second],
            runs_least,
            steps_env_least,
            ..
        } = self;
        let steps = match steps_env_least {
            0 => String::new(),
            steps => format!(" of {steps} steps"),
        };
        let on = match (self.maps, lacking) {
            (Maps::On(map), _) => map.to_owned(),
            (_, []) => "a map".to_owned(),
            (_, maps) => maps.join(", "),
        };
        format!("Needs {runs_least} runs{steps} of each of {first} and {second} on {on}.")
    }

    fn evidence(&self, compared: &[Compared<'_>]) -> String {
        let words = compared
            .iter()
            .map(|one| format!("{} {}", one.map, one.difference));
        let named = |is: fn(Difference) -> bool| {
            let maps = compared.iter().filter(|one| is(one.difference));
            let maps: Vec<&str> = maps.map(|one| one.map).collect();
            match maps[..] {
                [] => "none".to_owned(),
                _ => maps.join(", "),
            }
        };
        let rule = match self.rule {
            Rule::AheadBy(by) if by > 0.0 => {
                format!(" The rule asks for an interval above {by}.")
            }
            _ => String::new(),
        };
        format!(
            "{}, difference: {}; ahead on {}, behind on {}, where the 95 % interval does not reach 0.{rule}",
            self.score.name(),
            words.collect::<Vec<_>>().join(", "),
            named(Difference::is_ahead),
            named(Difference::is_behind),
        )
    }
}

impl Rule {
    fn holds(self, difference: Difference) -> bool {
        match self {
            Self::AheadBy(by) => difference.interval()[0] > by,
            Self::NotBehind => !difference.is_behind(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::runs::tests::{cell, cell_of},
        *,
    };

    const AHEAD: Statement = Statement {
        claim: "the first ends ahead",
        source: ClaimSource::Reproduction,
        pair: ["mackrl-ppo", "mappo"],
        maps: Maps::Every,
        score: Score::End,
        rule: Rule::AheadBy(0.0),
        runs_least: 3,
        steps_env_least: 200,
    };
    const LOW: [f64; 3] = [0.5, 0.51, 0.52];
    const HIGH: [f64; 3] = [0.9, 0.91, 0.92];

    /// The verdict if the first learner's runs end like this on two maps, and the second's low.
    fn verdict(statement: Statement, first: [&[f64]; 2]) -> Option<bool> {
        let cells: Vec<Cell> = ["3m", "8m"]
            .into_iter()
            .zip(first)
            .flat_map(|(map, ends)| [cell(map, "mackrl-ppo", ends), cell(map, "mappo", &LOW)])
            .collect();
        match statement.judge(&cells).verdict {
            Verdict::Holds => Some(true),
            Verdict::DoesNotHold => Some(false),
            Verdict::NotTested => None,
        }
    }

    #[test]
    fn a_claim_holds_on_the_maps_that_it_speaks_of() {
        let on = |maps| Statement { maps, ..AHEAD };
        for (maps, holds) in [
            (Maps::Every, false),
            (Maps::Some, true),
            (Maps::On("3m"), true),
            (Maps::On("8m"), false),
        ] {
            assert_eq!(verdict(on(maps), [&HIGH, &LOW]), Some(holds), "{maps:?}");
        }
    }

    #[test]
    fn a_rule_asks_for_an_interval_beyond_its_margin() {
        let rule = |rule| Statement { rule, ..AHEAD };
        assert_eq!(verdict(rule(Rule::AheadBy(0.3)), [&HIGH; 2]), Some(true));
        assert_eq!(verdict(rule(Rule::AheadBy(0.39)), [&HIGH; 2]), Some(false));
        assert_eq!(verdict(rule(Rule::NotBehind), [&LOW; 2]), Some(true));
        let low = [0.1, 0.11, 0.12];
        assert_eq!(verdict(rule(Rule::NotBehind), [&low; 2]), Some(false));
    }

    #[test]
    fn what_lacks_runs_or_steps_is_not_judged() {
        assert_eq!(verdict(AHEAD, [&HIGH, &HIGH[..2]]), None);
        let longer = Statement {
            steps_env_least: 201,
            ..AHEAD
        };
        assert_eq!(verdict(longer, [&HIGH; 2]), None);
        let needs = longer.judge(&[cell("3m", "mackrl-ppo", &HIGH), cell("3m", "mappo", &HIGH)]);
        assert_eq!(
            needs.evidence,
            "Needs 3 runs of 201 steps of each of mackrl-ppo and mappo on 3m."
        );
        assert_eq!(AHEAD.judge(&[]).verdict, Verdict::NotTested);
    }

    #[test]
    fn a_moment_is_the_mean_of_the_tests_about_it() {
        let won: Vec<f64> = (0..=20).map(f64::from).collect();
        let cell = cell_of("3m", "mappo", vec![won]);
        let at = |steps| Score::At(steps).of_all(&cell);
        assert_eq!(at(1000), [10.0]);
        // The last five tests, and the first three.
        assert_eq!(at(2000), [18.0]);
        assert_eq!(at(0), [1.0]);
        assert_eq!(at(2100), [0.0; 0]);
    }
}
