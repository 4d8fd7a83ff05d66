//! Actor-critic learning in which each group's choices are weighed by an advantage of its own: IAC, COMA and MACKRL-COMA.
//!
//! | | groups | a critic reads of a group | advantage of its choice |
//! |---|---|---|---|
//! | IAC (Foerster and others, 2018) | agents | what the agent reads | `r + γ V(o') − V(o)` |
//! | COMA (the same) | agents | that, the state, and what all others do | `Q(u) − Σ_a π(a) Q(u₋, a)`: against what it might have done |
//! | MACKRL-COMA | pairs that commonly know a joint action, else agents | what each member reads, the state, and what all others do | `Q(u) − Σ_{u_g} q(u_g) Q(u₋, u_g)`, with the pair's marginal q |
//!
//! As PyMARL's COMA: λ-returns of a target copy, the critic learnt backwards in time with one step for each, ε mixed into the
//! policy that is differentiated, the mean over steps and agents. What is not: the critic's last actions are those that the state holds; the
//! dead have no policy, which changes no gradient.
//!
//! Given the partition in force groups act independently, so that a baseline which depends on what others do, but not on what the group
//! does, leaves the expected gradient as it is. MACKRL-COMA has one partition in force at a time for this; a pair that commonly knows no
//! joint action is two agents. The sum over a pair's A² joint actions is exact: a critic of pairs has an output for each of them, as the
//! pair's controller has, so that it costs one pass of a network for each pair. The alternative, a Q that reads the joint action, needs
//! A² passes, 1 296 for each pair of `27m_vs_30m`. All critics estimate the same Q(s, u), and pairs last for a step: the target of a pair's
//! value is the mean of its members' λ-returns. Delegation is summed out on both sides: the advantage multiplies ∇ log q.

mod learner;
mod mackrl_coma;
mod reading;
mod settings;
mod shard;

use std::{fmt::Debug, marker::PhantomData};

use mackrl_env::{
    EnvironmentSpec,
    settings::{Setting, Settings, SettingsError},
};

pub use learner::Groupwise;
pub use mackrl_coma::{MackrlComa, MackrlComaSettings};
pub use settings::GroupwiseSettings;

use crate::{
    Error,
    algorithms::{Algorithm, AlgorithmKind, Preset, Team},
    common_knowledge::CommonKnowledgeFeatures,
    experience::Episode,
    hierarchy::Hierarchy,
    policy::Declaration,
};

/// The kind `iac`.
pub type Iac = AgentwiseKind<OwnObservation>;

/// The kind `coma`.
pub type Coma = AgentwiseKind<Counterfactual>;

/// Kinds whose groups are single agents.
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

    /// Writes them, for the members of a group at step `t` of an episode, into zeros.
    fn write(
        spec: &EnvironmentSpec,
        episode: &Episode,
        t: usize,
        members: &[usize],
        to: &mut [f32],
    );
}

/// How values become advantages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Advantage {
    /// One value of a situation: what came and what can be expected then, against what could be expected before.
    Temporal,
    /// A value of each action, or of each joint action of a pair: that of what was done, against what the policy does on average.
    Counterfactual,
}

/// The critic of IAC.
#[derive(Debug, Clone, Copy, Default)]
pub struct OwnObservation;

/// The critic of COMA.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counterfactual;

impl Advantage {
    /// Columns that a critic gives, where a group has so many `choices`.
    pub(super) const fn outputs(self, choices: usize) -> usize {
        match self {
            Self::Temporal => 1,
            Self::Counterfactual => choices,
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

    fn write(_: &EnvironmentSpec, _: &Episode, _: usize, _: &[usize], _: &mut [f32]) {}
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

    fn write(
        spec: &EnvironmentSpec,
        episode: &Episode,
        t: usize,
        members: &[usize],
        to: &mut [f32],
    ) {
        let (state, actions) = to.split_at_mut(spec.state_size);
        state.copy_from_slice(episode.state(t));
        for (agent, action) in episode.actions(t).iter().enumerate() {
            if !members.contains(&agent) {
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
        GroupwiseSettings::SETTINGS.to_vec()
    }

    fn defaults(&self) -> toml::Table {
        GroupwiseSettings::defaults()
    }

    fn check(
        &self,
        table: &toml::Table,
        _spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError> {
        GroupwiseSettings::read(table)?.check()?;
        Ok(table.clone())
    }

    fn build(&self, table: &toml::Table, team: Team<'_>) -> Result<Box<dyn Algorithm>, Error> {
        let (hierarchy, settings) = alone(table, team)?;
        Ok(Box::new(Groupwise::<J>::new(hierarchy, settings, team)))
    }

    fn size(&self, table: &toml::Table, team: Team<'_>) -> Result<usize, Error> {
        let (hierarchy, settings) = alone(table, team)?;
        Ok(Groupwise::<J>::size(&hierarchy, &settings, team))
    }

    fn presets(&self) -> &'static [Preset] {
        J::PRESETS
    }
}

/// The hierarchy without upper levels, and how it learns.
fn alone(table: &toml::Table, team: Team<'_>) -> Result<(Hierarchy, GroupwiseSettings), Error> {
    let settings = GroupwiseSettings::read(table).map_err(Error::setting)?;
    let declaration = Declaration::agents_alone([team.spec.agents, team.spec.actions]);
    // No group reads common knowledge.
    let features = CommonKnowledgeFeatures::default();
    let hierarchy = team.hierarchy(declaration, features, settings.hidden);
    Ok((hierarchy, settings))
}
