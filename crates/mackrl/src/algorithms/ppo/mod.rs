//! Proximal policy optimisation on the marginals of groups: MACKRL-PPO, and MAPPO and IPPO, which are the same without upper levels.
//!
//! | | groups | their values read |
//! |---|---|---|
//! | MACKRL-PPO | pairs that commonly know a joint action, else agents | the state, and what each member reads |
//! | MAPPO (Yu and others, 2022) | agents | the state, and what the agent reads |
//! | IPPO (de Witt and others, 2020) | agents | what the agent reads |
//!
//! What is like MAPPO's code, and what is not:
//! 1. clipped surrogate, of each group's ratio; the advantage of a group is the mean of its members';
//! 2. generalised advantages (γ .99, λ .9; .95 there) of whole episodes, normalised over the batch and its living agents; time running out
//!    counts as an end;
//! 3. values in units of returns, clipped (.2), with Huber's loss (10); not recurrent, where MAPPO's are;
//! 4. entropy of the *marginal*: what a group does over all ways to it;
//! 5. epochs over minibatches of whole episodes (one, unless set), with activations computed anew from the first step to the last:
//!    no chunks, so that no stale state is read;
//! 6. inputs, features and recurrent states normalised by row, without gain and bias of their own; orthogonal initial weights, the
//!    last layer's times .01; one feature layer before the recurrent unit;
//! 7. dead agents have no row and no weight in the policy's loss; to the critic they show their identity alone;
//! 8. Adam with ε = 1e-5, gradients of norm at most 10, step sizes that fall; smaller and slower steps where a team is outnumbered.

mod learner;
mod memory;
mod metrics;
mod settings;

use std::marker::PhantomData;

use mackrl_env::{
    EnvironmentSpec,
    settings::{Setting, Settings, SettingsError},
};

pub use learner::Ppo;
pub use settings::{Groups, MackrlPpoSettings, PairMemory, PpoSettings};

use crate::{
    Error,
    algorithms::{
        Algorithm, AlgorithmKind, Automatic, Preset, Team,
        shared_settings::{defaults_of_both, read_both},
    },
    common_knowledge::CommonKnowledgeFeatures,
    hierarchy::{Hierarchy, HierarchySettings, NetworkStyle, Weighing},
    policy::Declaration,
};

/// The kind `mackrl-ppo`.
#[derive(Debug, Clone, Copy, Default)]
pub struct MackrlPpo;

/// The kind `mappo`.
pub type Mappo = AgentsAlone<Central>;

/// The kind `ippo`.
pub type Ippo = AgentsAlone<Own>;

/// The kinds without upper levels.
#[derive(Debug, Clone, Copy, Default)]
pub struct AgentsAlone<V>(PhantomData<V>);

/// Values read the state.
#[derive(Debug, Clone, Copy, Default)]
pub struct Central;

/// Values read what the agent reads.
#[derive(Debug, Clone, Copy, Default)]
pub struct Own;

/// What tells MAPPO and IPPO apart.
pub trait Values: std::fmt::Debug + Send + Sync + Default {
    /// How configurations call the kind.
    const NAME: &'static str;
    /// What it is, in one sentence.
    const SUMMARY: &'static str;
    /// What its values read.
    const SIGHT: Sight;
}

/// What the clipped surrogate is of.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Weighed {
    /// Which pairs are weighed as one.
    pub groups: Weighing,
    /// What the choices of a pair's members, as if each had been alone, weigh beside the pair's.
    pub private: f64,
}

/// What values read beside what the agent reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sight {
    /// The state.
    State,
    /// Nothing.
    Nothing,
}

impl Values for Central {
    const NAME: &'static str = "mappo";
    const SUMMARY: &'static str =
        "MAPPO: the agent controllers alone, with a clipped surrogate and central values.";
    const SIGHT: Sight = Sight::State;
}

impl Values for Own {
    const NAME: &'static str = "ippo";
    const SUMMARY: &'static str = "IPPO: the same as mappo, with values of what each agent reads.";
    const SIGHT: Sight = Sight::Nothing;
}

impl MackrlPpo {
    /// The settings of the hierarchy and of its learning, which stand side by side in one table.
    ///
    /// # Errors
    /// As [`Settings::read`].
    pub fn read(table: &toml::Table) -> Result<(MackrlPpoSettings, PpoSettings), SettingsError> {
        read_both(table)
    }
}

