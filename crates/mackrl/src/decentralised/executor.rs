//! One agent alone: its own local views, the weights and the shared seed give its action.
//!
//! The agent runs the pair selector, the pair controllers of the pairs that it belongs to, and its own agent controller. The
//! numbers that it feeds them come from its own view; that its partners compute the same ones is what common knowledge means.
//! No state, no other agent's view and no message can reach this code: [`Executor::act`] has no argument for them.

use std::sync::Arc;

use mackrl_env::{Action, AgentId, EpisodeKey, LocalView};

use super::Executor;
use crate::{
    common_knowledge::common_knowledge_from_view,
    hierarchy::{
        Hierarchy, PairChoice, Sampler,
        agent_controller::{AgentController, forced_action, is_alive},
        controller::ControllerMemory,
    },
    partition::{Pair, PartitionBuffer},
    policy::{Behaviour, ControllerId, ControllerInput, Recording, Weights},
};

/// Executes one agent of pairwise MACKRL.
pub(crate) struct PairwiseExecutor {
    hierarchy: Arc<Hierarchy>,
    own: AgentExecutor,
    selector: Option<ControllerMemory>,
    pairs: ControllerMemory,
    own_pairs: Vec<Pair>,
    partition_buffer: PartitionBuffer,
    pair_available_ga: Vec<bool>,
    team_available_ga: Vec<bool>,
}

impl PairwiseExecutor {
    pub(crate) fn new(hierarchy: Arc<Hierarchy>, agent: AgentId) -> Self {
        let selector = hierarchy.selector.as_ref();
        let own_pairs = hierarchy.active_pairs.iter().copied();
        Self {
            own: AgentExecutor::new(hierarchy.agents.clone(), agent),
            selector: selector.map(|selector| ControllerMemory::new(selector.controller())),
            pairs: ControllerMemory::new(hierarchy.pairs.controller()),
            own_pairs: own_pairs
                .filter(|pair| pair.partner_of(agent).is_some())
                .collect(),
            partition_buffer: PartitionBuffer::default(),
            pair_available_ga: vec![false; 2 * hierarchy.shape.actions],
            team_available_ga: vec![false; hierarchy.shape.agents * hierarchy.shape.actions],
            hierarchy,
        }
    }

    /// Advances the team's pair selector as this agent knows it.
    fn run_selector(&mut self, weights: &Weights, view: LocalView<'_>) {
        let (Some(selector), Some(memory), Some(weights)) = (
            &self.hierarchy.selector,
            &mut self.selector,
            &weights.selector,
        ) else {
            return;
        };
        let prior = &*self.hierarchy.prior;
        let known = common_knowledge_from_view(selector.team(), view.seen(), prior);
        memory.begin_step([0]);
        let known = view.seen().restricted_to(known);
        selector.write_row(memory, 0, known, &mut self.team_available_ga);
        memory.run(selector.controller(), weights, 0.0);
    }

    /// Advances the controllers of the agent's own pairs.
    fn run_pairs(&mut self, weights: &Weights, view: LocalView<'_>, exploration: f32) {
        let Some(weights) = &weights.pairs else {
            return;
        };
        let controller = &self.hierarchy.pairs;
        self.pairs.begin_step(0..self.own_pairs.len());
        for (row, &pair) in self.own_pairs.iter().enumerate() {
            let prior = &*self.hierarchy.prior;
            let known = common_knowledge_from_view(&pair.agents(), view.seen(), prior);
            let known = view.seen().restricted_to(known);
            controller.write_row(
                &mut self.pairs,
                row,
                known,
                pair,
                &mut self.pair_available_ga,
            );
        }
        self.pairs
            .run(controller.controller(), weights, exploration);
    }

