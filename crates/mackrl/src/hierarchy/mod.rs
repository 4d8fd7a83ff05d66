//! The controllers of a declared hierarchy at work (Table 1, Algorithm 1, Figure 2).
//!
//! | level of pairwise MACKRL | reads | chooses |
//! |---|---|---|
//! | pair selector | common knowledge of the team | a partition into pairs |
//! | pair controller | common knowledge of the pair, who they are | a joint action, or to delegate |
//! | agent controller | its own observation and last action, who it is | its own action |
//!
//! All of them write their log-probabilities into one table, with masks and exploration applied. The walk and the marginal
//! likelihood both read that table, so the probability that is differentiated is the one that was sampled from. The choice
//! of partition or of delegation is never an input of a later step: p(u) marginalises over it, and a policy that depends on
//! the path would make that marginal's gradient biased (Table 1 of the paper lists it; the authors' code has none either).
//!
//! A [`Hierarchy`] is any [`Declaration`] with its networks. `controllers` run its levels from a
//! `perspective`, that of all agents or of one alone; `evaluation` gives log p(u) of an experience and turns a gradient with
//! respect to it into one of the parameters.

mod activations;
mod actor;
mod bank;
mod controllers;
mod evaluation;
mod executor;
mod factors;
mod health;
mod metrics;
mod perspective;
mod statistics;
mod tables;
mod thought;

use std::sync::Arc;

use mackrl_env::{AgentId, EnvironmentSpec, EpisodeKey, PriorKnowledge, Stream};

pub use self::{
    activations::Activations,
    factors::{Factor, FactorTerm, FactorWorkspace, Weighing},
};
use self::{actor::TeamActor, bank::Bank, executor::AgentExecutor};
use crate::{
    common_knowledge::CommonKnowledgeFeatures,
    nn::{ParameterLayout, RecurrentWeights},
    policy::{
        Actor, ControllerDescription, ControllerId, Declaration, Executor, Memory, Parameters,
        Part, Policy, TEAM,
    },
};

/// What the controllers of a hierarchy are made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HierarchySettings {
    /// What controllers read of common knowledge.
    pub common_knowledge: CommonKnowledgeFeatures,
    /// H: width of the hidden layers and of the recurrent state, at least 1.
    pub hidden: usize,
    /// How networks are made.
    pub networks: NetworkStyle,
}

/// How the networks of a hierarchy are made.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum NetworkStyle {
    /// As the paper's: nothing is normalised, and initial parameters are uniform as PyTorch draws them.
    #[default]
    Plain,
    /// As those that learn under a clipped surrogate: inputs, features and what the last layer reads of recurrent states are
    /// normalised row by row, initial weights are orthogonal, and the first logits close to each other.
    Normalised {
        /// What the orthogonal weights of the last layers are multiplied by.
        gain: f64,
    },
}

/// A declared hierarchy with its networks: the policy of a team.
#[derive(Debug, Clone)]
pub struct Hierarchy {
    parts: Arc<Parts>,
}

/// Everything about a hierarchy that does not change while it acts.
#[derive(Debug)]
pub(crate) struct Parts {
    pub(crate) spec: EnvironmentSpec,
    pub(crate) prior: Arc<dyn PriorKnowledge>,
    pub(crate) declaration: Declaration,
    pub(crate) layout: ParameterLayout,
    pub(crate) style: NetworkStyle,
    /// Of each level; nothing where there is no choice, or all choices are equally likely.
    pub(crate) banks: Vec<Option<Bank>>,
}

/// The weights of all banks in the form that rows are computed with.
pub(crate) type Weights = Vec<Option<RecurrentWeights<f32>>>;

