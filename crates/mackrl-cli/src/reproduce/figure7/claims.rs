//! What the paper says about Figure 7, each with the rule by which it is judged.

use super::Moment;
use crate::reproduce::{Claim, ClaimSource};

/// "Rarely".
const RARELY: f64 = 0.1;
/// "Most situations".
const MOSTLY: f64 = 0.5;
/// What the pair controller does almost never.
const ALMOST_NEVER: f64 = 0.05;

/// Judges every claim.
pub(super) fn claims(moments: &[Moment]) -> Vec<Claim> {
    let (Some(first), Some(last)) = (moments.first(), moments.last()) else {
        return Vec::new();
    };
    let judged = |claim: &str,
                  moment: &Moment,
                  enemies: &[usize],
                  holds: fn(f64) -> bool,
                  rule: &str| {
        let rates: Vec<Option<f64>> = enemies.iter().map(|&e| moment.rates[e].mean).collect();
        let shown =
            |rate: &Option<f64>| rate.map_or_else(|| "–".to_owned(), |rate| format!("{rate:.3}"));
        let numbers: Vec<String> = rates.iter().map(shown).collect();
        let published: Vec<String> = enemies
            .iter()
            .map(|&e| format!("{:.3}", moment.published[e]))
            .collect();
        Claim {
            claim: claim.into(),
            source: ClaimSource::Paper,
            holds: rates.iter().all(|rate| rate.is_some_and(holds)),
            evidence: format!(
                "With {enemies:?} commonly known enemies, {}: {}; the rule asks for {rule}. Published: {}.",
                moment.when(),
                numbers.join(", "),
                published.join(", ")
            ),
        }
    };
    vec![
        judged(
            "At the beginning of training, the pair controller delegates only rarely",
            first,
            &[0, 1, 2, 3, 4, 5],
            |rate| rate < RARELY,
            "less than 0.1 of each",
        ),
        judged(
            "Later it delegates in most situations in which few enemies are commonly known",
            last,
            &[1, 2],
            |rate| rate >= MOSTLY,
            "at least 0.5 of each",
        ),
        judged(
            "Later it coordinates where common knowledge is substantial",
            last,
            &[4, 5],
            |rate| rate < ALMOST_NEVER,
            "less than 0.05 of each",
        ),
    ]
}
