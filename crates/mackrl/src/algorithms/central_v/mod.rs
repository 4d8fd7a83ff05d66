//! Central-V: the agent controllers alone, under the same central critic as MACKRL.

use mackrl_env::{
    EnvironmentSpec,
    settings::{Setting, Settings, SettingsError},
};

use crate::algorithms::{ActorCriticSettings, AlgorithmKind};

/// The kind `central-v`. All its settings are those of [`ActorCriticSettings`].
#[derive(Debug, Clone, Copy, Default)]
pub struct CentralV;

impl AlgorithmKind for CentralV {
    fn name(&self) -> &'static str {
        "central-v"
    }

    fn summary(&self) -> &'static str {
        "Central-V: the agent controllers alone, with the same central critic."
    }

    fn settings(&self) -> Vec<Setting> {
        ActorCriticSettings::SETTINGS.to_vec()
    }

    fn defaults(&self) -> toml::Table {
        ActorCriticSettings::defaults()
    }

    fn check(
        &self,
        table: &toml::Table,
        _spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError> {
        ActorCriticSettings::read(table)?.check()?;
        Ok(table.clone())
    }
}