    /// The agent's part of what its pair chose, if the chosen partition has it in a pair that acts jointly.
    fn joint_action(&mut self, sampler: &Sampler) -> Option<Action> {
        let Self {
            hierarchy,
            partition_buffer,
            ..
        } = self;
        let partitions =
            hierarchy
                .partitions
                .in_force(&sampler.key, sampler.step, partition_buffer);
        let chosen = match &self.selector {
            Some(memory) => sampler.choose_partition(memory.log_p(0)),
            None => sampler.draw_partition(partitions.len()),
        };
        let mut pairs = partitions[chosen].pairs().iter();
        let pair = *pairs.find(|pair| self.own_pairs.contains(pair))?;
        let row = self.own_pairs.iter().position(|own| *own == pair)?;
        match sampler.choose_pair(pair, hierarchy.shape, self.pairs.log_p(row)) {
            PairChoice::Delegate => None,
            PairChoice::Joint(actions) => {
                let mut members = pair.agents().into_iter().zip(actions);
                members
                    .find(|(member, _)| *member == self.own.agent)
                    .map(|(_, action)| action)
            }
        }
    }
}

impl Executor for PairwiseExecutor {
    fn begin(&mut self) {
        self.own.begin();
        self.pairs.begin(Recording::Off);
        if let Some(memory) = &mut self.selector {
            memory.begin(Recording::Off);
        }
    }

    fn act(
        &mut self,
        weights: &Weights,
        view: LocalView<'_>,
        key: &EpisodeKey,
        step: usize,
        behaviour: Behaviour,
    ) -> Action {
        self.own.ran = is_alive(view);
        if !self.own.ran {
            return forced_action(view);
        }
        self.run_selector(weights, view);
        self.run_pairs(weights, view, behaviour.exploration);
        self.own.run(weights, view, behaviour.exploration);
        let sampler = Sampler {
            key: *key,
            step,
            mode: behaviour.mode,
        };
        let joint = self.joint_action(&sampler);
        let action = joint.unwrap_or_else(|| self.own.choose(&sampler));
        self.own.last_action = Some(action);
        action
    }

    fn controller_inputs(&self) -> Vec<ControllerInput> {
        if !self.own.ran {
            return Vec::new();
        }
        let selector = self.selector.iter();
        let mut inputs: Vec<_> = selector
            .map(|memory| memory.input(0, ControllerId::PairSelector))
            .collect();
        for (row, pair) in self.own_pairs.iter().enumerate() {
            let [first, second] = pair.agents();
            inputs.push(
                self.pairs
                    .input(row, ControllerId::PairController(first, second)),
            );
        }
        inputs.extend(self.own.controller_inputs());
        inputs
    }
}

/// Executes an agent controller alone: all there is of Central-V, and the last level of MACKRL.
pub(crate) struct AgentExecutor {
    controller: AgentController,
    memory: ControllerMemory,
    agent: AgentId,
    last_action: Option<Action>,
    /// Whether the controllers ran at the latest step; those of the dead rest.
    ran: bool,
}

impl AgentExecutor {
    pub(crate) fn new(controller: AgentController, agent: AgentId) -> Self {
        let memory = ControllerMemory::new(controller.controller());
        Self {
            controller,
            memory,
            agent,
            last_action: None,
            ran: false,
        }
    }

    fn run(&mut self, weights: &Weights, view: LocalView<'_>, exploration: f32) {
        self.memory.begin_step([0]);
        self.controller
            .write_row(&mut self.memory, 0, view, self.last_action);
        self.memory
            .run(self.controller.controller(), &weights.agents, exploration);
    }

    fn choose(&self, sampler: &Sampler) -> Action {
        sampler.choose_action(self.agent, self.memory.log_p(0))
    }
}

impl Executor for AgentExecutor {
    fn begin(&mut self) {
        self.memory.begin(Recording::Off);
        self.last_action = None;
        self.ran = false;
    }

    fn act(
        &mut self,
        weights: &Weights,
        view: LocalView<'_>,
        key: &EpisodeKey,
        step: usize,
        behaviour: Behaviour,
    ) -> Action {
        self.ran = is_alive(view);
        if !self.ran {
            return forced_action(view);
        }
        self.run(weights, view, behaviour.exploration);
        let sampler = Sampler {
            key: *key,
            step,
            mode: behaviour.mode,
        };
        let action = self.choose(&sampler);
        self.last_action = Some(action);
        action
    }

    fn controller_inputs(&self) -> Vec<ControllerInput> {
        vec![
            self.memory
                .input(0, ControllerId::AgentController(self.agent)),
        ]
    }
}
