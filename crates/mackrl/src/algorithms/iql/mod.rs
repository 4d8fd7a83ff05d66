//! IQL: each agent learns the value of its own actions, and takes the others for a part of the world (Tan, 1993).

use mackrl_env::{
    EnvironmentSpec, EpisodeKey,
    settings::{Setting, Settings, SettingsError},
};

use crate::{
    Error, Real,
    algorithms::{
        Algorithm, AlgorithmKind, Automatic, Preset, QLearner, QLearningSettings, Team,
        q_learning::memory_that_fits,
    },
    critics::Mixer,
    nn::Element,
};

/// The kind `iql`. All its settings are those of [`QLearningSettings`].
#[derive(Debug, Clone, Copy, Default)]
pub struct Iql;

/// Leaves each member's value as it is.
#[derive(Debug, Clone, Copy)]
pub struct Unmixed {
    /// N
    pub members: usize,
}

impl AlgorithmKind for Iql {
    fn name(&self) -> &'static str {
        "iql"
    }

    fn summary(&self) -> &'static str {
        "IQL: each agent learns the value of its own actions from remembered episodes."
    }

    fn settings(&self) -> Vec<Setting> {
        QLearningSettings::SETTINGS.to_vec()
    }

    fn defaults(&self) -> toml::Table {
        QLearningSettings::defaults()
    }

    fn automatic(&self, table: &toml::Table, spec: &EnvironmentSpec) -> Vec<Automatic> {
        memory_that_fits(table, spec)
    }

    fn check(
        &self,
        table: &toml::Table,
        _spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError> {
        QLearningSettings::read(table)?.check()?;
        Ok(table.clone())
    }

    fn build(&self, table: &toml::Table, team: Team<'_>) -> Result<Box<dyn Algorithm>, Error> {
        let settings = QLearningSettings::read(table).map_err(Error::setting)?;
        let members = team.spec.agents;
        Ok(Box::new(QLearner::new(settings, team, |_| Unmixed {
            members,
        })))
    }

    fn size(&self, table: &toml::Table, team: Team<'_>) -> Result<usize, Error> {
        let settings = QLearningSettings::read(table).map_err(Error::setting)?;
        let members = team.spec.agents;
        Ok(QLearner::size(&settings, team, |_| Unmixed { members }))
    }

    fn presets(&self) -> &'static [Preset] {
        &[Preset {
            name: "pymarl-iql",
            text: include_str!("presets/pymarl-iql.toml"),
        }]
    }
}

impl Mixer for Unmixed {
    type Weights<E: Element> = ();
    type Trace<E: Element> = ();

    fn outputs(&self) -> usize {
        self.members
    }

    fn initialise<R: Real>(&self, _key: &EpisodeKey, _parameters: &mut [R]) {}

    fn weights<E: Element>(&self, _parameters: &[E]) {}

    fn trace<E: Element>(&self) {}

    fn mix<E: Element>(
        &self,
        _weights: &(),
        [_, value_sn]: [&[E]; 2],
        _trace: &mut (),
        mixed_so: &mut [E],
    ) {
        mixed_so.copy_from_slice(value_sn);
    }

    fn backward<E: Element>(
        &self,
        _weights: &(),
        [_, d_mixed_so]: [&[E]; 2],
        _trace: &mut (),
        d_value_sn: &mut [E],
        _gradient: &mut [E],
    ) {
        d_value_sn.copy_from_slice(d_mixed_so);
    }
}
