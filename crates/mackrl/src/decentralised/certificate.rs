//! The certificate: a trained team's central run equals N agents that exchange nothing.
//!
//! Two checks, each over whole episodes, sampled and greedy:
//!
//! 1. **Separate agents.** Each agent, reached through an [`AgentLink`] (another process, for `mackrl certify`), gets its own
//!    local views and nothing else. Its every action must equal the central run's, and so must the bits that its controllers
//!    read.
//! 2. **Altered worlds.** The central run itself is repeated once per agent in a world in which everything that the agent does
//!    not see is replaced by noise: the state, unseen entities, all others' observations and available actions, what others see
//!    beyond it. The agent's actions must not change. This catches code that reads what it must not, however it got there.
//!    Whether an unseen agent is alive is kept, since it decides only which rows are computed.

use mackrl_env::{
    Action, AgentId, Draw, EntityId, EntitySet, Environment, EnvironmentSpec, EpisodeKey,
    Observations, StepError, Stream,
};
use serde::{Deserialize, Serialize};

use super::message::{Answer, Request, ViewMessage, fingerprints};
use crate::{
    Error,
    experience::{ATTEMPTS_MAX, Experience},
    policy::{
        Behaviour, ControllerId, ControllerInput, Mode, Parameters, Policy, Recording, Situation,
    },
};

/// An agent that can be asked for its actions.
pub trait AgentLink {
    /// Tells the agent something and, unless an episode begins, waits for its answer.
    ///
    /// # Errors
    /// [`Error::Data`] if the agent cannot be reached or says something that cannot be understood.
    fn ask(&mut self, request: Request) -> Result<Option<Answer>, Error>;
}

/// Which check found a difference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Check {
    /// An agent on its own chose or read something else than the central run.
    SeparateAgents,
    /// An agent's action depends on what it does not see.
    AlteredWorlds,
}

/// What was compared, and what was found.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Episodes played in each mode, sampled and greedy.
    pub episodes: usize,
    /// Environment steps of both modes.
    pub steps: u64,
    /// Actions of separate agents that were compared.
    pub actions_compared: u64,
    /// Inputs of controllers that were compared, bit for bit.
    pub inputs_compared: u64,
    /// Actions in altered worlds that were compared.
    pub altered_actions_compared: u64,
    /// Comparisons of either check that failed; 0 if the run is decentralised.
    pub mismatches: u64,
    /// Those of them that were found in altered worlds.
    pub mismatches_in_altered_worlds: u64,
    /// The first difference.
    pub first_mismatch: Option<CounterExample>,
}

/// One difference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CounterExample {
    /// Which check found it.
    pub check: Check,
    /// Sampled or greedy.
    pub mode: Mode,
    /// Number of the episode, from 0.
    pub episode: u64,
    /// Step of the episode, from 0.
    pub step: usize,
    /// Whose action or input differs.
    pub agent: AgentId,
    /// The controller that read something else, if one did.
    pub controller: Option<ControllerId>,
    /// What the agent does in the central run.
    pub central_action: Action,
    /// What it does on its own, or in the altered world.
    pub agent_action: Action,
    /// The first input that differs, if one does.
    pub differing_input: Option<DifferingInput>,
}

/// One number that a controller reads differently.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DifferingInput {
    /// Whose input.
    pub controller: ControllerId,
    /// Place among its inputs.
    pub index: usize,
    /// What the central run reads there.
    pub central: f32,
    /// What the agent reads there.
    pub agent: f32,
}

/// What is to be certified.
#[expect(
    missing_debug_implementations,
    reason = "links and worlds are not shown"
)]
pub struct Subject<'a, 'l> {
    /// The policy as the central run uses it.
    pub policy: &'a dyn Policy,
    /// Its parameters.
    pub parameters: &'a Parameters,
    /// A world to play in.
    pub environment: &'a mut dyn Environment,
    /// The agents, one link each.
    pub links: &'a mut [Box<dyn AgentLink + 'l>],
    /// Seed of the episodes.
    pub seed: u64,
    /// How choices are made in the first of the two modes: sampled.
    pub sampled: Behaviour,
}

/// One episode of the central run: what there was to see, and what was done.
struct Recorded {
    observations_t: Vec<Observations>,
    actions_tn: Vec<Vec<Action>>,
}

/// Where a comparison stands.
#[derive(Clone, Copy)]
struct Place {
    mode: Mode,
    key: EpisodeKey,
    step: usize,
}

