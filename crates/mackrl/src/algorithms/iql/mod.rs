//! IQL: each agent learns the value of its own actions, and takes the others for a part of the world (Tan, 1993).

use mackrl_env::{EnvironmentSpec, EpisodeKey};

use crate::{
    Real,
    algorithms::{
        Preset,
        q_learning::{Decomposition, ValueDecomposition},
        shared_settings::NoSettings,
    },
    critics::Mixer,
    nn::{Element, ParameterLayout},
};

/// The kind `iql`.
pub type Iql = ValueDecomposition<Unmixed>;

/// Leaves each member's value as it is.
#[derive(Debug, Clone, Copy)]
pub struct Unmixed {
    /// N
    pub members: usize,
}

impl Decomposition for Unmixed {
    const NAME: &'static str = "iql";
    const SUMMARY: &'static str =
        "IQL: each agent learns the value of its own actions from remembered episodes.";
    const PRESETS: &'static [Preset] = &[Preset {
        name: "pymarl-iql",
        text: include_str!("presets/pymarl-iql.toml"),
    }];
    type Settings = NoSettings;

    fn new(_: &NoSettings, spec: &EnvironmentSpec, _: &mut ParameterLayout) -> Self {
        Self {
            members: spec.agents,
        }
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
