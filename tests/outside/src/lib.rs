//! An algorithm that no crate of the project knows: independent agents with linear policies that learn by REINFORCE.
//!
//! It uses what any other crate can use, and neither the hierarchy nor the networks of `mackrl`: an own [`Policy`] with an own
//! [`Actor`] and [`Executor`], an own [`Algorithm`] that learns from an [`Experience`], and an own [`AlgorithmKind`] with
//! settings, help and checkpoints.
//!
//! [`Actor`]: mackrl::policy::Actor
//! [`Executor`]: mackrl::policy::Executor
//! [`Experience`]: mackrl::experience::Experience

mod learner;
mod policy;

use mackrl::{
    Error,
    algorithms::{Algorithm, AlgorithmKind, Team},
    policy::Policy,
};
use mackrl_env::{
    EnvironmentSpec, declare_settings,
    settings::{Accepts, Setting, Settings, SettingsError},
};

pub use learner::Reinforce;
pub use policy::LinearPolicy;

declare_settings! {
    /// How the agents learn.
    pub struct ReinforceSettings {
        /// Step size.
        learning_rate: f64 = 0.5, Accepts::above_within(0.0, 10.0);
        /// Episodes of a batch.
        environments: usize = 32, Accepts::integer(1, 4096);
    }
}

/// The kind `reinforce`.
#[derive(Debug, Clone, Copy, Default)]
pub struct ReinforceKind;

impl AlgorithmKind for ReinforceKind {
    fn name(&self) -> &'static str {
        "reinforce"
    }

    fn summary(&self) -> &'static str {
        "Independent agents with linear policies, which learn by REINFORCE."
    }

    fn settings(&self) -> Vec<Setting> {
        ReinforceSettings::SETTINGS.to_vec()
    }

    fn defaults(&self) -> toml::Table {
        ReinforceSettings::defaults()
    }

    fn check(
        &self,
        table: &toml::Table,
        _spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError> {
        ReinforceSettings::read(table)?;
        Ok(table.clone())
    }

    fn build(&self, table: &toml::Table, team: Team<'_>) -> Result<Box<dyn Algorithm>, Error> {
        let settings =
            ReinforceSettings::read(table).map_err(|error| Error::Config(error.to_string()))?;
        Ok(Box::new(Reinforce::new(settings, team)))
    }

    fn size(&self, _table: &toml::Table, team: Team<'_>) -> Result<usize, Error> {
        Ok(LinearPolicy::new(team.spec).layout().len())
    }
}
