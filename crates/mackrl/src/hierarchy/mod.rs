//! The controllers of pairwise MACKRL and the sampler that walks down them (Table 1, Algorithm 1, Figure 2).
//!
//! | level | controller | reads | chooses |
//! |---|---|---|---|
//! | 1 | pair selector | common knowledge of the team | a partition into pairs |
//! | 2 | pair controller | common knowledge of the pair, who they are | a joint action, or to delegate |
//! | 3 | agent controller | its own observation and last action, who it is | its own action |
//!
//! All three write their log-probabilities into one table, with masks and exploration applied. The sampler and the marginal
//! likelihood both read that table, so the probability that is differentiated is the one that was sampled from. The choice
//! of partition or of delegation is never an input of a later step: p(u) marginalises over it, and a policy that depends on
//! the path would make that marginal's gradient biased (Table 1 of the paper lists it; the authors' code has none either).

mod actor;
pub(crate) mod agent_controller;
pub(crate) mod controller;
pub(crate) mod pair_controller;
pub(crate) mod pair_selector;
mod sampling;
pub(crate) mod statistics;
pub(crate) mod thought;

use std::sync::Arc;

use mackrl_env::{EnvironmentSpec, EpisodeKey, PriorKnowledge, Stream};
use serde::{Deserialize, Serialize};

use self::{
    actor::PairwiseActor, agent_controller::AgentController, pair_controller::PairController,
    pair_selector::PairSelector,
};
pub use self::{
    pair_controller::Delegation,
    sampling::{PairChoice, Path, Sampler},
};
use crate::{
    Error,
    common_knowledge::CommonKnowledgeFeatures,
    nn::ParameterLayout,
    partition::{Pair, PartitionSchedule, Partitions},
    policy::{Actor, Policy, PolicyShape, Weights},
};

/// What the hierarchy is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct HierarchySettings {
    /// What controllers read of common knowledge.
    pub common_knowledge: CommonKnowledgeFeatures,
    /// Which partitions there are.
    pub partitions: PartitionSchedule,
    /// When pairs may delegate.
    pub delegation: Delegation,
    /// H: width of the hidden layers and of the recurrent state, at least 1.
    pub hidden: usize,
}

/// The policy of pairwise MACKRL.
#[derive(Debug, Clone)]
pub struct PairwiseMackrl {
    pub(crate) hierarchy: Arc<Hierarchy>,
}

/// Everything about the hierarchy that does not change while it acts.
#[derive(Debug)]
pub(crate) struct Hierarchy {
    pub(crate) spec: EnvironmentSpec,
    pub(crate) shape: PolicyShape,
    pub(crate) prior: Arc<dyn PriorKnowledge>,
    pub(crate) partitions: Partitions,
    /// The pairs that some partition contains, ascending.
    pub(crate) active_pairs: Vec<Pair>,
    pub(crate) layout: ParameterLayout,
    pub(crate) selector: Option<PairSelector>,
    pub(crate) pairs: PairController,
    pub(crate) agents: AgentController,
}

impl PairwiseMackrl {
    /// The hierarchy for a world of the given sizes; sampled partitions are drawn from `seed`.
    ///
    /// # Errors
    /// [`Error::Config`] if the team is too large for the schedule of partitions.
    pub fn new(
        spec: &EnvironmentSpec,
        prior: Arc<dyn PriorKnowledge>,
        settings: &HierarchySettings,
        seed: u64,
    ) -> Result<Self, Error> {
        let partitions = settings.partitions.plan(spec.agents, seed)?;
        let mut layout = ParameterLayout::new();
        let selector = (partitions.count() > 1).then(|| {
            PairSelector::new(
                &mut layout,
                spec,
                Arc::clone(&prior),
                settings,
                partitions.count(),
            )
        });
        let pairs = PairController::new(&mut layout, spec, Arc::clone(&prior), settings);
        let agents = AgentController::new(&mut layout, spec, settings.hidden);
        let hierarchy = Hierarchy {
            spec: spec.clone(),
            shape: PolicyShape {
                agents: spec.agents,
                actions: spec.actions,
            },
            prior,
            active_pairs: partitions.possible_pairs(),
            partitions,
            layout,
            selector,
            pairs,
            agents,
        };
        Ok(Self {
            hierarchy: Arc::new(hierarchy),
        })
    }
}

impl Policy for PairwiseMackrl {
    fn layout(&self) -> &ParameterLayout {
        &self.hierarchy.layout
    }

    fn initialise(&self, seed: u64) -> Vec<f32> {
        let Hierarchy {
            layout,
            selector,
            pairs,
            agents,
            ..
        } = &*self.hierarchy;
        let key = initialisation_key(seed);
        let mut parameters = vec![0.0; layout.len()];
        let upper = selector
            .iter()
            .map(PairSelector::controller)
            .chain([pairs.controller()]);
        for controller in upper.chain([agents.controller()]) {
            controller.initialise(&key, &mut parameters);
        }
        parameters
    }

    fn weights(&self, parameters: &[f32]) -> Weights {
        let Hierarchy {
            selector,
            pairs,
            agents,
            ..
        } = &*self.hierarchy;
        let selector = selector.as_ref().map(PairSelector::controller);
        Weights {
            selector: selector.map(|controller| controller.weights(parameters)),
            pairs: Some(pairs.controller().weights(parameters)),
            agents: agents.controller().weights(parameters),
        }
    }

    fn refresh(&self, parameters: &[f32], weights: &mut Weights) {
        let Hierarchy {
            selector,
            pairs,
            agents,
            ..
        } = &*self.hierarchy;
        if let (Some(selector), Some(weights)) = (selector, &mut weights.selector) {
            selector.controller().refresh(parameters, weights);
        }
        if let Some(weights) = &mut weights.pairs {
            pairs.controller().refresh(parameters, weights);
        }
        agents.controller().refresh(parameters, &mut weights.agents);
    }

    fn actor(&self, environments: usize) -> Box<dyn Actor> {
        Box::new(PairwiseActor::new(
            Arc::clone(&self.hierarchy),
            environments,
        ))
    }
}

/// Names the draws of a policy's initial parameters.
pub(crate) const fn initialisation_key(seed: u64) -> EpisodeKey {
    EpisodeKey::new(seed, Stream::Other, 0)
}
