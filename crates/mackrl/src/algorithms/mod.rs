//! What can learn: a registry of algorithms, and a folder for each.
//!
//! An algorithm declares its own settings, what they mean and which go together, and brings its presets along, so that
//! configurations, help texts, explanations and schemas follow from its folder. Adding one takes that folder and a line in
//! [`built_in`]. Nothing here is closed: a program adds [`AlgorithmKind`]s of its own to its registry.

mod actor_critic;
mod central_v;
mod groupwise;
mod iql;
mod jal;
mod mackrl;
mod ppo;
mod q_learning;
mod qmix;
mod shared_settings;
mod state;
mod vdn;

use std::{fmt::Debug, sync::Arc};

use mackrl_env::{
    EnvironmentSpec, PriorKnowledge,
    settings::{Setting, SettingsError},
};

pub use actor_critic::{ActorCritic, ActorCriticSettings};
pub use central_v::CentralV;
pub use groupwise::{
    Advantage, AgentwiseKind, Coma, Counterfactual, Groupwise, GroupwiseSettings, Iac, Judge,
    MackrlComa, MackrlComaSettings, OwnObservation,
};
pub use iql::{Iql, Unmixed};
pub use jal::{Jal, JalSettings};
pub use mackrl::{Levels, Mackrl, MackrlSettings, PartitionChoice};
pub use ppo::{
    Groups, Ippo, MackrlPpo, MackrlPpoSettings, Mappo, PairMemory, Ppo, PpoSettings, Sight, Weighed,
};
pub use q_learning::{
    ActionValues, Decomposition, QLearner, QLearningSettings, ValueDecomposition,
};
pub use qmix::{Qmix, QmixSettings};
pub use shared_settings::{NoSettings, OptimiserName};
pub use state::{AlgorithmState, StoredState};
pub use vdn::{Summed, Vdn};

use crate::{
    Error, Stopwatch,
    common_knowledge::CommonKnowledgeFeatures,
    experience::Piece,
    hierarchy::{Hierarchy, HierarchySettings, NetworkStyle},
    nn::ParameterLayout,
    policy::{Behaviour, Declaration, Parameters, Policy, Tally},
};

/// What learns: a policy, its parameters, and how both change.
///
/// A run plays batches of episodes with [`policy`](Self::policy) and [`parameters`](Self::parameters), hands them to
/// [`learn`](Self::learn), tests, and stores [`state`](Self::state); it knows nothing else of an algorithm.
pub trait Algorithm: Send + Debug {
    /// What acts.
    fn policy(&self) -> &dyn Policy;

    /// What it acts with at present.
    fn parameters(&self) -> &Parameters;

    /// Environments that are played at once: each gives one episode to a batch.
    fn environments(&self) -> usize;

    /// Pieces into which a batch is cut for work in parallel. It decides bits, so it is a setting.
    fn shards(&self) -> usize;

    /// How choices are made in training, when `steps_env` environment steps have been played.
    fn behaviour(&self, steps_env: u64) -> Behaviour;

    /// Learns from a batch of episodes, books the time that it takes, and gives what it has to report: sums under names that
    /// [`metrics`](Self::metrics) explains.
    ///
    /// # Errors
    /// [`Error::NotFinite`] if a number is infinite or NaN: the state is not to be used any more then. [`Error::Data`] if the
    /// batch holds no step, or was played by another policy.
    fn learn(
        &mut self,
        batch: &mut [&mut Piece],
        stopwatch: &mut Stopwatch,
    ) -> Result<Tally, Error>;

    /// Batches learnt from so far: policy updates, but for learners that only remember the first batches.
    fn updates(&self) -> u64;

    /// Names (or the parts before a number) and meanings of what [`learn`](Self::learn) and the policy's actors report.
    fn metrics(&self) -> &'static [(&'static str, &'static str)];

    /// The parameters of the policy and of whatever else is worth keeping when training is over.
    fn models(&self) -> Vec<(&ParameterLayout, &[f32])>;

    /// Everything that the future of the algorithm depends on, its settings aside.
    fn state(&self) -> AlgorithmState;

    /// Continues from a stored state.
    ///
    /// # Errors
    /// [`Error::Data`] if something is missing or is that of another algorithm. Nothing has changed then.
    fn restore(&mut self, stored: &dyn StoredState) -> Result<(), Error>;

    /// Takes over the [`models`](Self::models) of a finished run, to be tested, certified or looked into.
    ///
    /// # Errors
    /// [`Error::Data`] if a tensor is missing or has another size. Nothing has changed then.
    fn load(&mut self, stored: &dyn StoredState) -> Result<(), Error>;

    /// V(s) of a state \[G\], if the algorithm judges states.
    fn value(&mut self, state_g: &[f32]) -> Option<f32> {
        let _ = state_g;
        None
    }
}

/// What an algorithm is built for.
#[derive(Debug, Clone, Copy)]
pub struct Team<'a> {
    /// Sizes of the world.
    pub spec: &'a EnvironmentSpec,
    /// What every agent knows before the first step.
    pub prior: &'a Arc<dyn PriorKnowledge>,
    /// The run's seed, from which initial parameters follow.
    pub seed: u64,
    /// Threads that may be used, which changes no result.
    pub threads: usize,
}