impl Subject<'_, '_> {
    /// Plays `episodes` episodes in each mode, both checks on each; `progress` hears how many of all are done.
    ///
    /// # Errors
    /// If an agent cannot be reached, or an environment refuses an action.
    pub fn certify(
        &mut self,
        episodes: usize,
        mut progress: impl FnMut(usize, usize),
    ) -> Result<Certificate, Error> {
        let mut certificate = Certificate {
            episodes,
            ..Certificate::default()
        };
        let mut done = 0;
        for behaviour in [self.sampled, Behaviour::GREEDY] {
            for episode in 0..episodes as u64 {
                let key = EpisodeKey::new(self.seed, Stream::Evaluation, episode);
                let recorded = self.record(key, behaviour, &mut certificate)?;
                self.compare_altered_worlds(key, behaviour, &recorded, &mut certificate)?;
                done += 1;
                progress(done, 2 * episodes);
            }
        }
        Ok(certificate)
    }

    /// Plays an episode, again from its beginning if the world fails under it; what was compared in vain does not count.
    fn record(
        &mut self,
        key: EpisodeKey,
        behaviour: Behaviour,
        certificate: &mut Certificate,
    ) -> Result<Recorded, Error> {
        let mut attempts = 0;
        loop {
            let mut attempt = certificate.clone();
            attempts += 1;
            match self.compare_separate_agents(key, behaviour, &mut attempt) {
                Err(Error::Step(StepError::Interrupted(failure)))
                    if failure.can_be_repeated && attempts < ATTEMPTS_MAX => {}
                outcome => {
                    *certificate = attempt;
                    return outcome;
                }
            }
        }
    }

    /// Plays an episode centrally and by separate agents at once.
    fn compare_separate_agents(
        &mut self,
        key: EpisodeKey,
        behaviour: Behaviour,
        certificate: &mut Certificate,
    ) -> Result<Recorded, Error> {
        let spec = self.environment.spec().clone();
        let mut observations = Observations::new(&spec, 1);
        let mut actor = self.policy.actor(1);
        let mut recorded = Recorded {
            observations_t: Vec::new(),
            actions_tn: Vec::new(),
        };
        let mut experience = Experience::default();
        actor.begin(Recording::Off, &mut experience);
        for link in &mut *self.links {
            link.ask(Request::Begin { key, behaviour })?;
        }
        self.environment.reset(key, &mut observations.row_mut(0));
        for step in 0.. {
            let mut action_n = vec![Action::default(); spec.agents];
            let situation = situation(step, &key, &observations, behaviour);
            actor.act(self.parameters, situation, &mut experience, &mut action_n)?;
            let central = actor.controller_inputs(&experience, 0);
            let place = Place {
                mode: behaviour.mode,
                key,
                step,
            };
            for agent in (0..spec.agents).map(AgentId::new) {
                let view = ViewMessage::from(observations.local_view(0, agent));
                let link = &mut *self.links[agent.index()];
                let action = action_n[agent.index()];
                compare_agent(link, place, agent, view, action, &central, certificate)?;
            }
            recorded.observations_t.push(observations.clone());
            let time_step = self
                .environment
                .step(&action_n, &mut observations.row_mut(0))?;
            recorded.actions_tn.push(action_n);
            certificate.steps += 1;
            if time_step.end.is_some() {
                break;
            }
        }
        Ok(recorded)
    }

    /// Repeats the central run of an episode for each agent, in a world that is the same for that agent alone.
    fn compare_altered_worlds(
        &self,
        key: EpisodeKey,
        behaviour: Behaviour,
        recorded: &Recorded,
        certificate: &mut Certificate,
    ) -> Result<(), Error> {
        let spec = self.environment.spec();
        for agent in (0..spec.agents).map(AgentId::new) {
            let mut actor = self.policy.actor(1);
            let mut experience = Experience::default();
            actor.begin(Recording::Off, &mut experience);
            let steps = recorded
                .observations_t
                .iter()
                .zip(&recorded.actions_tn)
                .enumerate();
            for (step, (observations, action_n)) in steps {
                let mut altered = observations.clone();
                alter_unseen(&mut altered, spec, agent, &key, step);
                let mut altered_n = vec![Action::default(); spec.agents];
                let situation = situation(step, &key, &altered, behaviour);
                actor.act(self.parameters, situation, &mut experience, &mut altered_n)?;
                certificate.altered_actions_compared += 1;
                let (central, found) = (action_n[agent.index()], altered_n[agent.index()]);
                if central != found {
                    certificate.mismatches_in_altered_worlds += 1;
                    certificate.note(|| CounterExample {
                        check: Check::AlteredWorlds,
                        mode: behaviour.mode,
                        episode: key.episode,
                        step,
                        agent,
                        controller: None,
                        central_action: central,
                        agent_action: found,
                        differing_input: None,
                    });
                }
            }
        }
        Ok(())
    }
}

impl Certificate {
    /// Counts a mismatch and keeps it if it is the first.
    fn note(&mut self, counter_example: impl FnOnce() -> CounterExample) {
        self.mismatches += 1;
        self.first_mismatch.get_or_insert_with(counter_example);
    }
}

