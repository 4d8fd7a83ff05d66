//! The certificate: a trained team's central run equals N agents that exchange nothing.
//!
//! Five checks over whole episodes, sampled and greedy, of actions and, bit for bit, of what controllers read and of the
//! log-probabilities that they give:
//!
//! 1. **Separate agents.** Each agent, reached through an [`AgentLink`] (another process, for `mackrl certify`), gets its own
//!    local views and nothing else, and has to tell of every controller of its groups.
//! 2. **Altered worlds.** The central run itself is repeated once per agent in a world in which everything that the agent does
//!    not see is replaced by noise: the state, unseen entities, all others' observations and available actions, what others see
//!    beyond it. This catches code that reads what it must not, however it got there.
//!    Whether an unseen agent is alive is kept, since it decides only which rows are computed.
//! 3. **Unseen numbers.** The agent alone looks at a world in which all that it does not see is no number.
//! 4. **Altered states.** At one step of each episode, for each agent, the *world* is asked to alter its state beyond the agent's
//!    sight: what the agent observes must not change. The checks before take a view for local; this one tests it.
//! 5. **Other key.** The central run is repeated with another key of its choices: as long as an agent has done the same, its
//!    controllers have to compute the same.
//!
//! The key that choices are drawn from is not the key of the world, so that an agent cannot compute the world's dice from what
//! it is given.

use mackrl_env::{Action, AgentId, Draw, Environment, EnvironmentSpec, Observations, StepError};

use super::{
    alteration::{Kind, alter_unseen, is_same_view},
    central::{Central, Keys},
    computed::{Compared, Computed, Difference},
    message::{Answer, Request, ViewMessage},
    report::{Certificate, Check, DifferingInput, Isolation, Place},
};
use crate::{
    Error,
    experience::ATTEMPTS_MAX,
    policy::{Behaviour, ControllerId, ControllerInput, Mode, Parameters, Policy},
};

/// An agent that can be asked for its actions.
pub trait AgentLink {
    /// Tells the agent something and, unless an episode begins, waits for its answer.
    ///
    /// # Errors
    /// [`Error::Data`] if the agent cannot be reached or says something that cannot be understood.
    fn ask(&mut self, request: Request) -> Result<Option<Answer>, Error>;
}

/// Whether a world can be played again from the name of an episode, and so be altered in the middle of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Repetition {
    /// The same key and the same actions give the same episode.
    Exact,
    /// They do not, as in the real game.
    Impossible,
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
    /// Whether the world can be played again.
    pub repetition: Repetition,
    /// The agents, one link each.
    pub links: &'a mut [Box<dyn AgentLink + 'l>],
    /// What keeps the agents apart.
    pub isolation: Isolation,
    /// Seed of the episodes.
    pub seed: u64,
    /// How choices are made in the first of the two modes: sampled.
    pub sampled: Behaviour,
}

/// One episode of the central run: what there was to see, and what was done and computed.
struct Recorded {
    keys: Keys,
    behaviour: Behaviour,
    observations_t: Vec<Observations>,
    actions_tn: Vec<Vec<Action>>,
    computed_tn: Vec<Vec<Computed>>,
}

impl Subject<'_, '_> {
    /// Plays `episodes` episodes in each mode, all checks on each; `progress` is told how many of all are done.
    ///
    /// # Errors
    /// If an agent cannot be reached, or an environment refuses an action; [`Error::Data`] if there was nothing to compare, which
    /// proves nothing.
    pub fn certify(
        &mut self,
        episodes: usize,
        mut progress: impl FnMut(usize, usize),
    ) -> Result<Certificate, Error> {
        let agents = self.environment.spec().agents;
        let mut certificate = Certificate {
            agents,
            isolation: self.isolation,
            episodes,
            ..Certificate::default()
        };
        let mut inputs_n = vec![0_usize; agents];
        let total = episodes.saturating_mul(2);
        let mut done = 0;
        for behaviour in [self.sampled, Behaviour::GREEDY] {
            for episode in 0..episodes as u64 {
                let keys = Keys::new(self.seed, episode);
                let recorded = self.record(keys, behaviour, &mut certificate)?;
                for computed in recorded.computed_tn.iter().flatten().enumerate() {
                    inputs_n[computed.0 % agents] += computed.1.inputs.len();
                }
                self.compare_other_key(&recorded, &mut certificate)?;
                for agent in (0..agents).map(AgentId::new) {
                    self.compare_altered_worlds(agent, &recorded, &mut certificate)?;
                    self.compare_unseen_numbers(agent, &recorded, &mut certificate);
                }
                done += 1;
                progress(done, total);
            }
        }
        match inputs_n.iter().position(|inputs| *inputs == 0) {
            Some(agent) => Err(Error::Data(format!(
                "nothing is certified: no controller of agent {agent} was ever compared"
            ))),
            None => Ok(certificate),
        }
    }

