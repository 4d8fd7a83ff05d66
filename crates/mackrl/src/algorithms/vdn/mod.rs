//! VDN: the value of the team is the sum of the agents' (Sunehag and others, 2018).

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

/// The kind `vdn`. All its settings are those of [`QLearningSettings`].
#[derive(Debug, Clone, Copy, Default)]
pub struct Vdn;

/// Adds the members' values.
#[derive(Debug, Clone, Copy)]
pub struct Summed {
    /// N
    pub members: usize,
}

impl AlgorithmKind for Vdn {
    fn name(&self) -> &'static str {
        "vdn"
    }

    fn summary(&self) -> &'static str {
        "VDN: agents' action values, whose sum is learnt as the value of the team."
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
        Ok(Box::new(QLearner::new(settings, team, |_| Summed {
            members,
        })))
    }

    fn size(&self, table: &toml::Table, team: Team<'_>) -> Result<usize, Error> {
        let settings = QLearningSettings::read(table).map_err(Error::setting)?;
        let members = team.spec.agents;
        Ok(QLearner::size(&settings, team, |_| Summed { members }))
    }

    fn presets(&self) -> &'static [Preset] {
        &[Preset {
            name: "pymarl-vdn",
            text: include_str!("presets/pymarl-vdn.toml"),
        }]
    }
}

impl Mixer for Summed {
    type Weights<E: Element> = ();
    type Trace<E: Element> = ();

    fn outputs(&self) -> usize {
        1
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
        for (sum, value_n) in mixed_so.iter_mut().zip(value_sn.chunks_exact(self.members)) {
            *sum = value_n.iter().copied().sum();
        }
    }

    fn backward<E: Element>(
        &self,
        _weights: &(),
        [_, d_mixed_so]: [&[E]; 2],
        _trace: &mut (),
        d_value_sn: &mut [E],
        _gradient: &mut [E],
    ) {
        for (d_value_n, &d_sum) in d_value_sn.chunks_exact_mut(self.members).zip(d_mixed_so) {
            d_value_n.fill(d_sum);
        }
    }
}