/// Asks one agent for its action and compares it, and what its controllers read, with the central run.
fn compare_agent(
    link: &mut dyn AgentLink,
    place: Place,
    agent: AgentId,
    view: ViewMessage,
    central_action: Action,
    central_inputs: &[ControllerInput],
    certificate: &mut Certificate,
) -> Result<(), Error> {
    let answer = link.ask(Request::Look {
        step: place.step,
        view,
    })?;
    let Some(Answer::Action {
        action,
        fingerprints: own,
    }) = answer
    else {
        return Err(Error::Data(format!(
            "agent {agent} did not answer with an action"
        )));
    };
    let central = fingerprints(central_inputs);
    let mut differing = None;
    for (controller, fingerprint) in &own {
        // The central run drops controllers of the dead, whose choice is forced; an agent cannot always know.
        let Some((_, central)) = central.iter().find(|(other, _)| other == controller) else {
            continue;
        };
        certificate.inputs_compared += 1;
        if central != fingerprint {
            differing.get_or_insert_with(|| controller.clone());
        }
    }
    certificate.actions_compared += 1;
    if action == central_action && differing.is_none() {
        return Ok(());
    }
    let differing_input = match &differing {
        Some(controller) => locate_difference(link, controller, central_inputs)?,
        None => None,
    };
    certificate.note(|| CounterExample {
        check: Check::SeparateAgents,
        mode: place.mode,
        episode: place.key.episode,
        step: place.step,
        agent,
        controller: differing,
        central_action,
        agent_action: action,
        differing_input,
    });
    Ok(())
}

/// Finds the first input of `controller` that the agent reads differently.
fn locate_difference(
    link: &mut dyn AgentLink,
    controller: &ControllerId,
    central_inputs: &[ControllerInput],
) -> Result<Option<DifferingInput>, Error> {
    let Some(Answer::Inputs(own)) = link.ask(Request::Explain)? else {
        return Err(Error::Data(
            "an agent did not answer with its inputs".into(),
        ));
    };
    let values = |inputs: &[ControllerInput]| {
        let input = inputs.iter().find(|input| input.controller == *controller);
        input.map(|input| input.values.clone()).unwrap_or_default()
    };
    let (central, agent) = (values(central_inputs), values(&own));
    let differing = central
        .iter()
        .zip(&agent)
        .position(|(a, b)| a.to_bits() != b.to_bits());
    Ok(differing.map(|index| DifferingInput {
        controller: controller.clone(),
        index,
        central: central[index],
        agent: agent[index],
    }))
}

/// One environment's situation.
fn situation<'a>(
    step: usize,
    key: &'a EpisodeKey,
    observations: &'a Observations,
    behaviour: Behaviour,
) -> Situation<'a> {
    let keys = std::slice::from_ref(key);
    Situation {
        step,
        playing: &[0],
        keys,
        observations,
        behaviour,
    }
}

/// Replaces everything that `agent` does not see by noise.
fn alter_unseen(
    observations: &mut Observations,
    spec: &EnvironmentSpec,
    agent: AgentId,
    key: &EpisodeKey,
    step: usize,
) {
    let mut noise = Noise {
        key: *key,
        step,
        draws: agent.index() << 20,
    };
    let seen = observations.visible(0)[agent.index()];
    let row = observations.row_mut(0);
    noise.fill(row.state_g);
    for (entity, features) in row.entity_mf.chunks_mut(spec.entity_features).enumerate() {
        if !seen.contains(EntityId::new(entity)) {
            noise.fill(features);
        }
    }
    for other in (0..spec.agents)
        .map(AgentId::new)
        .filter(|&other| other != agent)
    {
        let n = other.index();
        noise.fill(part(row.observation_no, n, spec.observation_size));
        let available_a = part(row.available_na, n, spec.actions);
        available_a.fill_with(|| noise.uniform() < 0.5);
        available_a[spec.actions - 1] = true;
        if !row.visible_n[n].is_empty() {
            // What is common to the two follows from what the agent sees, but only if it sees the other.
            let kept = if seen.contains(other) {
                seen
            } else {
                EntitySet::EMPTY
            };
            let beyond = (0..spec.entities)
                .map(EntityId::new)
                .filter(|_| noise.uniform() < 0.5);
            let beyond = beyond.collect::<EntitySet>().difference(kept);
            row.visible_n[n] = row.visible_n[n].intersection(kept).union(beyond);
            row.visible_n[n].insert(other);
        }
    }
}

/// Numbers that have nothing to do with the game.
struct Noise {
    key: EpisodeKey,
    step: usize,
    draws: usize,
}

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.draws += 1;
        self.key.uniform(self.step, Draw::World(self.draws))
    }

    /// Fills with numbers in [0, 32), the range of positions.
    #[expect(clippy::cast_possible_truncation, reason = "noise may be rounded")]
    fn fill(&mut self, values: &mut [f32]) {
        values.fill_with(|| (32.0 * self.uniform()) as f32);
    }
}

fn part<T>(all: &mut [T], index: usize, len: usize) -> &mut [T] {
    &mut all[index * len..(index + 1) * len]
}
