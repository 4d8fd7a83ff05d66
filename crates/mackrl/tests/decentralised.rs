//! The certificate finds what it is there to find.

mod support;

use std::sync::{Arc, Mutex};

use mackrl::{
    Error, Stopwatch, decentralised::*, experience::Experience, hierarchy::Hierarchy,
    nn::ParameterLayout, policy::*,
};
use mackrl_env::*;
use support::team::{Team, world};

/// What is wrong with a policy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fault {
    /// Agent 0 of the central run stops when a number of the state says so.
    ReadsState,
    /// Agent 0 stops when the key of the choices says so, in the central run and alone.
    ReadsKey,
    /// A ten-thousandth of a coordinate that agent 0 does not see stands in its log-probabilities, in the central run.
    LeaksIntoLogits,
    /// Agents alone tell nothing of their controllers.
    TellsNothing,
    /// Agent 1 leaves what it sees where agent 0 finds it, and stops by it, when they are alone.
    PassesMessages,
}

/// A policy with a fault.
#[derive(Debug)]
struct Faulty {
    hierarchy: Hierarchy,
    fault: Fault,
    /// What passes from agent to agent, as a file would hold it.
    message: Arc<Mutex<u32>>,
}

struct FaultyActor {
    actor: Box<dyn Actor>,
    fault: Fault,
    leak: f32,
}

struct FaultyExecutor {
    executor: Box<dyn Executor>,
    agent: AgentId,
    fault: Fault,
    message: Arc<Mutex<u32>>,
}

/// Standing still.
const STOP: usize = 1;

impl Faulty {
    fn new(team: &Team, fault: Fault) -> Self {
        Self {
            hierarchy: team.hierarchy.clone(),
            fault,
            message: Arc::default(),
        }
    }
}

impl Policy for Faulty {
    fn layout(&self) -> &ParameterLayout {
        self.hierarchy.layout()
    }
    fn initialise(&self, seed: u64) -> Vec<f32> {
        self.hierarchy.initialise(seed)
    }
    fn actor(&self, environments: usize) -> Box<dyn Actor> {
        Box::new(FaultyActor {
            actor: self.hierarchy.actor(environments),
            fault: self.fault,
            leak: 0.0,
        })
    }
    fn executor(&self, agent: AgentId) -> Box<dyn Executor> {
        Box::new(FaultyExecutor {
            executor: self.hierarchy.executor(agent),
            agent,
            fault: self.fault,
            message: Arc::clone(&self.message),
        })
    }
    fn draws_when_greedy(&self) -> bool {
        self.hierarchy.draws_when_greedy()
    }
}

/// Whether a key says stop at a step.
fn says_stop(key: &EpisodeKey, step: usize) -> bool {
    key.bits(step, Draw::World(0)).is_multiple_of(3)
}

impl Actor for FaultyActor {
    fn begin(&mut self, recording: Recording, experience: &mut Experience) {
        self.actor.begin(recording, experience);
    }
    fn act(
        &mut self,
        parameters: &Parameters,
        situation: Situation<'_>,
        experience: &mut Experience,
        actions_bn: &mut [Action],
    ) -> Result<(), Error> {
        self.actor
            .act(parameters, situation, experience, actions_bn)?;
        let Situation {
            observations, step, ..
        } = situation;
        let view = observations.local_view(0, AgentId::new(0));
        let stops = match self.fault {
            Fault::ReadsState => observations.state(0)[2].to_bits().is_multiple_of(5),
            Fault::ReadsKey => says_stop(&situation.keys[0], step),
            _ => false,
        };
        if stops && view.available()[STOP] {
            actions_bn[0] = Action::new(STOP);
        }
        let [_, (_, features, entity_mf), _] = observations.numbers(0);
        let seen = view.seen().set();
        let mut entities = entity_mf.chunks(features).enumerate();
        let unseen = entities.find(|(entity, _)| !seen.contains(EntityId::new(*entity)));
        self.leak = 1e-4 * unseen.map_or(0.0, |(_, features)| features[0]);
        Ok(())
    }
    fn report(&self, tally: &mut Tally) {
        self.actor.report(tally);
    }
    fn stopwatch(&mut self) -> &mut Stopwatch {
        self.actor.stopwatch()
    }
    fn controller_inputs(&self, experience: &Experience, b: usize) -> Vec<ControllerInput> {
        self.actor.controller_inputs(experience, b)
    }
    fn controller_outputs(&self, experience: &Experience, b: usize) -> Vec<ControllerOutput> {
        let mut outputs = self.actor.controller_outputs(experience, b);
        if self.fault == Fault::LeaksIntoLogits {
            let own = [AgentId::new(0)];
            let found = outputs
                .iter_mut()
                .find(|output| output.controller.agents == own);
            if let Some(output) = found {
                output.log_p[STOP] += self.leak;
            }
        }
        outputs
    }
}

