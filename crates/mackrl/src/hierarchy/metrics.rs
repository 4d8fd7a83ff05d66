//! What is reported of a hierarchy's controllers, explained: names that learners of all kinds share.

use super::Parts;
use crate::policy::Level;

/// Of groups that may act jointly or delegate.
const DELEGATION: [(&str, &str); 5] = [
    (
        "mackrl/delegation_rate",
        "share of chosen pairs with common knowledge that delegated",
    ),
    (
        "mackrl/delegation_rate_ck_enemies_",
        "the same, for pairs that commonly know this many enemies (Figure 7)",
    ),
    (
        "mackrl/delegation_cases_ck_enemies_",
        "share of chosen pairs with common knowledge that commonly know this many enemies",
    ),
    (
        "mackrl/common_knowledge_rate",
        "share of chosen pairs of living agents with common knowledge",
    ),
    (
        "mackrl/ck_entities_mean",
        "entities that a chosen pair of living agents commonly knows",
    ),
];

/// What is reported of each level that learns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OfLevel {
    Entropy,
    EntropyShare,
    Saturation,
    LogitVariation,
    LogitSpread,
}

impl OfLevel {
    const ALL: [Self; 5] = [
        Self::Entropy,
        Self::EntropyShare,
        Self::Saturation,
        Self::LogitVariation,
        Self::LogitSpread,
    ];

    /// Its name for `level`.
    pub(super) fn name(self, level: &Level) -> String {
        let quantity = match self {
            Self::Entropy => "mackrl/entropy",
            Self::EntropyShare => "entropy_share",
            Self::Saturation => "saturation",
            Self::LogitVariation => "logit_variation",
            Self::LogitSpread => "logit_spread",
        };
        format!("{quantity}_{}", level.name)
    }

    const fn meaning(self) -> &'static str {
        match self {
            Self::Entropy => {
                "entropy of a choice in nats, of chosen groups of living agents that have one"
            }
            Self::EntropyShare => {
                "the same entropy divided by the greatest that the mask allows, where there are two choices or more: 1 is uniform, 0 certain"
            }
            Self::Saturation => {
                "share of recurrent units with |h| > .99, in training: such units pass nothing on"
            }
            Self::LogitVariation => {
                "standard deviation of a logit over situations, mean over choices, in training: 0 if the input is not read"
            }
            Self::LogitSpread => {
                "standard deviation of a situation's logits over choices, mean over situations, in training: far above logit_variation, one choice is taken whatever is read"
            }
        }
    }
}

impl Parts {
    /// Names (or the parts before a number) and meanings of what is reported.
    pub(super) fn metrics(&self) -> Vec<(String, String)> {
        let levels = self.declaration.levels().iter();
        let learned = levels.clone().filter(|level| level.is_learned());
        let of_level = |level| {
            OfLevel::ALL.map(|quantity| {
                let meaning = format!("{}: {}", spoken(level), quantity.meaning());
                (quantity.name(level), meaning)
            })
        };
        let mut metrics: Vec<(String, String)> = learned.flat_map(of_level).collect();
        if levels.clone().any(Level::delegates) {
            metrics.extend(DELEGATION.map(|(name, meaning)| (name.to_owned(), meaning.to_owned())));
        }
        metrics
    }
}

/// "pair controller"
fn spoken(level: &Level) -> String {
    level.name.replace('_', " ")
}
