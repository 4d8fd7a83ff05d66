//! What the ablations have to show if everything is as it should be.

use crate::reproduce::{Claim, ClaimSource, learning::Difference};

/// Judges every claim, from the final win rates of the runs.
pub(super) fn claims(always_delegate: &[f64], central_v: &[f64]) -> Vec<Claim> {
    let difference = Difference::between(always_delegate, central_v);
    vec![Claim {
        claim: "A team that always delegates learns as Central-V does".into(),
        source: ClaimSource::Reproduction,
        holds: difference.mean.abs() <= 2.0 * difference.error,
        evidence: format!(
            "Mean of the last tenth of the tests, always delegate − Central-V: {difference}; equal means by less than 2 standard \
             errors. Both start from weights of their own, so single runs differ."
        ),
    }]
}
