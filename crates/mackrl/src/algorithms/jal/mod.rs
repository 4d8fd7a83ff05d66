//! JAL on common knowledge alone: one controller takes the joint action of the whole team and reads what the team commonly knows, under
//! the same central critic as MACKRL.
//!
//! It is decentralised only because every member computes the same: the team has to have common knowledge of itself at every step. No
//! world promises that, so it is looked at: every step is checked while the team acts, in training and in tests, and the run ends with
//! an error that names the step at which living members do not all see each other. The dead see nothing and take no part: who is out of
//! sight is dead, and everybody knows it. Their action is 0, as in SMAC.
//!
//! Worlds for it are those without distance: the matrix game with `env.common_knowledge = 1`, battles whose `env.sight_range` covers
//! the map. The controller has an output for each of the Aᴺ joint actions, at most [`Declaration::JOINT_ACTIONS_MAX`]: three marines
//! against three have 729.

use mackrl_env::{
    EnvironmentSpec, declare_settings,
    settings::{Setting, SettingsError, WrongSetting},
};

use crate::{
    Error,
    algorithms::{
        ActorCritic, ActorCriticSettings, Algorithm, AlgorithmKind, Team,
        shared_settings::{defaults_of_both, read_both},
    },
    common_knowledge::CommonKnowledgeFeatures,
    hierarchy::Hierarchy,
    policy::Declaration,
};

declare_settings! {
    /// What the controller of the team reads.
    pub struct JalSettings {
        /// Which features of commonly known entities the controllers read: all of them, or those of the authors' code.
        common_knowledge: CommonKnowledgeFeatures = CommonKnowledgeFeatures::Complete, CommonKnowledgeFeatures::ACCEPTS;
    }
}

/// The kind `jal`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Jal;

impl Jal {
    /// The settings of the controller and of its learning, which stand side by side in one table.
    ///
    /// # Errors
    /// As [`Settings::read`](mackrl_env::settings::Settings::read).
    pub fn read(table: &toml::Table) -> Result<(JalSettings, ActorCriticSettings), SettingsError> {
        read_both(table)
    }
}

impl AlgorithmKind for Jal {
    fn name(&self) -> &'static str {
        "jal"
    }

    fn summary(&self) -> &'static str {
        "JAL: one controller of the whole team, on what the team commonly knows; for worlds in which all living members always see each other."
    }

    fn settings(&self) -> Vec<Setting> {
        [JalSettings::SETTINGS, ActorCriticSettings::SETTINGS].concat()
    }

    fn defaults(&self) -> toml::Table {
        defaults_of_both::<JalSettings, ActorCriticSettings>()
    }

    fn check(
        &self,
        table: &toml::Table,
        spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError> {
        let (_, learning) = Self::read(table)?;
        learning.check()?;
        let EnvironmentSpec {
            name,
            agents,
            actions,
            ..
        } = spec;
        if Declaration::joint_actions([*agents, *actions]).is_some() {
            return Ok(table.clone());
        }
        let most = Declaration::JOINT_ACTIONS_MAX;
        Err(SettingsError::Wrong(WrongSetting {
            name: "name".to_owned(),
            found: "\"jal\"".to_owned(),
            expected: format!(
                "another algorithm for the {agents} agents of {name}: with {actions} actions each they have {actions}^{agents} joint actions, and one controller takes at most {most}"
            ),
            nearest: None,
        }))
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

/// The hierarchy of one controller, and how it learns.
fn parts(table: &toml::Table, team: Team<'_>) -> Result<(Hierarchy, ActorCriticSettings), Error> {
    let (settings, learning) = Jal::read(table).map_err(Error::setting)?;
    let declaration = Declaration::whole_team([team.spec.agents, team.spec.actions])?;
    let hierarchy = team.hierarchy(declaration, settings.common_knowledge, learning.hidden);
    Ok((hierarchy, learning))
}