    /// Plays an episode, again from its beginning if the world fails under it; what was compared in vain does not count.
    fn record(
        &mut self,
        keys: Keys,
        behaviour: Behaviour,
        certificate: &mut Certificate,
    ) -> Result<Recorded, Error> {
        let mut attempts = 0;
        loop {
            let mut attempt = certificate.clone();
            attempts += 1;
            match self.compare_separate_agents(keys, behaviour, &mut attempt) {
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
        keys: Keys,
        behaviour: Behaviour,
        certificate: &mut Certificate,
    ) -> Result<Recorded, Error> {
        let spec = self.environment.spec().clone();
        let mut observations = Observations::new(&spec, 1);
        let mut central = Central::begin(self.policy, self.parameters, spec.agents);
        let mut recorded = Recorded {
            keys,
            behaviour,
            observations_t: Vec::new(),
            actions_tn: Vec::new(),
            computed_tn: Vec::new(),
        };
        for link in &mut *self.links {
            let key = keys.choices;
            link.ask(Request::Begin { key, behaviour })?;
        }
        self.environment
            .reset(keys.world, &mut observations.row_mut(0));
        for step in 0.. {
            let action_n = central.act(step, &keys.choices, &observations, behaviour)?;
            let computed_n = central.computed(&observations, &action_n);
            for (agent, computed) in computed_n.iter().enumerate() {
                let agent = AgentId::new(agent);
                let place = recorded.place(Check::SeparateAgents, step, agent);
                let view = ViewMessage::from(observations.local_view(0, agent));
                let link = &mut *self.links[agent.index()];
                let inputs = || central.inputs();
                compare_agent(link, place, view, computed, &inputs, certificate)?;
            }
            recorded.observations_t.push(observations.clone());
            let time_step = self
                .environment
                .step(&action_n, &mut observations.row_mut(0))?;
            recorded.actions_tn.push(action_n);
            recorded.computed_tn.push(computed_n);
            certificate.steps += 1;
            if time_step.end.is_some() {
                break;
            }
        }
        Ok(recorded)
    }

    /// Repeats the central run of an episode in a world that is the same for one agent alone. At one step the world itself makes
    /// it so, if it can.
    fn compare_altered_worlds(
        &mut self,
        agent: AgentId,
        recorded: &Recorded,
        certificate: &mut Certificate,
    ) -> Result<(), Error> {
        let spec = self.environment.spec().clone();
        let altered_at = recorded.step_to_alter(agent);
        let altered_state = self.altered_state(&spec, agent, recorded, altered_at)?;
        if let Some(altered) = &altered_state {
            let check = Check::AlteredStates;
            certificate.count(check, Compared::default());
            if !is_same_view(altered, &recorded.observations_t[altered_at], agent) {
                let action = recorded.actions_tn[altered_at][agent.index()];
                let place = recorded.place(check, altered_at, agent);
                let found = (Difference::Observation, None);
                certificate.note(place, found, [action; 2], None);
            }
        }
        let mut central = Central::begin(self.policy, self.parameters, spec.agents);
        let kind = Kind::of_episode(recorded.keys.world.episode);
        for (step, observations) in recorded.observations_t.iter().enumerate() {
            let altered = match &altered_state {
                Some(altered) if step == altered_at => altered.clone(),
                _ => {
                    let mut altered = observations.clone();
                    let moment = (&recorded.keys.world, step);
                    alter_unseen(&mut altered, &spec, agent, moment, kind);
                    altered
                }
            };
            let key = &recorded.keys.choices;
            let action_n = match central.act(step, key, &altered, recorded.behaviour) {
                // The dead see nothing and do nothing any more: everything is noise, for which a team need not be made.
                Err(Error::Config(_)) if observations.visible(0)[agent.index()].is_empty() => break,
                acted => acted?,
            };
            let found = &central.computed(&altered, &action_n)[agent.index()];
            recorded.compare(Check::AlteredWorlds, step, agent, found, certificate);
        }
        Ok(())
    }

    /// What everybody would observe at step `at` of an episode if the state of the world were another one beyond the sight of
    /// `agent`; nothing, if the world cannot say or nothing is unseen.
    fn altered_state(
        &mut self,
        spec: &EnvironmentSpec,
        agent: AgentId,
        recorded: &Recorded,
        at: usize,
    ) -> Result<Option<Observations>, Error> {
        if self.repetition == Repetition::Impossible {
            return Ok(None);
        }
        let mut observations = Observations::new(spec, 1);
        let row = &mut observations.row_mut(0);
        self.environment.reset(recorded.keys.world, row);
        for action_n in &recorded.actions_tn[..at] {
            self.environment.step(action_n, row)?;
        }
        let is_altered = self
            .environment
            .alter_unseen(agent, recorded.keys.other, row);
        Ok(is_altered.then_some(observations))
    }

    /// Lets an agent alone play an episode in a world in which all that it does not see is no number.
    fn compare_unseen_numbers(
        &self,
        agent: AgentId,
        recorded: &Recorded,
        certificate: &mut Certificate,
    ) {
        let spec = self.environment.spec();
        let mut executor = self.policy.executor(agent);
        executor.begin();
        for (step, observations) in recorded.observations_t.iter().enumerate() {
            let mut altered = observations.clone();
            let moment = (&recorded.keys.world, step);
            alter_unseen(&mut altered, spec, agent, moment, Kind::NotANumber);
            let action = executor.act(
                self.parameters,
                altered.local_view(0, agent),
                &recorded.keys.choices,
                step,
                recorded.behaviour,
            );
            let (inputs, outputs) = (executor.controller_inputs(), executor.controller_outputs());
            let found = Computed::of(agent, action, &inputs, &outputs);
            recorded.compare(Check::UnseenNumbers, step, agent, &found, certificate);
        }
    }

    /// Repeats the central run of an episode with another key. What an agent's controllers compute is a function of what was seen
    /// and of what the agent did; of the key it is none, unless the policy says so of a controller. In greedy play actions are no function of it either, if the policy
    /// says so.
    fn compare_other_key(
        &self,
        recorded: &Recorded,
        certificate: &mut Certificate,
    ) -> Result<(), Error> {
        let agents = self.environment.spec().agents;
        let decides_nothing =
            recorded.behaviour.mode == Mode::Greedy && !self.policy.draws_when_greedy();
        let mut central = Central::begin(self.policy, self.parameters, agents);
        let mut has_done_the_same_n = vec![true; agents];
        let mut histories_n = vec![History::default(); agents];
        for (step, observations) in recorded.observations_t.iter().enumerate() {
            let key = &recorded.keys.other;
            let action_n = central.act(step, key, observations, recorded.behaviour)?;
            for (agent, mut found) in central
                .computed(observations, &action_n)
                .into_iter()
                .enumerate()
            {
                if !has_done_the_same_n[agent] {
                    continue;
                }
                let mut expected = recorded.computed_tn[step][agent].clone();
                has_done_the_same_n[agent] = expected.action == found.action;
                if !decides_nothing {
                    // Other actions may be drawn, other groups be formed, and others be asked.
                    found.action = expected.action;
                    let is_drawn = |own: &ControllerId| self.policy.is_drawn(own);
                    histories_n[agent].keep_common(&mut expected, &mut found, is_drawn);
                }
                let place = recorded.place(Check::OtherKey, step, AgentId::new(agent));
                compare(place, &expected, &found, certificate);
            }
        }
        Ok(())
    }
}

/// Which controllers ran at the latest step under two keys.
#[derive(Debug, Clone, Default)]
struct History {
    ran: [Vec<ControllerId>; 2],
    /// Those that ran at the same steps under both since they began.
    alike: Vec<ControllerId>,
}

impl History {
    /// Keeps what can be compared: inputs of controllers that run under both keys or would have to, and outputs of those that did
    /// so, too, as long as they remember. A group's controller may remember no longer than the group is formed; which are formed is
    /// drawn.
    fn keep_common(
        &mut self,
        expected: &mut Computed,
        found: &mut Computed,
        is_drawn: impl Fn(&ControllerId) -> bool,
    ) {
        let ran = [controllers(&expected.inputs), controllers(&found.inputs)];
        let both = |controller: &ControllerId| ran.iter().all(|own| own.contains(controller));
        let before =
            |controller: &ControllerId| self.ran.iter().any(|own| own.contains(controller));
        let mut alike = ran[0].clone();
        alike.retain(|own| both(own) && (!before(own) || self.alike.contains(own)));
        for computed in [&mut *expected, &mut *found] {
            (computed.inputs).retain(|(own, _)| both(own) || !is_drawn(own));
            computed.outputs.retain(|(own, _)| alike.contains(own));
        }
        let asked = controllers(&found.outputs);
        expected.outputs.retain(|(own, _)| asked.contains(own));
        let asked = controllers(&expected.outputs);
        found.outputs.retain(|(own, _)| asked.contains(own));
        self.ran = ran;
        self.alike = alike;
    }
}

/// Whose numbers these are.
fn controllers<T>(numbers: &[(ControllerId, T)]) -> Vec<ControllerId> {
    let own = numbers.iter();
    own.map(|(controller, _)| controller.clone()).collect()
}

impl Recorded {
    fn place(&self, check: Check, step: usize, agent: AgentId) -> Place {
        Place {
            check,
            mode: self.behaviour.mode,
            episode: self.keys.world.episode,
            step,
            agent,
        }
    }

    /// Compares what was found for an agent at a step with what the central run computed.
    fn compare(
        &self,
        check: Check,
        step: usize,
        agent: AgentId,
        found: &Computed,
        certificate: &mut Certificate,
    ) {
        let expected = &self.computed_tn[step][agent.index()];
        compare(self.place(check, step, agent), expected, found, certificate);
    }

    /// The step at which the world is altered for an agent.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a small count"
    )]
    fn step_to_alter(&self, agent: AgentId) -> usize {
        let draw = Draw::Setup((1 << 27) + 2 + agent.index());
        let uniform = self.keys.other.uniform(0, draw);
        (uniform * self.observations_t.len() as f64) as usize
    }
}

