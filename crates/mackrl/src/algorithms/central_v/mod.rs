//! Central-V: the agent controllers alone, under the same central critic as MACKRL.

use mackrl_env::{
    EnvironmentSpec,
    settings::{Setting, Settings, SettingsError},
};

use crate::{
    Error,
    algorithms::{ActorCritic, ActorCriticSettings, Algorithm, AlgorithmKind, Team},
    common_knowledge::CommonKnowledgeFeatures,
    hierarchy::Hierarchy,
    policy::Declaration,
};

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

    fn build(&self, table: &toml::Table, team: Team<'_>) -> Result<Box<dyn Algorithm>, Error> {
        let (hierarchy, settings) = parts(table, team)?;
        Ok(Box::new(ActorCritic::new(hierarchy, settings, team)))
    }

    fn size(&self, table: &toml::Table, team: Team<'_>) -> Result<usize, Error> {
        let (hierarchy, settings) = parts(table, team)?;
        Ok(ActorCritic::size(&hierarchy, &settings, team))
    }
}

/// The hierarchy without upper levels, and how it learns.
fn parts(table: &toml::Table, team: Team<'_>) -> Result<(Hierarchy, ActorCriticSettings), Error> {
    let settings = ActorCriticSettings::read(table).map_err(Error::setting)?;
    let declaration = Declaration::agents_alone([team.spec.agents, team.spec.actions]);
    // No group reads common knowledge.
    let features = CommonKnowledgeFeatures::default();
    let hierarchy = team.hierarchy(declaration, features, settings.hidden);
    Ok((hierarchy, settings))
}
