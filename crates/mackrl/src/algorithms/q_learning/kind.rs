//! The kinds `iql`, `vdn` and `qmix`: one learner, with a mixer each.

use std::marker::PhantomData;

use mackrl_env::{
    EnvironmentSpec,
    settings::{Setting, Settings, SettingsError},
};

use super::{QLearner, QLearningSettings, settings::memory_that_fits};
use crate::{
    Error,
    algorithms::{
        Algorithm, AlgorithmKind, Automatic, Preset, Team,
        shared_settings::{defaults_of_both, read_both},
    },
    critics::Mixer,
    nn::ParameterLayout,
};

/// Kinds that learn agents' action values and mix them with an `M`.
#[derive(Debug, Clone, Copy)]
pub struct ValueDecomposition<M>(PhantomData<M>);

/// A mixer that configurations can name.
pub trait Decomposition: Mixer {
    /// How configurations call the kind.
    const NAME: &'static str;
    /// What it is, in one sentence.
    const SUMMARY: &'static str;
    /// Shipped configurations.
    const PRESETS: &'static [Preset];
    /// Its own settings, which stand beside those of [`QLearningSettings`] in one table.
    type Settings: Settings;

    /// Checks whether such a mixer can be had in a world of these sizes.
    ///
    /// # Errors
    /// [`SettingsError`] with the setting that does not go with the world.
    fn check(settings: &Self::Settings, spec: &EnvironmentSpec) -> Result<(), SettingsError> {
        let _ = (settings, spec);
        Ok(())
    }

    /// The mixer for a team in such a world; its tensors are added to `layout`.
    fn new(settings: &Self::Settings, spec: &EnvironmentSpec, layout: &mut ParameterLayout)
    -> Self;
}

impl<M> Default for ValueDecomposition<M> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<M: Decomposition> ValueDecomposition<M> {
    /// The settings of the mixer and of learning, which stand side by side in one table.
    ///
    /// # Errors
    /// As [`Settings::read`].
    pub fn read(table: &toml::Table) -> Result<(M::Settings, QLearningSettings), SettingsError> {
        read_both(table)
    }
}

impl<M: Decomposition> AlgorithmKind for ValueDecomposition<M> {
    fn name(&self) -> &'static str {
        M::NAME
    }

    fn summary(&self) -> &'static str {
        M::SUMMARY
    }

    fn settings(&self) -> Vec<Setting> {
        [M::Settings::DECLARED, QLearningSettings::SETTINGS].concat()
    }

    fn defaults(&self) -> toml::Table {
        defaults_of_both::<M::Settings, QLearningSettings>()
    }

    fn automatic(&self, table: &toml::Table, spec: &EnvironmentSpec) -> Vec<Automatic> {
        memory_that_fits(table, spec)
    }

    fn check(
        &self,
        table: &toml::Table,
        spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError> {
        let (own, learning) = Self::read(table)?;
        learning.check()?;
        M::check(&own, spec)?;
        Ok(table.clone())
    }

    fn build(&self, table: &toml::Table, team: Team<'_>) -> Result<Box<dyn Algorithm>, Error> {
        let (own, learning) = Self::read(table).map_err(Error::setting)?;
        let mixer = |layout: &mut ParameterLayout| M::new(&own, team.spec, layout);
        Ok(Box::new(QLearner::new(learning, team, mixer)))
    }

    fn size(&self, table: &toml::Table, team: Team<'_>) -> Result<usize, Error> {
        let (own, learning) = Self::read(table).map_err(Error::setting)?;
        let mixer = |layout: &mut ParameterLayout| M::new(&own, team.spec, layout);
        Ok(QLearner::size(&learning, team, mixer))
    }

    fn presets(&self) -> &'static [Preset] {
        M::PRESETS
    }
}