fn compare(place: Place, expected: &Computed, found: &Computed, certificate: &mut Certificate) {
    let mut compared = Compared::default();
    let difference = expected.first_difference(found, &mut compared);
    certificate.count(place.check, compared);
    if let Some(difference) = difference {
        certificate.note(place, difference, [expected.action, found.action], None);
    }
}

/// Asks one agent for its action and compares it, and what its controllers read and gave, with the central run.
fn compare_agent(
    link: &mut dyn AgentLink,
    place: Place,
    view: ViewMessage,
    central: &Computed,
    central_inputs: &dyn Fn() -> Vec<ControllerInput>,
    certificate: &mut Certificate,
) -> Result<(), Error> {
    let step = place.step;
    let Some(Answer::Action {
        action,
        inputs,
        outputs,
    }) = link.ask(Request::Look { step, view })?
    else {
        let agent = place.agent;
        return Err(Error::Data(format!(
            "agent {agent} did not answer with an action"
        )));
    };
    let own = Computed {
        action,
        inputs,
        outputs,
    };
    let mut compared = Compared::default();
    let found = central.first_difference(&own, &mut compared);
    certificate.count(place.check, compared);
    let Some(found) = found else {
        return Ok(());
    };
    let differing_input = match &found {
        (Difference::Input, Some(controller)) => {
            locate_difference(link, controller, &central_inputs())?
        }
        _ => None,
    };
    certificate.note(place, found, [central.action, action], differing_input);
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
