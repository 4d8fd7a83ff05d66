//! QMIX: the value of the team rises with that of each agent, by weights that the state gives (Rashid and others, 2018).

use mackrl_env::{
    EnvironmentSpec, declare_settings,
    settings::{Accepts, SettingsError, WrongSetting},
};

use crate::{
    algorithms::{
        Preset,
        q_learning::{Decomposition, ValueDecomposition},
    },
    critics::{Monotonic, MonotonicSizes},
    nn::ParameterLayout,
};

/// The kind `qmix`.
pub type Qmix = ValueDecomposition<Monotonic>;

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

impl Decomposition for Monotonic {
    const NAME: &'static str = "qmix";
    const SUMMARY: &'static str = "QMIX: agents' action values, mixed by weights of the state into one value of the team that rises with each.";
    const PRESETS: &'static [Preset] = &[
        Preset {
            name: "pymarl-qmix",
            text: include_str!("presets/pymarl-qmix.toml"),
        },
        Preset {
            name: "pymarl2-qmix",
            text: include_str!("presets/pymarl2-qmix.toml"),
        },
    ];
    type Settings = QmixSettings;

    fn check(settings: &QmixSettings, spec: &EnvironmentSpec) -> Result<(), SettingsError> {
        if spec.state_size > 0 {
            return Ok(());
        }
        Err(SettingsError::Wrong(WrongSetting {
            name: "mixing_hidden".to_owned(),
            found: settings.mixing_hidden.to_string(),
            expected: format!("another algorithm: {} shows no state to mix by", spec.name),
            nearest: None,
        }))
    }

    fn new(settings: &QmixSettings, spec: &EnvironmentSpec, layout: &mut ParameterLayout) -> Self {
        let sizes = MonotonicSizes {
            state: spec.state_size,
            members: spec.agents,
            hidden: settings.mixing_hidden,
            hypernetwork_hidden: (settings.hypernetwork_layers == 2)
                .then_some(settings.hypernetwork_hidden),
        };
        Self::new(layout, sizes)
    }
}
