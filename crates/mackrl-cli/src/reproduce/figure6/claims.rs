//! The paper's claims about Figure 6, each with the rule by which it is judged.

use mackrl::statistics::mean;

use super::MapRuns;
use crate::reproduce::{
    Claim, ClaimSource,
    learning::{Difference, TrainingRun},
};

/// Share of the tests at the end of training whose mean is a run's final win rate.
const FINAL_SHARE: f64 = 0.1;
/// Share of the tests at the beginning of training that "initially" means.
const INITIAL_SHARE: f64 = 0.1;
/// "Above 90 %".
const NEAR_STATE_OF_THE_ART: f64 = 0.9;

/// Judges every claim.
pub(super) fn claims(marines: &MapRuns<'_>, stalkers: &MapRuns<'_>) -> Vec<Claim> {
    vec![
        both_exceed_ninety_percent(marines),
        central_v_is_faster_at_first(marines),
        mackrl_ends_higher("3m", marines),
        mackrl_learns_faster("2s3z", stalkers),
        mackrl_ends_higher("2s3z", stalkers),
    ]
}

fn both_exceed_ninety_percent(runs: &MapRuns<'_>) -> Claim {
    let [mackrl, central_v] = [runs.mackrl, runs.central_v].map(|runs| mean(&finals(runs)));
    Claim {
        claim: "On 3m, both methods win more than 90 % of battles at the end".into(),
        source: ClaimSource::Paper,
        holds: mackrl > NEAR_STATE_OF_THE_ART && central_v > NEAR_STATE_OF_THE_ART,
        evidence: format!(
            "Mean of the last tenth of the tests: MACKRL {mackrl:.3}, Central-V {central_v:.3}. Published: 0.946 and 0.920."
        ),
    }
}

fn central_v_is_faster_at_first(runs: &MapRuns<'_>) -> Claim {
    let difference = Difference::between(&initials(runs.central_v), &initials(runs.mackrl));
    Claim {
        claim: "On 3m, Central-V, with a third of the parameters, initially learns faster".into(),
        source: ClaimSource::Paper,
        holds: difference.is_ahead(),
        evidence: format!(
            "Mean of the first tenth of the tests, Central-V − MACKRL: {difference}; ahead means by more than 2 standard \
             errors. Published at 50 000 steps: 0.73 against 0.63."
        ),
    }
}

fn mackrl_ends_higher(map: &str, runs: &MapRuns<'_>) -> Claim {
    let difference = Difference::between(&finals(runs.mackrl), &finals(runs.central_v));
    let published = match map {
        "3m" => "0.946 against 0.920",
        _ => "0.844 against 0.758",
    };
    Claim {
        claim: format!("On {map}, MACKRL achieves a higher final performance"),
        source: ClaimSource::Paper,
        holds: difference.is_ahead(),
        evidence: format!(
            "Mean of the last tenth of the tests, MACKRL − Central-V: {difference}; ahead means by more than 2 standard \
             errors. Published: {published}."
        ),
    }
}

fn mackrl_learns_faster(map: &str, runs: &MapRuns<'_>) -> Claim {
    let whole = |runs: &[TrainingRun]| {
        runs.iter()
            .map(|run| mean(&run.battle_won))
            .collect::<Vec<_>>()
    };
    let difference = Difference::between(&whole(runs.mackrl), &whole(runs.central_v));
    Claim {
        claim: format!("On {map}, MACKRL learns faster"),
        source: ClaimSource::Paper,
        holds: difference.is_ahead(),
        evidence: format!(
            "Mean over all tests of a run, MACKRL − Central-V: {difference}; ahead means by more than 2 standard errors. \
             Published: half of all battles are won after 207 000 steps, against 1.11 million."
        ),
    }
}

/// Each run's mean over the last tests.
fn finals(runs: &[TrainingRun]) -> Vec<f64> {
    let last = |run: &TrainingRun| {
        let won = &run.battle_won;
        mean(&won[won.len() - some_of(won.len(), FINAL_SHARE)..])
    };
    runs.iter().map(last).collect()
}

/// Each run's mean over the first tests after the one before training.
fn initials(runs: &[TrainingRun]) -> Vec<f64> {
    let first = |run: &TrainingRun| {
        let won = &run.battle_won[1.min(run.battle_won.len() - 1)..];
        mean(&won[..some_of(won.len(), INITIAL_SHARE)])
    };
    runs.iter().map(first).collect()
}

/// A share of `count`, rounded up: at least one.
fn some_of(count: usize, share: f64) -> usize {
    (1..=count)
        .find(|&part| part as f64 >= share * count as f64)
        .unwrap_or(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_is_at_least_one_test() {
        assert_eq!(
            [1, 5, 10, 11, 101].map(|count| some_of(count, 0.1)),
            [1, 1, 1, 2, 11]
        );
    }
}
