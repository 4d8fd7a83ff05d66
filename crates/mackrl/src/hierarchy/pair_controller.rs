//! `π_pc`: a pair acts jointly on what it commonly knows, or delegates to its two members (level 2 of Table 1).

use std::sync::Arc;

use mackrl_env::{EnvironmentSpec, KnownEntities, PriorKnowledge, declare_words};

use super::{
    HierarchySettings,
    agent_controller::write_identities,
    controller::{Controller, ControllerMemory},
};
use crate::{
    common_knowledge::{GroupEncoder, joint_mask},
    nn::{NetworkSizes, ParameterLayout},
    partition::Pair,
    policy::{DELEGATE, PolicyShape},
};

/// The pair controllers: one network for all pairs, told the two members.
#[derive(Debug, Clone)]
pub(crate) struct PairController {
    controller: Controller,
    encoder: GroupEncoder,
    shape: PolicyShape,
    delegation: Delegation,
}

declare_words! {
    /// When a pair may delegate; anything but [`Delegation::Learned`] is an ablation.
    pub enum Delegation {
        /// The pair controller decides.
        #[default]
        Learned = "learned",
        /// Always: the team is as good as independent agents with a central critic.
        Always = "always",
        /// Only where the pair commonly knows no joint action.
        Never = "never",
    }
}

impl PairController {
    /// Adds the controller's parameters to `layout`.
    pub(crate) fn new(
        layout: &mut ParameterLayout,
        spec: &EnvironmentSpec,
        prior: Arc<dyn PriorKnowledge>,
        settings: &HierarchySettings,
    ) -> Self {
        let shape = PolicyShape {
            agents: spec.agents,
            actions: spec.actions,
        };
        let encoder = GroupEncoder::new(settings.common_knowledge, 2, spec, prior);
        let sizes = NetworkSizes {
            inputs: encoder.size() + 2 * spec.agents,
            hidden: settings.hidden,
            outputs: shape.columns(),
        };
        Self {
            controller: Controller::new(layout, "pair_controller", sizes),
            encoder,
            shape,
            delegation: settings.delegation,
        }
    }

    /// The network and its softmax.
    pub(crate) const fn controller(&self) -> &Controller {
        &self.controller
    }

    /// Writes one row: what the pair commonly knows and who the members are, and, if it is asked for its choice, which joint
    /// actions are commonly known to be available.
    ///
    /// `known` is the common knowledge of the pair, found by whichever member computes this; both write the same bits.
    pub(crate) fn write_row(
        &self,
        memory: &mut ControllerMemory,
        row: usize,
        known: KnownEntities<'_>,
        pair: Pair,
        available_ga: &mut [bool],
    ) {
        let group = pair.agents();
        let (input, mask) = memory.row_mut(row);
        let (knowledge, identities) = input.split_at_mut(self.encoder.size());
        self.encoder.write_availability(known, &group, available_ga);
        self.encoder.encode(known, &group, available_ga, knowledge);
        write_identities(identities, self.shape.agents, &group);
        let Some(mask) = mask else {
            return;
        };
        joint_mask(available_ga, mask);
        match self.delegation {
            Delegation::Learned => {}
            Delegation::Always => mask[DELEGATE + 1..].fill(false),
            Delegation::Never => mask[DELEGATE] = !mask[DELEGATE + 1..].contains(&true),
        }
    }
}
