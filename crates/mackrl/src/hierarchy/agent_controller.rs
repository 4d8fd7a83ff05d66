//! `π_a`: one agent chooses its own action from its own history (level 3 of Table 1).

use mackrl_env::{Action, AgentId, EnvironmentSpec, LocalView};

use super::controller::{Controller, ControllerMemory};
use crate::nn::{NetworkSizes, ParameterLayout};

/// The agent controllers: one network, told which agent it acts for.
#[derive(Debug, Clone)]
pub(crate) struct AgentController {
    controller: Controller,
    agents: usize,
    actions: usize,
    observation_size: usize,
}

impl AgentController {
    /// Adds the controller's parameters to `layout`.
    pub(crate) fn new(layout: &mut ParameterLayout, spec: &EnvironmentSpec, hidden: usize) -> Self {
        let sizes = NetworkSizes {
            inputs: spec.observation_size + spec.agents + spec.actions,
            hidden,
            outputs: spec.actions,
        };
        Self {
            controller: Controller::new(layout, "agent_controller", sizes),
            agents: spec.agents,
            actions: spec.actions,
            observation_size: spec.observation_size,
        }
    }

    /// The network and its softmax.
    pub(crate) const fn controller(&self) -> &Controller {
        &self.controller
    }

    /// Writes one row: the agent's observation, its identity and its last action (zeros at the first step), and which
    /// actions are available.
    pub(crate) fn write_row(
        &self,
        memory: &mut ControllerMemory,
        row: usize,
        view: LocalView<'_>,
        last_action: Option<Action>,
    ) {
        let (input, mask) = memory.row_mut(row);
        let (observation, rest) = input.split_at_mut(self.observation_size);
        let (identity, previous) = rest.split_at_mut(self.agents);
        observation.copy_from_slice(view.observation());
        write_one_hot(identity, Some(view.agent().index()));
        write_one_hot(previous, last_action.map(Action::index));
        if let Some(mask) = mask {
            mask.copy_from_slice(view.available());
            debug_assert_eq!(mask.len(), self.actions, "an agent's mask is [A]");
        }
    }
}

/// Whether the agent still acts. The dead see nothing, not even themselves; their one available action needs no network.
pub(crate) fn is_alive(view: LocalView<'_>) -> bool {
    !view.seen().set().is_empty()
}

/// The only action of an agent that no longer acts.
pub(crate) fn forced_action(view: LocalView<'_>) -> Action {
    Action::new(
        view.available()
            .iter()
            .position(|&available| available)
            .unwrap_or_default(),
    )
}

/// All zeros, with a one at `index` if there is one.
pub(crate) fn write_one_hot(out: &mut [f32], index: Option<usize>) {
    out.fill(0.0);
    if let Some(index) = index {
        out[index] = 1.0;
    }
}

/// One-hot identities of a group's members, one after the other.
pub(crate) fn write_identities(out: &mut [f32], agents: usize, group: &[AgentId]) {
    for (member, identity) in group.iter().zip(out.chunks_mut(agents)) {
        write_one_hot(identity, Some(member.index()));
    }
}
