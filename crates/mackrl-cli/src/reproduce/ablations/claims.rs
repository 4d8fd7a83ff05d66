//! What the ablations have to show if everything is as it should be, and if the paper's explanation is right.

use crate::reproduce::{Claim, ClaimSource, learning::Difference};

/// Final win rates of the runs of the variants that claims are about.
pub(super) struct Finals {
    pub(super) mackrl: Vec<f64>,
    pub(super) central_v: Vec<f64>,
    pub(super) always_delegate: Vec<f64>,
}

/// Judges every claim.
pub(super) fn claims(finals: &Finals) -> Vec<Claim> {
    let idle = Difference::between(&finals.always_delegate, &finals.central_v);
    let joint = Difference::between(&finals.mackrl, &finals.always_delegate);
    vec![
        Claim {
            claim: "A team that always delegates learns as Central-V does".into(),
            source: ClaimSource::Reproduction,
            holds: idle.mean.abs() <= 2.0 * idle.error,
            evidence: format!(
                "Mean of the last tenth of the tests, always delegate − Central-V: {idle}; equal means by less than 2 standard \
                 errors. Both start from weights of their own, so single runs differ."
            ),
        },
        Claim {
            claim: "The gain comes from acting jointly: a team that always delegates ends lower than MACKRL".into(),
            source: ClaimSource::Reproduction,
            holds: joint.is_ahead(),
            evidence: format!(
                "Mean of the last tenth of the tests, MACKRL − always delegate: {joint}; ahead means by more than 2 standard errors."
            ),
        },
    ]
}