impl Team<'_> {
    /// A declared hierarchy of plain networks with so many units in each layer.
    fn hierarchy(
        self,
        declaration: Declaration,
        common_knowledge: CommonKnowledgeFeatures,
        hidden: usize,
    ) -> Hierarchy {
        let settings = HierarchySettings {
            common_knowledge,
            hidden,
            networks: NetworkStyle::Plain,
        };
        Hierarchy::new(declaration, self.spec, self.prior, settings)
    }
}

/// Steps of a batch, at least one.
fn steps_to_learn_from(batch: &[&mut Piece]) -> Result<usize, Error> {
    match batch.iter().map(|piece| piece.experience.steps()).sum() {
        0 => Err(Error::Data("there is no step to learn from".to_owned())),
        steps => Ok(steps),
    }
}

/// Adds a shard's gradient to the sum of those before it.
fn add_to(sums: &mut [f32], terms: &[f32]) {
    let both = sums.iter_mut().zip(terms);
    both.for_each(|(sum, term)| *sum += term);
}

/// An algorithm that configurations can name, with the settings that it declares.
pub trait AlgorithmKind: Send + Sync + Debug {
    /// How configurations call it, such as `mackrl`.
    fn name(&self) -> &'static str;

    /// What it is, in one sentence.
    fn summary(&self) -> &'static str;

    /// Its settings, in the order in which they are shown.
    fn settings(&self) -> Vec<Setting>;

    /// The built-in value of each of them, in the same order.
    fn defaults(&self) -> toml::Table;

    /// Values that a world of these sizes asks for and that take the place of those in `table`, unless a user chose a value:
    /// presets are written for small teams.
    fn automatic(&self, table: &toml::Table, spec: &EnvironmentSpec) -> Vec<Automatic> {
        let _ = (table, spec);
        Vec::new()
    }

    /// Checks a complete table: ranges, combinations, and what depends on the sizes of the world. Gives the table that is in
    /// force.
    ///
    /// # Errors
    /// [`SettingsError`] with the first setting that is out of its range, or does not go with another or with the world.
    fn check(
        &self,
        table: &toml::Table,
        spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError>;

    /// The algorithm that a complete table describes, for a team that has learnt nothing.
    ///
    /// # Errors
    /// [`Error::Config`] if the table is not one that [`check`](Self::check) accepts.
    fn build(&self, table: &toml::Table, team: Team<'_>) -> Result<Box<dyn Algorithm>, Error>;

    /// How many numbers the [`models`](Algorithm::models) of such an algorithm have, without making room for them: both the table
    /// and the file that is said to hold them may be a stranger's.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    fn size(&self, table: &toml::Table, team: Team<'_>) -> Result<usize, Error>;

    /// Configurations that are shipped with it.
    fn presets(&self) -> &'static [Preset] {
        &[]
    }
}

/// A value that follows from the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Automatic {
    /// Name of the setting.
    pub name: &'static str,
    /// Its value.
    pub value: toml::Value,
    /// Why it is what it is.
    pub why: &'static str,
}

/// A shipped configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Preset {
    /// Name, as given to `--preset`.
    pub name: &'static str,
    /// The file, with its comments.
    pub text: &'static str,
}

/// The algorithms of this crate, the paper's own first. What we recommend is what preset `default` names.
#[must_use]
pub fn built_in() -> Vec<Arc<dyn AlgorithmKind>> {
    vec![
        Arc::new(Mackrl),
        Arc::new(CentralV),
        Arc::new(Jal),
        Arc::new(MackrlPpo),
        Arc::new(Mappo::default()),
        Arc::new(Ippo::default()),
        Arc::new(Iql::default()),
        Arc::new(Vdn::default()),
        Arc::new(Qmix::default()),
        Arc::new(Iac::default()),
        Arc::new(Coma::default()),
        Arc::new(MackrlComa),
    ]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_algorithm_gives_each_of_its_settings_a_value_that_it_takes() {
        for kind in built_in() {
            let defaults = kind.defaults();
            let names: Vec<&str> = defaults.keys().map(String::as_str).collect();
            let declared: Vec<&str> = kind.settings().iter().map(|one| one.name).collect();
            assert_eq!(names, declared, "{}", kind.name());
            for setting in kind.settings() {
                assert!(setting.accepts.admits(&defaults[setting.name]));
                assert!(setting.meaning.ends_with('.'), "{}", setting.name);
            }
        }
    }

    #[test]
    fn names_of_algorithms_and_of_presets_are_their_own() {
        let kinds = built_in();
        let presets = kinds.iter().flat_map(|kind| kind.presets());
        let mut seen = BTreeSet::new();
        let names = presets.map(|preset| preset.name);
        for name in names.chain(kinds.iter().map(|kind| kind.name())) {
            assert!(seen.insert(name), "{name} stands for two things");
        }
    }
}