impl Executor for FaultyExecutor {
    fn begin(&mut self) {
        self.executor.begin();
    }
    fn act(
        &mut self,
        parameters: &Parameters,
        view: LocalView<'_>,
        key: &EpisodeKey,
        step: usize,
        behaviour: Behaviour,
    ) -> Action {
        let action = self.executor.act(parameters, view, key, step, behaviour);
        let mut message = self.message.lock().expect("one thread");
        if self.agent == AgentId::new(1) {
            *message = view.observation().iter().map(|x| x.to_bits() % 7).sum();
        }
        let is_first = self.agent == AgentId::new(0);
        let stops = match self.fault {
            Fault::ReadsKey => is_first && says_stop(key, step),
            Fault::PassesMessages => is_first && message.is_multiple_of(3),
            _ => false,
        };
        if stops && view.available()[STOP] {
            Action::new(STOP)
        } else {
            action
        }
    }
    fn controller_inputs(&self) -> Vec<ControllerInput> {
        match self.fault {
            Fault::TellsNothing => Vec::new(),
            _ => self.executor.controller_inputs(),
        }
    }
    fn controller_outputs(&self) -> Vec<ControllerOutput> {
        match self.fault {
            Fault::TellsNothing => Vec::new(),
            _ => self.executor.controller_outputs(),
        }
    }
}

/// A world in which agent 0 observes a little of where an enemy stands that it does not see.
struct LeakingWorld(Box<dyn Environment>);

impl LeakingWorld {
    fn leak(&self, out: &mut ObservationMut<'_>) {
        let spec = self.0.spec();
        let seen = out.visible_n[0];
        let enemies = spec.agents..spec.entities;
        let mut unseen = enemies.filter(|enemy| !seen.contains(EntityId::new(*enemy)));
        if let (Some(enemy), false) = (unseen.next(), seen.is_empty()) {
            out.observation_no[0] += 1e-3 * out.entity_mf[enemy * spec.entity_features];
        }
    }
}

impl Environment for LeakingWorld {
    fn spec(&self) -> &EnvironmentSpec {
        self.0.spec()
    }
    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        self.0.prior_knowledge()
    }
    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) {
        self.0.reset(key, out);
        self.leak(out);
    }
    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError> {
        let time_step = self.0.step(actions, out)?;
        self.leak(out);
        Ok(time_step)
    }
    fn statistics(&self, statistics_s: &mut [f64]) {
        self.0.statistics(statistics_s);
    }
    fn alter_unseen(
        &mut self,
        agent: AgentId,
        key: EpisodeKey,
        out: &mut ObservationMut<'_>,
    ) -> bool {
        let is_altered = self.0.alter_unseen(agent, key, out);
        self.leak(out);
        is_altered
    }
}

/// Certifies an untrained team; `policy` is what the central run and the agents alone play with.
fn certify(team: &Team, episodes: usize, policy: &dyn Policy) -> Certificate {
    let parameters = Parameters::new(team.initialise());
    let world = team.world.environments(1).remove(0);
    certify_with(world, episodes, policy, [&parameters, &parameters], 0.3).expect("agents answer")
}

/// The same in a given world, with parameters of the central run and of the agents on their own.
fn certify_with(
    mut world: Box<dyn Environment>,
    episodes: usize,
    policy: &dyn Policy,
    [parameters, own]: [&Parameters; 2],
    exploration: f64,
) -> Result<Certificate, Error> {
    let mut links: Vec<Box<dyn AgentLink + '_>> = (0..world.spec().agents)
        .map(|agent| policy.executor(AgentId::new(agent)))
        .map(|executor| Box::new(InProcessAgent::new(executor, own)) as Box<dyn AgentLink>)
        .collect();
    let mut subject = Subject {
        policy,
        parameters,
        environment: &mut *world,
        repetition: Repetition::Exact,
        isolation: Isolation::None,
        links: &mut links,
        seed: 5,
        sampled: Behaviour::sampled(exploration),
    };
    subject.certify(episodes, |_, _| {})
}

