//! The simulator beside the game, row by row.

use serde::Serialize;

use crate::fidelity::{Policy, Quantity, Reference, References, Sample};

/// One quantity in both, and whether they agree.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Number of the check, as `check-5`.
    pub name: String,
    /// The map.
    pub map: String,
    /// Who played; none for trained teams, which are not judged here.
    pub policy: Option<Policy>,
    /// What was measured.
    pub quantity: Quantity,
    /// Its value in the real game.
    pub real: f64,
    /// Standard error of that value, where the logs tell.
    pub error: Option<f64>,
    /// By how much the simulator may differ.
    pub tolerance: f64,
    /// Its value here; none if it was not measured.
    pub ours: Option<f64>,
    /// Whether the two differ by no more than that; none if it was not measured.
    pub pass: Option<bool>,
    /// Whether rules were chosen by it.
    pub fitted: bool,
    /// Repositories and commits of the logs.
    pub source: String,
}

/// Sets what was played beside the game. Rows of `references` of which no sample was played are open.
#[must_use]
pub fn judge(references: &References, samples: &[Sample]) -> Vec<Finding> {
    let finding = |reference: &Reference| {
        let sample = samples
            .iter()
            .find(|sample| sample.map == reference.map && Some(sample.policy) == reference.policy);
        let ours = sample.and_then(|sample| sample.value(reference.quantity));
        Finding {
            name: format!("check-{}", reference.check),
            map: reference.map.clone(),
            policy: reference.policy,
            quantity: reference.quantity,
            real: reference.real,
            error: reference.error,
            tolerance: reference.tolerance,
            ours,
            pass: ours.map(|ours| (ours - reference.real).abs() <= reference.tolerance),
            fitted: reference.fitted,
            source: references.source_of(&reference.map),
        }
    };
    references.references.iter().map(finding).collect()
}

/// The names of the checks that were measured, in their order, each with whether all of its rows pass.
#[must_use]
pub fn passed(findings: &[Finding]) -> Vec<(String, bool)> {
    let mut checks: Vec<(String, bool)> = Vec::new();
    for finding in findings {
        let Some(pass) = finding.pass else { continue };
        match checks.iter_mut().find(|(name, _)| *name == finding.name) {
            Some((_, all)) => *all &= pass,
            None => checks.push((finding.name.clone(), pass)),
        }
    }
    checks
}