impl Hierarchy {
    /// The hierarchy that `declaration` declares, for a world of the given sizes.
    ///
    /// # Panics
    /// If the declaration is for another team.
    #[must_use]
    pub fn new(
        declaration: Declaration,
        spec: &EnvironmentSpec,
        prior: &Arc<dyn PriorKnowledge>,
        settings: HierarchySettings,
    ) -> Self {
        assert_eq!(
            [declaration.agents(), declaration.actions()],
            [spec.agents, spec.actions],
            "the declared team is that of the world"
        );
        let mut layout = ParameterLayout::new();
        let banks = declaration.levels().iter().map(|level| {
            let bank = || Bank::new(&mut layout, level, spec, prior, settings);
            level.is_learned().then(bank)
        });
        let banks = banks.collect();
        Self {
            parts: Arc::new(Parts {
                spec: spec.clone(),
                prior: Arc::clone(prior),
                declaration,
                layout,
                style: settings.networks,
                banks,
            }),
        }
    }

    /// Its levels of groups.
    #[must_use]
    pub fn declaration(&self) -> &Declaration {
        &self.parts.declaration
    }
}

impl Parts {
    /// The weights under `parameters`, packed once for each version of them.
    pub(crate) fn weights<'a>(&self, parameters: &'a Parameters) -> &'a Weights {
        parameters.prepared(|values| {
            let banks = self.banks.iter();
            let weights = banks.map(|bank| bank.as_ref().map(|bank| bank.network.weights(values)));
            weights.collect::<Weights>()
        })
    }

    /// ε of a level's choices, if exploration is `exploration`. The paper explores at the second and the third level only.
    pub(crate) fn epsilon(&self, level: usize, exploration: f32) -> f32 {
        if self.declaration.levels()[level].explores {
            exploration
        } else {
            0.0
        }
    }
}

impl Policy for Hierarchy {
    fn layout(&self) -> &ParameterLayout {
        &self.parts.layout
    }

    fn description(&self) -> Vec<ControllerDescription> {
        let levels = self.parts.declaration.levels().iter();
        let banks = levels.zip(&self.parts.banks);
        let learned = banks.filter_map(|(level, bank)| Some((level, bank.as_ref()?)));
        learned.map(|(level, bank)| bank.describe(level)).collect()
    }

    fn metrics(&self) -> Vec<(String, String)> {
        self.parts.metrics()
    }

    fn partitions(&self) -> Vec<Vec<Vec<AgentId>>> {
        let declaration = &self.parts.declaration;
        let divisions = declaration.levels()[TEAM].divisions_gd.first();
        let members = |part: &Part| declaration.members(*part).to_vec();
        let divided = divisions.into_iter().flatten();
        divided
            .map(|division| division.parts.iter().map(members).collect())
            .collect()
    }

    fn initialise(&self, seed: u64) -> Vec<f32> {
        let key = EpisodeKey::new(seed, Stream::Other, 0);
        let mut parameters = vec![0.0; self.parts.layout.len()];
        let levels = self.parts.declaration.levels().iter();
        for (level, bank) in levels.zip(&self.parts.banks) {
            let Some(bank) = bank else {
                continue;
            };
            let network = &bank.network;
            match self.parts.style {
                NetworkStyle::Plain => network.initialise(&key, &mut parameters),
                NetworkStyle::Normalised { gain } => {
                    network.initialise_orthogonally(&key, gain, &mut parameters);
                }
            }
            if level.delegation_logit != 0.0 {
                let divide = &mut parameters[network.logit_biases().start];
                *divide += <f32 as crate::Real>::from_f64(level.delegation_logit);
            }
        }
        parameters
    }

    fn actor(&self, environments: usize) -> Box<dyn Actor> {
        Box::new(TeamActor::new(Arc::clone(&self.parts), environments))
    }

    fn executor(&self, agent: AgentId) -> Box<dyn Executor> {
        Box::new(AgentExecutor::new(Arc::clone(&self.parts), agent))
    }

    fn draws_when_greedy(&self) -> bool {
        let declaration = &self.parts.declaration;
        let mut levels = declaration.levels().iter();
        !declaration.is_fixed() || levels.any(|level| level.divisions > 1 && !level.is_learned())
    }

    fn is_drawn(&self, controller: &ControllerId) -> bool {
        let declaration = &self.parts.declaration;
        let mut levels = declaration.levels().iter();
        let level = levels.find(|level| level.name == controller.name);
        !declaration.is_fixed() && level.is_some_and(|level| level.memory == Memory::WhileFormed)
    }
}