fn certify_honest(team: &Team, episodes: usize) -> Certificate {
    certify(team, episodes, &team.hierarchy)
}

/// The checks that find a fault on a map, at least one of which has to be among `expected`.
fn assert_found(map: &str, fault: Fault, expected: (Check, Difference)) {
    let team = Team::mackrl(&[map], "");
    let certificate = certify(&team, 4, &Faulty::new(&team, fault));
    let first = certificate.first_mismatch.as_ref();
    let first = first.expect("the fault is found");
    assert_eq!((first.check, first.difference), expected, "{fault:?}");
    assert!(
        certificate.proved("a map").contains("not decentralised"),
        "{fault:?}"
    );
}

#[test]
fn agents_on_their_own_play_the_central_run_on_every_map() {
    for map in mackrl_skirmish::map_names() {
        let map = format!("env.map={map}");
        let team = Team::mackrl(&[&map], r#"partitions = "round-robin""#);
        let certificate = certify_honest(&team, 1);
        assert_eq!(certificate.first_mismatch, None, "{map}");
        assert!(
            certificate.actions_compared > 0 && certificate.inputs_compared > 0,
            "{map}"
        );
        assert!(certificate.altered_actions_compared > 0, "{map}");
    }
}

#[test]
fn every_variant_of_the_hierarchy_is_decentralised() {
    let world = ["env.map=2s3z"];
    let mackrl = [
        "",
        r#"common_knowledge = "thin""#,
        r#"partitions = "sampled:3""#,
        r#"selector = "uniform""#,
    ];
    let mut teams: Vec<Team> = mackrl.map(|settings| Team::mackrl(&world, settings)).into();
    teams.push(Team::central_v(&world, ""));
    for team in teams {
        let certificate = certify_honest(&team, 3);
        assert_eq!(certificate.first_mismatch, None, "{:?}", team.hierarchy);
    }
}

#[test]
fn a_hierarchy_with_fours_is_decentralised() {
    for map in ["env.map=2s3z", "env.map=8m"] {
        let certificate = certify_honest(&Team::fours(&[map], 11), 2);
        assert_eq!(certificate.first_mismatch, None, "{map}");
        assert_eq!(certificate.mismatches, 0, "{map}");
        assert!(
            certificate.actions_compared > 100 && certificate.inputs_compared > 1000,
            "{map}: {certificate:?}"
        );
        assert!(certificate.altered_actions_compared > 100, "{map}");
    }
}

#[test]
fn a_central_run_that_reads_the_state_is_caught_by_both_checks() {
    let fault = Fault::ReadsState;
    assert_found(
        "env.map=3m",
        fault,
        (Check::SeparateAgents, Difference::Action),
    );
    let team = Team::mackrl(&["env.map=3m"], "");
    let certificate = certify(&team, 5, &Faulty::new(&team, fault));
    let altered = certificate.mismatches_in_altered_worlds;
    assert!(
        altered > 0,
        "the peeking central run did not change in altered worlds"
    );
    assert!(
        certificate.mismatches > altered,
        "separate agents followed the peeking run"
    );
}

#[test]
fn a_leak_in_the_observation_is_found_by_altering_the_state() {
    let team = Team::mackrl(&["env.map=2s3z"], "");
    let parameters = Parameters::new(team.initialise());
    let world = Box::new(LeakingWorld(team.world.environments(1).remove(0)));
    let certificate =
        certify_with(world, 4, &team.hierarchy, [&parameters; 2], 0.3).expect("agents answer");
    let first = certificate.first_mismatch.expect("the leak is found");
    assert_eq!(
        (first.check, first.difference, first.agent),
        (
            Check::AlteredStates,
            Difference::Observation,
            AgentId::new(0)
        )
    );
}

#[test]
fn a_controller_that_reads_the_key_is_found() {
    let expected = (Check::OtherKey, Difference::Action);
    assert_found("env.map=3m", Fault::ReadsKey, expected);
}

#[test]
fn a_ten_thousandth_of_an_unseen_coordinate_in_a_logit_is_found() {
    let expected = (Check::SeparateAgents, Difference::LogProbability);
    assert_found("env.map=2s3z", Fault::LeaksIntoLogits, expected);
    let team = Team::mackrl(&["env.map=2s3z"], "");
    let certificate = certify(&team, 4, &Faulty::new(&team, Fault::LeaksIntoLogits));
    assert!(
        certificate.mismatches_in_altered_worlds > 0,
        "{certificate:?}"
    );
}

#[test]
fn an_agent_that_tells_nothing_of_its_controllers_is_found() {
    let expected = (Check::SeparateAgents, Difference::Missing);
    assert_found("env.map=3m", Fault::TellsNothing, expected);
}

#[test]
fn a_message_between_agents_is_found() {
    let expected = (Check::SeparateAgents, Difference::Action);
    assert_found("env.map=3m", Fault::PassesMessages, expected);
}

#[test]
fn every_check_compares_something() {
    let team = Team::mackrl(&["env.map=2s3z"], "");
    let certificate = certify_honest(&team, 2);
    assert_eq!(certificate.first_mismatch, None);
    let counts = [
        certificate.actions_compared,
        certificate.inputs_compared,
        certificate.outputs_compared,
        certificate.altered_actions_compared,
        certificate.altered_inputs_compared,
        certificate.altered_outputs_compared,
        certificate.unseen_numbers_compared,
        certificate.altered_states_compared,
        certificate.other_key_compared,
    ];
    assert!(counts.iter().all(|count| *count > 0), "{certificate:?}");
    let proved = certificate.proved("2s3z");
    assert!(
        proved.contains("Certified: the team runs decentralised on"),
        "{proved}"
    );
}

#[test]
fn a_certificate_of_nothing_is_refused() {
    let team = Team::mackrl(&["env.map=3m"], "");
    let parameters = Parameters::new(team.initialise());
    let world = team.world.environments(1).remove(0);
    let outcome = certify_with(world, 0, &team.hierarchy, [&parameters; 2], 0.3);
    let message = outcome.unwrap_err().to_string();
    assert!(message.contains("nothing is certified"), "{message}");
}

#[test]
fn agents_with_other_weights_are_caught_with_the_numbers_that_differ() {
    let team = Team::mackrl(&["env.map=3m"], "");
    let [parameters, others] = [1, 2].map(|seed| Parameters::new(team.hierarchy.initialise(seed)));
    let world = team.world.environments(1).remove(0);
    let certificate = certify_with(world, 2, &team.hierarchy, [&parameters, &others], 0.0)
        .expect("agents answer");
    let first = certificate
        .first_mismatch
        .expect("other weights are noticed");
    assert_eq!(
        (first.check, first.difference),
        (Check::SeparateAgents, Difference::LogProbability)
    );
    assert_eq!(
        certificate.mismatches_in_altered_worlds, 0,
        "the central run is honest"
    );
}

#[test]
fn a_view_by_value_holds_what_is_seen_and_nothing_else() {
    let world = world(&["env.map=2s3z"]);
    let mut environment = world.environments(1).remove(0);
    let mut observations = Observations::new(world.spec(), 1);
    let key = EpisodeKey::new(1, Stream::Other, 0);
    environment.reset(key, &mut observations.row_mut(0));
    let view = observations.local_view(0, AgentId::new(2));
    let text = serde_json::to_string(&ViewMessage::from(view)).unwrap();
    let received = serde_json::from_str::<ViewMessage>(&text)
        .unwrap()
        .receive()
        .unwrap();
    let copy = received.view();
    assert_eq!(copy.seen().set(), view.seen().set());
    assert!(
        view.seen().set().len() < world.spec().entities,
        "somebody is out of sight"
    );
    for entity in view.seen().set().iter() {
        assert_eq!(copy.seen().get(entity), view.seen().get(entity));
    }
    assert_eq!(
        (copy.observation(), copy.available()),
        (view.observation(), view.available())
    );
}

#[test]
fn a_view_whose_parts_do_not_fit_is_refused() {
    let broken = [
        r#"{"agent":0,"entities":2,"entity_features":2,"seen":[[2,[0,0]]],"observation_o":[],"available_a":[]}"#,
        r#"{"agent":0,"entities":2,"entity_features":2,"seen":[[1,[0]]],"observation_o":[],"available_a":[]}"#,
        r#"{"agent":0,"entities":999,"entity_features":2,"seen":[],"observation_o":[],"available_a":[]}"#,
    ];
    for text in broken {
        let message: ViewMessage = serde_json::from_str(text).unwrap();
        assert!(message.receive().is_err(), "{text}");
    }
}
