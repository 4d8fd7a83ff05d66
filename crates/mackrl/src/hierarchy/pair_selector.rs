//! `π_ps`: the whole team divides itself into pairs on what all its members commonly know (level 1 of Table 1).

use std::sync::Arc;

use mackrl_env::{AgentId, EnvironmentSpec, KnownEntities, PriorKnowledge, declare_words};

use super::{
    HierarchySettings,
    controller::{Controller, ControllerMemory},
};
use crate::{
    common_knowledge::GroupEncoder,
    nn::{NetworkSizes, ParameterLayout},
};

declare_words! {
    /// How the partition is chosen; anything but [`Selection::Learned`] is an ablation.
    pub enum Selection {
        /// The pair selector decides.
        #[default]
        Learned = "learned",
        /// Each partition in force is as likely as any other, in greedy play too: a draw that all agents share, and no choice.
        Uniform = "uniform",
    }
}

/// The pair selector. It exists only where there is more than one partition to choose from.
#[derive(Debug, Clone)]
pub(crate) struct PairSelector {
    controller: Controller,
    encoder: GroupEncoder,
    team: Vec<AgentId>,
}

impl PairSelector {
    /// Adds the controller's parameters to `layout`; it chooses between `partitions` partitions.
    pub(crate) fn new(
        layout: &mut ParameterLayout,
        spec: &EnvironmentSpec,
        prior: Arc<dyn PriorKnowledge>,
        settings: &HierarchySettings,
        partitions: usize,
    ) -> Self {
        let encoder = GroupEncoder::new(settings.common_knowledge, spec.agents, spec, prior);
        let sizes = NetworkSizes {
            inputs: encoder.size(),
            hidden: settings.hidden,
            outputs: partitions,
        };
        Self {
            controller: Controller::new(layout, "pair_selector", sizes),
            encoder,
            team: (0..spec.agents).map(AgentId::new).collect(),
        }
    }

    /// The network and its softmax.
    pub(crate) const fn controller(&self) -> &Controller {
        &self.controller
    }

    /// The team as a group.
    pub(crate) fn team(&self) -> &[AgentId] {
        &self.team
    }

    /// Writes one row: what the whole team commonly knows. Every partition is available.
    pub(crate) fn write_row(
        &self,
        memory: &mut ControllerMemory,
        row: usize,
        known: KnownEntities<'_>,
        available_ga: &mut [bool],
    ) {
        let (input, mask) = memory.row_mut(row);
        self.encoder
            .write_availability(known, &self.team, available_ga);
        self.encoder.encode(known, &self.team, available_ga, input);
        mask.into_iter().for_each(|mask| mask.fill(true));
    }
}
