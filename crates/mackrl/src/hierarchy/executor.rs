//! One agent alone: its own local views, the weights and the shared seed give its action.
//!
//! The agent runs the controllers of the groups that it belongs to, level by level, and follows the walk into its own groups
//! only. The numbers that it feeds them come from its own view; that its partners compute the same ones is what common
//! knowledge means. No state, no other agent's view and no message can reach this code: [`Executor::act`] has no argument for
//! them.

use std::sync::Arc;

use mackrl_env::{Action, AgentId, EpisodeKey, LocalView};

use super::{
    Parts,
    controllers::{Controllers, StepContext},
    perspective::{Perspective, forced_action, is_alive},
};
use crate::{
    Stopwatch,
    experience::Experience,
    policy::{
        Behaviour, ControllerInput, ControllerOutput, Executor, Parameters, Recording, Sampler,
    },
};

/// Executes one agent of a hierarchy.
pub(super) struct AgentExecutor {
    controllers: Controllers,
    experience: Experience,
    agent: AgentId,
    action_n: Vec<Action>,
    /// Whether the controllers ran at the latest step; those of the dead rest.
    ran: bool,
}

impl AgentExecutor {
    pub(super) fn new(parts: Arc<Parts>, agent: AgentId) -> Self {
        let action_n = vec![Action::default(); parts.declaration.agents()];
        Self {
            controllers: Controllers::new(parts, 1, Some(agent)),
            experience: Experience::default(),
            agent,
            action_n,
            ran: false,
        }
    }
}

impl Executor for AgentExecutor {
    fn begin(&mut self) {
        self.ran = false;
        self.controllers
            .begin(Recording::Off, &mut self.experience.banks);
    }

    fn act(
        &mut self,
        parameters: &Parameters,
        view: LocalView<'_>,
        key: &EpisodeKey,
        step: usize,
        behaviour: Behaviour,
    ) -> Action {
        self.ran = is_alive(view);
        if !self.ran {
            return forced_action(view);
        }
        let parts = Arc::clone(&self.controllers.parts);
        self.controllers.tables[0].note_possible(&parts, key, step);
        let moment = StepContext {
            step,
            playing: &[0],
            exploration: behaviour.exploration,
        };
        let advanced = self.controllers.advance(
            parameters,
            Perspective::One(view, &*parts.prior),
            moment,
            &mut self.experience.banks,
            &mut Stopwatch::default(),
        );
        if advanced.is_err() {
            // There is nothing to choose from; the central run stops with the same error.
            return forced_action(view);
        }
        let sampler = Sampler {
            key: *key,
            step,
            mode: behaviour.mode,
        };
        let tables = &mut self.controllers.tables[0];
        let decision = tables.decision(&parts, key, step);
        sampler.walk(
            &decision.table,
            Some(self.agent),
            &mut self.action_n,
            decision.path,
        );
        let action = self.action_n[self.agent.index()];
        tables.last_action_n[self.agent.index()] = Some(action);
        action
    }

    fn controller_inputs(&self) -> Vec<ControllerInput> {
        if self.ran {
            self.controllers.inputs(&self.experience, 0)
        } else {
            Vec::new()
        }
    }

    fn controller_outputs(&self) -> Vec<ControllerOutput> {
        if self.ran {
            self.controllers.outputs(&self.experience, 0)
        } else {
            Vec::new()
        }
    }
}
