//! VDN: the value of the team is the sum of the agents' (Sunehag and others, 2018).

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

/// The kind `vdn`.
pub type Vdn = ValueDecomposition<Summed>;

/// Adds the members' values.
#[derive(Debug, Clone, Copy)]
pub struct Summed {
    /// N
    pub members: usize,
}

impl Decomposition for Summed {
    const NAME: &'static str = "vdn";
    const SUMMARY: &'static str =
        "VDN: agents' action values, whose sum is learnt as the value of the team.";
    const PRESETS: &'static [Preset] = &[Preset {
        name: "pymarl-vdn",
        text: include_str!("presets/pymarl-vdn.toml"),
    }];
    type Settings = NoSettings;

    fn new(_: &NoSettings, spec: &EnvironmentSpec, _: &mut ParameterLayout) -> Self {
        Self {
            members: spec.agents,
        }
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
