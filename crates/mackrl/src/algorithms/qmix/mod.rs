//! QMIX: the value of the team rises with that of each agent, by weights that the state gives (Rashid and others, 2018).

use mackrl_env::{
    EnvironmentSpec, declare_settings,
    settings::{Accepts, Setting, Settings, SettingsError, WrongSetting},
};

use crate::{
    Error,
    algorithms::{
        Algorithm, AlgorithmKind, Automatic, Preset, QLearner, QLearningSettings, Team,
        q_learning::memory_that_fits,
    },
    critics::{Monotonic, MonotonicSizes},
    nn::ParameterLayout,
};

/// The kind `qmix`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Qmix;

declare_settings! {
    /// The mixer of QMIX.
    pub struct QmixSettings {
        /// Units in the hidden layer of the mixing network.
        mixing_hidden: usize = 32, Accepts::integer(1, 4096);
        /// Layers of the hypernetworks that give the mixing network's weights.
        hypernetwork_layers: usize = 2, Accepts::integer(1, 2);
        /// Units in the hypernetworks' hidden layer, if they have two.
        hypernetwork_hidden: usize = 64, Accepts::integer(1, 4096);
    }
}

impl Qmix {
    /// The settings of the mixer and of learning, which stand side by side in one table.
    ///
    /// # Errors
    /// As [`Settings::read`].
    pub fn read(table: &toml::Table) -> Result<(QmixSettings, QLearningSettings), SettingsError> {
        let own = |name: &str| (QmixSettings::SETTINGS.iter()).any(|setting| setting.name == name);
        let (mixer, learning): (toml::Table, toml::Table) = table
            .iter()
            .map(|(name, value)| (name.clone(), value.clone()))
            .partition(|(name, _)| own(name));
        Ok((
            QmixSettings::read(&mixer)?,
            QLearningSettings::read(&learning)?,
        ))
    }
}

impl QmixSettings {
    fn mixer(&self, spec: &EnvironmentSpec, layout: &mut ParameterLayout) -> Monotonic {
        let sizes = MonotonicSizes {
            state: spec.state_size,
            members: spec.agents,
            hidden: self.mixing_hidden,
            hypernetwork_hidden: (self.hypernetwork_layers == 2)
                .then_some(self.hypernetwork_hidden),
        };
        Monotonic::new(layout, sizes)
    }
}

impl AlgorithmKind for Qmix {
    fn name(&self) -> &'static str {
        "qmix"
    }

    fn summary(&self) -> &'static str {
        "QMIX: agents' action values, mixed by weights of the state into one value of the team that rises with each."
    }

    fn settings(&self) -> Vec<Setting> {
        [QmixSettings::SETTINGS, QLearningSettings::SETTINGS].concat()
    }

    fn defaults(&self) -> toml::Table {
        let mut defaults = QmixSettings::defaults();
        defaults.extend(QLearningSettings::defaults());
        defaults
    }

    fn automatic(&self, table: &toml::Table, spec: &EnvironmentSpec) -> Vec<Automatic> {
        memory_that_fits(table, spec)
    }

    fn check(
        &self,
        table: &toml::Table,
        spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError> {
        let (settings, learning) = Self::read(table)?;
        learning.check()?;
        if spec.state_size == 0 {
            return Err(SettingsError::Wrong(WrongSetting {
                name: "mixing_hidden".to_owned(),
                found: settings.mixing_hidden.to_string(),
                expected: format!("another algorithm: {} shows no state to mix by", spec.name),
                nearest: None,
            }));
        }
        Ok(table.clone())
    }

    fn build(&self, table: &toml::Table, team: Team<'_>) -> Result<Box<dyn Algorithm>, Error> {
        let (settings, learning) = Self::read(table).map_err(Error::setting)?;
        let mixer = |layout: &mut ParameterLayout| settings.mixer(team.spec, layout);
        Ok(Box::new(QLearner::new(learning, team, mixer)))
    }

    fn size(&self, table: &toml::Table, team: Team<'_>) -> Result<usize, Error> {
        let (settings, learning) = Self::read(table).map_err(Error::setting)?;
        let mixer = |layout: &mut ParameterLayout| settings.mixer(team.spec, layout);
        Ok(QLearner::size(&learning, team, mixer))
    }

    fn presets(&self) -> &'static [Preset] {
        &[
            Preset {
                name: "pymarl-qmix",
                text: include_str!("presets/pymarl-qmix.toml"),
            },
            Preset {
                name: "pymarl2-qmix",
                text: include_str!("presets/pymarl2-qmix.toml"),
            },
        ]
    }
}
