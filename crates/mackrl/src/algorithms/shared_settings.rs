//! What settings of several algorithms mean: which optimiser, how exploration falls, and two sections that stand in one table.

use mackrl_env::{
    declare_words,
    settings::{Setting, Settings, SettingsError, Violation, WrongSetting},
};
use serde::{Deserialize, Serialize};

use crate::nn::OptimiserKind;

declare_words! {
    /// How parameters follow the gradient.
    pub enum OptimiserName {
        /// Adam (Kingma and Ba, 2015), as the paper says.
        #[default]
        Adam = "adam",
        /// `RMSprop`, as the authors' code.
        Rmsprop = "rmsprop",
    }
}

/// ε over training: linear from `start` to `finish` over the first `steps_env` environment steps, constant afterwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Exploration {
    pub(super) start: f64,
    pub(super) finish: f64,
    pub(super) steps_env: u64,
}

/// A section without a setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoSettings {}

impl Settings for NoSettings {
    const DECLARED: &'static [Setting] = &[];

    fn first_violation(&self) -> Option<Violation> {
        None
    }
}

impl OptimiserName {
    /// With these constants; Adam's β are the usual ones, and `smoothing` is `RMSprop`'s alone.
    pub(super) const fn with(self, epsilon: f64, smoothing: f64) -> OptimiserKind {
        match self {
            Self::Adam => OptimiserKind::Adam {
                beta1: 0.9,
                beta2: 0.999,
                epsilon,
            },
            Self::Rmsprop => OptimiserKind::RmsProp { smoothing, epsilon },
        }
    }
}

impl Exploration {
    /// ε after so many environment steps.
    pub(super) fn at(&self, steps_env: u64) -> f64 {
        let progress = (steps_env as f64 / self.steps_env as f64).min(1.0);
        self.start + (self.finish - self.start) * progress
    }

    /// Checks that it does not rise.
    ///
    /// # Errors
    /// [`SettingsError::AtOdds`] if it does.
    pub(super) fn check(&self) -> Result<(), SettingsError> {
        if self.finish <= self.start {
            return Ok(());
        }
        Err(at_odds(
            ("exploration_finish", format!("{:?}", self.finish)),
            ("exploration_start", format!("{:?}", self.start)),
        ))
    }
}

/// That the first setting is larger than the second.
pub(super) fn at_odds(
    (larger, found): (&str, String),
    (smaller, other): (&str, String),
) -> SettingsError {
    let wrong = |name: &str, found: &str, expected| WrongSetting {
        name: name.to_owned(),
        found: found.to_owned(),
        expected,
        nearest: None,
    };
    let most = format!("at most {other}, which is algorithm.{smaller}");
    let least = format!("at least {found}, which is algorithm.{larger}");
    SettingsError::AtOdds(Box::new([
        wrong(larger, &found, most),
        wrong(smaller, &other, least),
    ]))
}

/// Reads two sections from one table; what the first does not declare is the second's.
///
/// # Errors
/// As [`Settings::read`].
pub(super) fn read_both<A: Settings, B: Settings>(
    table: &toml::Table,
) -> Result<(A, B), SettingsError> {
    let (first, second): (toml::Table, toml::Table) = table
        .iter()
        .map(|(name, value)| (name.clone(), value.clone()))
        .partition(|(name, _)| A::DECLARED.iter().any(|setting| setting.name == name));
    Ok((A::read(&first)?, B::read(&second)?))
}

/// The built-in values of two sections in one table.
pub(super) fn defaults_of_both<A: Settings, B: Settings>() -> toml::Table {
    let mut defaults = A::defaults();
    defaults.extend(B::defaults());
    defaults
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exploration_falls_linearly_and_then_stays() {
        let exploration = Exploration {
            start: 0.5,
            finish: 0.01,
            steps_env: 50_000,
        };
        for (steps, expected) in [(0, 0.5), (25_000, 0.255), (50_000, 0.01), (1_000_000, 0.01)] {
            let found = exploration.at(steps);
            assert!((found - expected).abs() < 1e-12, "{steps}: {found}");
        }
    }

    #[test]
    fn optimisers_have_the_usual_constants_unless_others_are_asked_for() {
        assert_eq!(OptimiserName::Adam.with(1e-8, 0.0), OptimiserKind::ADAM);
        let usual = OptimiserName::Rmsprop.with(1e-8, 0.99);
        assert_eq!(usual, OptimiserKind::RMSPROP);
        let expected = OptimiserKind::RmsProp {
            smoothing: 0.9,
            epsilon: 1e-5,
        };
        assert_eq!(OptimiserName::Rmsprop.with(1e-5, 0.9), expected);
    }
}