impl AlgorithmKind for MackrlPpo {
    fn name(&self) -> &'static str {
        "mackrl-ppo"
    }

    fn summary(&self) -> &'static str {
        "MACKRL-PPO: pair controllers and agent controllers, with a clipped surrogate of each group's marginal."
    }

    fn settings(&self) -> Vec<Setting> {
        [MackrlPpoSettings::SETTINGS, PpoSettings::SETTINGS].concat()
    }

    fn defaults(&self) -> toml::Table {
        defaults_of_both::<MackrlPpoSettings, PpoSettings>()
    }

    fn automatic(&self, _table: &toml::Table, spec: &EnvironmentSpec) -> Vec<Automatic> {
        PpoSettings::automatic(spec)
    }

    fn check(
        &self,
        table: &toml::Table,
        spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError> {
        let (settings, learning) = Self::read(table)?;
        settings.check(spec)?;
        learning.check()?;
        Ok(table.clone())
    }

    fn build(&self, table: &toml::Table, team: Team<'_>) -> Result<Box<dyn Algorithm>, Error> {
        let (hierarchy, settings, weighed) = parts(table, team)?;
        let learner = Ppo::new(hierarchy, settings, weighed, Sight::State, team);
        Ok(Box::new(learner))
    }

    fn size(&self, table: &toml::Table, team: Team<'_>) -> Result<usize, Error> {
        let (hierarchy, settings, _) = parts(table, team)?;
        Ok(Ppo::size(&hierarchy, &settings, Sight::State, team))
    }

    fn presets(&self) -> &'static [Preset] {
        &[Preset {
            name: "default",
            text: include_str!("presets/default.toml"),
        }]
    }
}

impl<V: Values> AlgorithmKind for AgentsAlone<V> {
    fn name(&self) -> &'static str {
        V::NAME
    }

    fn summary(&self) -> &'static str {
        V::SUMMARY
    }

    fn settings(&self) -> Vec<Setting> {
        PpoSettings::SETTINGS.to_vec()
    }

    fn defaults(&self) -> toml::Table {
        PpoSettings::defaults()
    }

    fn automatic(&self, _table: &toml::Table, spec: &EnvironmentSpec) -> Vec<Automatic> {
        PpoSettings::automatic(spec)
    }

    fn check(
        &self,
        table: &toml::Table,
        _spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError> {
        PpoSettings::read(table)?.check()?;
        Ok(table.clone())
    }

    fn build(&self, table: &toml::Table, team: Team<'_>) -> Result<Box<dyn Algorithm>, Error> {
        let (hierarchy, settings) = alone(table, team)?;
        let learner = Ppo::new(hierarchy, settings, Weighed::default(), V::SIGHT, team);
        Ok(Box::new(learner))
    }

    fn size(&self, table: &toml::Table, team: Team<'_>) -> Result<usize, Error> {
        let (hierarchy, settings) = alone(table, team)?;
        Ok(Ppo::size(&hierarchy, &settings, V::SIGHT, team))
    }
}

/// The declared hierarchy, how it learns, and what is weighed by itself.
fn parts(table: &toml::Table, team: Team<'_>) -> Result<(Hierarchy, PpoSettings, Weighed), Error> {
    let (settings, learning) = MackrlPpo::read(table).map_err(Error::setting)?;
    let declaration = settings.declaration([team.spec.agents, team.spec.actions], team.seed)?;
    let own = HierarchySettings {
        common_knowledge: settings.common_knowledge,
        hidden: learning.hidden,
        networks: style(&learning),
    };
    let hierarchy = Hierarchy::new(declaration, team.spec, team.prior, own);
    let weighed = Weighed {
        groups: match settings.groups {
            Groups::Choosing => Weighing::Choosing,
            Groups::Formed => Weighing::Formed,
        },
        private: settings.private_weight,
    };
    Ok((hierarchy, learning, weighed))
}

/// The hierarchy without upper levels, and how it learns.
fn alone(table: &toml::Table, team: Team<'_>) -> Result<(Hierarchy, PpoSettings), Error> {
    let settings = PpoSettings::read(table).map_err(Error::setting)?;
    let declaration = Declaration::agents_alone([team.spec.agents, team.spec.actions]);
    let own = HierarchySettings {
        // No group reads it.
        common_knowledge: CommonKnowledgeFeatures::default(),
        hidden: settings.hidden,
        networks: style(&settings),
    };
    let hierarchy = Hierarchy::new(declaration, team.spec, team.prior, own);
    Ok((hierarchy, settings))
}

const fn style(settings: &PpoSettings) -> NetworkStyle {
    NetworkStyle::Normalised {
        gain: settings.policy_gain,
    }
}
