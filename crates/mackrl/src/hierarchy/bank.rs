//! A bank: the controllers of one level, which share a network, and what they read.

use std::sync::Arc;

use mackrl_env::{Action, AgentId, EnvironmentSpec, KnownEntities, LocalView, PriorKnowledge};

use crate::{
    common_knowledge::{GroupEncoder, joint_mask},
    experience::Rows,
    hierarchy::{HierarchySettings, NetworkStyle},
    nn::{NetworkSizes, ParameterLayout, RecurrentNetwork, normalise_rows},
    policy::{ControllerDescription, Delegation, Level, Memory, Reads},
};

/// The network of a level and the encoding of its inputs.
#[derive(Debug, Clone)]
pub(crate) struct Bank {
    pub(crate) network: RecurrentNetwork,
    /// Whether inputs are normalised.
    normalises: bool,
    /// Whether rows may join after the first step.
    joining: bool,
    /// Of a level that reads common knowledge.
    encoder: Option<GroupEncoder>,
    agents: usize,
    observation_size: usize,
}

impl Bank {
    /// Adds the network's parameters to `layout`.
    pub(crate) fn new(
        layout: &mut ParameterLayout,
        level: &Level,
        spec: &EnvironmentSpec,
        prior: &Arc<dyn PriorKnowledge>,
        settings: HierarchySettings,
    ) -> Self {
        let (features, hidden) = (settings.common_knowledge, settings.hidden);
        let encoder = (level.reads != Reads::OwnObservation)
            .then(|| GroupEncoder::new(features, level.size(), spec, Arc::clone(prior)));
        let encoded = encoder.as_ref().map_or(0, GroupEncoder::size);
        let inputs = match level.reads {
            Reads::CommonKnowledge => encoded,
            Reads::CommonKnowledgeAndMembers => encoded + level.size() * spec.agents,
            Reads::OwnObservation => spec.observation_size + spec.agents + spec.actions,
        };
        let sizes = NetworkSizes {
            inputs,
            hidden,
            outputs: level.columns(spec.actions),
        };
        let mut network = RecurrentNetwork::new(layout, level.name, sizes);
        let normalises = settings.networks != NetworkStyle::Plain;
        if normalises {
            network = network.with_normalisation();
        }
        Self {
            network,
            normalises,
            joining: level.memory == Memory::WhileFormed,
            encoder,
            agents: spec.agents,
            observation_size: spec.observation_size,
        }
    }

    /// What the network of `level` is made of.
    pub(crate) fn describe(&self, level: &Level) -> ControllerDescription {
        let NetworkSizes {
            inputs,
            hidden,
            outputs,
        } = self.network.sizes();
        let members = ("members", level.size() * self.agents);
        let encoded = self.encoder.as_ref().map(GroupEncoder::parts);
        let mut parts = encoded.unwrap_or_default();
        match level.reads {
            Reads::CommonKnowledge => {}
            Reads::CommonKnowledgeAndMembers => parts.push(members),
            Reads::OwnObservation => {
                let last_action = inputs - self.observation_size - self.agents;
                parts.push(("observation", self.observation_size));
                parts.push(members);
                parts.push(("last_action", last_action));
            }
        }
        ControllerDescription {
            name: level.name,
            groups: level.groups.clone(),
            inputs: parts,
            hidden,
            divisions: level.divisions,
            joint_actions: outputs - level.divisions,
            acts: level.acts,
            explores: level.explores,
            memory: level.memory,
            normalised: self.normalises,
        }
    }

    /// Room for what the bank reads.
    pub(crate) fn rows(&self, groups: usize, selective: bool) -> Rows {
        let sizes = self.network.sizes();
        let rows = Rows::new([groups, sizes.inputs, sizes.outputs], selective);
        if self.joining {
            rows.that_may_join()
        } else {
            rows
        }
    }

    /// Writes the row of a group that reads common knowledge: what it commonly knows and who its members are, and, if it is
    /// asked for its choice, which divisions and which joint actions are commonly known to be available.
    ///
    /// `known` is the common knowledge of the group, found by whichever member computes this; all write the same bits.
    pub(crate) fn write_group(
        &self,
        level: &Level,
        group: usize,
        known: KnownEntities<'_>,
        available_ga: &mut [bool],
        (input, mask): (&mut [f32], Option<&mut [bool]>),
    ) {
        let encoder = self
            .encoder
            .as_ref()
            .expect("the level reads common knowledge");
        let members = &level.groups[group];
        let (knowledge, identities) = input.split_at_mut(encoder.size());
        encoder.write_availability(known, members, available_ga);
        encoder.encode(known, members, available_ga, knowledge);
        if level.reads == Reads::CommonKnowledgeAndMembers {
            write_identities(identities, self.agents, members);
        }
        self.normalise(input);
        let Some(mask) = mask else {
            return;
        };
        let Some(delegation) = level.acts else {
            mask.fill(true);
            return;
        };
        let actions = available_ga.len() / members.len();
        if level.survives {
            rest_the_dead(actions, available_ga);
        }
        joint_mask(available_ga, actions, level.divisions, mask);
        let (divide, joint) = mask.split_at_mut(level.divisions);
        match delegation {
            Delegation::Learned => {}
            Delegation::Always => joint.fill(false),
            Delegation::Never => divide.fill(!joint.contains(&true)),
        }
    }

    /// Writes the row of an agent: its observation, its identity and its last action (zeros at the first step), and which
    /// actions are available.
    pub(crate) fn write_agent(
        &self,
        view: LocalView<'_>,
        last_action: Option<Action>,
        (input, mask): (&mut [f32], Option<&mut [bool]>),
    ) {
        let (observation, rest) = input.split_at_mut(self.observation_size);
        let (identity, previous) = rest.split_at_mut(self.agents);
        observation.copy_from_slice(view.observation());
        write_one_hot(identity, Some(view.agent().index()));
        write_one_hot(previous, last_action.map(Action::index));
        self.normalise(input);
        if let Some(mask) = mask {
            mask.copy_from_slice(view.available());
        }
    }
}

impl Bank {
    /// Normalises a row, if the networks are of that style.
    fn normalise(&self, input: &mut [f32]) {
        if self.normalises {
            normalise_rows(input.len(), input);
        }
    }
}

/// Gives members that have no action, the dead, action 0 in its place: nothing depends on it.
fn rest_the_dead(actions: usize, available_ga: &mut [bool]) {
    for available_a in available_ga.chunks_mut(actions) {
        if !available_a.contains(&true) {
            available_a[0] = true;
        }
    }
}

/// All zeros, with a one at `index` if there is one.
fn write_one_hot(out: &mut [f32], index: Option<usize>) {
    out.fill(0.0);
    if let Some(index) = index {
        out[index] = 1.0;
    }
}

/// One-hot identities of a group's members, one after the other.
fn write_identities(out: &mut [f32], agents: usize, group: &[AgentId]) {
    for (member, identity) in group.iter().zip(out.chunks_mut(agents)) {
        write_one_hot(identity, Some(member.index()));
    }
}
