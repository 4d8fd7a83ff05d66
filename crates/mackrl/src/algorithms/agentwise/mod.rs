//! Actor-critic learning in which each agent's choices are weighed by an advantage of its own: IAC and COMA.
//!
//! | | a critic reads of a member | advantage of its choice |
//! |---|---|---|
//! | IAC (Foerster and others, 2018) | what the agent reads | `r + γ V(o') − V(o)` |
//! | COMA (the same) | that, the state, and what all others do | `Q(u) − Σ_a π(a) Q(u₋, a)`: against what it might have done |
//!
//! As PyMARL's COMA: λ-returns of a target copy, the critic learnt backwards in time with one step for each, ε mixed into the
//! policy that is differentiated, the mean over steps and agents. What is not: time running out counts as an end; the critic's
//! last actions are those that the state holds; the dead have no policy, which changes no gradient.

mod learner;
mod settings;

use std::{fmt::Debug, marker::PhantomData};

use mackrl_env::{
    EnvironmentSpec,
    settings::{Setting, Settings, SettingsError},
};

pub use learner::Agentwise;
pub use settings::AgentwiseSettings;

use crate::{
    Error,
    algorithms::{Algorithm, AlgorithmKind, Preset, Team},
    experience::Episode,
};

/// The kind `iac`.
pub type Iac = AgentwiseKind<OwnObservation>;

/// The kind `coma`.
pub type Coma = AgentwiseKind<Counterfactual>;

/// Kinds that weigh each agent's choices by itself.
#[derive(Debug, Clone, Copy, Default)]
pub struct AgentwiseKind<J>(PhantomData<J>);

/// What a critic reads beside what an agent reads, and how its values become advantages.
pub trait Judge: Debug + Send + Sync + Default + 'static {
    /// How configurations call the kind.
    const NAME: &'static str;
    /// What it is, in one sentence.
    const SUMMARY: &'static str;
    /// Shipped configurations.
    const PRESETS: &'static [Preset];
    /// How values become advantages.
    const ADVANTAGE: Advantage;

    /// Numbers that the critic reads beside what the agent reads.
    fn inputs(spec: &EnvironmentSpec) -> usize;

    /// Writes them, for a member at step `t` of an episode, into zeros.
    fn write(spec: &EnvironmentSpec, episode: &Episode, t: usize, member: usize, to: &mut [f32]);
}

/// How values become advantages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Advantage {
    /// One value of a situation: what came and what can be expected then, against what could be expected before.
    Temporal,
    /// A value of each action: that of what was done, against what the policy does on average.
    Counterfactual,
}

/// The critic of IAC.
#[derive(Debug, Clone, Copy, Default)]
pub struct OwnObservation;

/// The critic of COMA.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counterfactual;

impl Advantage {
    /// Columns that a critic gives, where an agent has `actions` actions.
    pub(super) const fn outputs(self, actions: usize) -> usize {
        match self {
            Self::Temporal => 1,
            Self::Counterfactual => actions,
        }
    }
}

impl Judge for OwnObservation {
    const NAME: &'static str = "iac";
    const SUMMARY: &'static str =
        "IAC: agents alone, each with a critic of what it observes and advantages of its own.";
    const PRESETS: &'static [Preset] = &[];
    const ADVANTAGE: Advantage = Advantage::Temporal;

    fn inputs(_spec: &EnvironmentSpec) -> usize {
        0
    }

    fn write(_: &EnvironmentSpec, _: &Episode, _: usize, _: usize, _: &mut [f32]) {}
}

impl Judge for Counterfactual {
    const NAME: &'static str = "coma";
    const SUMMARY: &'static str = "COMA: agents alone, under a central critic that compares each one's action with its others.";
    const PRESETS: &'static [Preset] = &[Preset {
        name: "pymarl-coma",
        text: include_str!("presets/pymarl-coma.toml"),
    }];
    const ADVANTAGE: Advantage = Advantage::Counterfactual;

    fn inputs(spec: &EnvironmentSpec) -> usize {
        spec.state_size + spec.agents * spec.actions
    }

    fn write(spec: &EnvironmentSpec, episode: &Episode, t: usize, member: usize, to: &mut [f32]) {
        let (state, actions) = to.split_at_mut(spec.state_size);
        state.copy_from_slice(episode.state(t));
        for (agent, action) in episode.actions(t).iter().enumerate() {
            if agent != member {
                actions[agent * spec.actions + action.index()] = 1.0;
            }
        }
    }
}

impl<J: Judge> AlgorithmKind for AgentwiseKind<J> {
    fn name(&self) -> &'static str {
        J::NAME
    }

    fn summary(&self) -> &'static str {
        J::SUMMARY
    }

    fn settings(&self) -> Vec<Setting> {
        AgentwiseSettings::SETTINGS.to_vec()
    }

    fn defaults(&self) -> toml::Table {
        AgentwiseSettings::defaults()
    }

    fn check(
        &self,
        table: &toml::Table,
        _spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError> {
        AgentwiseSettings::read(table)?.check()?;
        Ok(table.clone())
    }

    fn build(&self, table: &toml::Table, team: Team<'_>) -> Result<Box<dyn Algorithm>, Error> {
        let settings = AgentwiseSettings::read(table).map_err(Error::setting)?;
        Ok(Box::new(Agentwise::<J>::new(settings, team)))
    }

    fn size(&self, table: &toml::Table, team: Team<'_>) -> Result<usize, Error> {
        let settings = AgentwiseSettings::read(table).map_err(Error::setting)?;
        Ok(Agentwise::<J>::size(&settings, team))
    }

    fn presets(&self) -> &'static [Preset] {
        J::PRESETS
    }
}
