//! The central run, step by step, and the keys of an episode.

use mackrl_env::{Action, AgentId, Draw, EntitySet, EpisodeKey, Observations, Stream};

use super::computed::Computed;
use crate::{
    Error,
    experience::Experience,
    policy::{Actor, Behaviour, ControllerInput, Parameters, Policy, Recording, Situation},
};

/// The names of an episode.
#[derive(Debug, Clone, Copy)]
pub(super) struct Keys {
    /// From which the world draws.
    pub(super) world: EpisodeKey,
    /// From which controllers draw; agents are told this one alone.
    pub(super) choices: EpisodeKey,
    /// Another one, from which they might have drawn.
    pub(super) other: EpisodeKey,
}

impl Keys {
    pub(super) fn new(seed: u64, episode: u64) -> Self {
        let derived = |number: usize| {
            let name = EpisodeKey::new(seed, Stream::Other, 0);
            EpisodeKey::new(
                name.bits(0, Draw::Setup((1 << 27) + number)),
                Stream::Other,
                episode,
            )
        };
        Self {
            world: EpisodeKey::new(seed, Stream::Evaluation, episode),
            choices: derived(0),
            other: derived(1),
        }
    }
}

/// The central run at work in one episode.
pub(super) struct Central<'a> {
    actor: Box<dyn Actor>,
    experience: Experience,
    parameters: &'a Parameters,
    agents: usize,
}

impl<'a> Central<'a> {
    pub(super) fn begin(policy: &dyn Policy, parameters: &'a Parameters, agents: usize) -> Self {
        let mut actor = policy.actor(1);
        let mut experience = Experience::default();
        actor.begin(Recording::Off, &mut experience);
        Self {
            actor,
            experience,
            parameters,
            agents,
        }
    }

    /// Plays one step.
    pub(super) fn act(
        &mut self,
        step: usize,
        key: &EpisodeKey,
        observations: &Observations,
        behaviour: Behaviour,
    ) -> Result<Vec<Action>, Error> {
        let mut action_n = vec![Action::default(); self.agents];
        let situation = Situation {
            step,
            playing: &[0],
            keys: std::slice::from_ref(key),
            observations,
            behaviour,
        };
        self.actor.act(
            self.parameters,
            situation,
            &mut self.experience,
            &mut action_n,
        )?;
        Ok(action_n)
    }

    pub(super) fn inputs(&self) -> Vec<ControllerInput> {
        self.actor.controller_inputs(&self.experience, 0)
    }

    /// What was computed at the latest step, which led to `action_n`, agent by agent; for the dead, who need no controllers, nothing.
    pub(super) fn computed(
        &self,
        observations: &Observations,
        action_n: &[Action],
    ) -> Vec<Computed> {
        let inputs = self.inputs();
        let outputs = self.actor.controller_outputs(&self.experience, 0);
        let agents = action_n.iter().enumerate();
        agents
            .map(|(agent, &action)| match observations.visible(0)[agent] {
                EntitySet::EMPTY => Computed::without_controllers(action),
                _ => Computed::of(AgentId::new(agent), action, &inputs, &outputs),
            })
            .collect()
    }
}
