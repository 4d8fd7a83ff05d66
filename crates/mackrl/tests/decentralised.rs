//! The certificate finds what it is there to find.

mod support;

use std::fmt::Debug;

use mackrl::{
    NotFinite, Stopwatch, decentralised::*, experience::Experience, hierarchy::Hierarchy,
    nn::ParameterLayout, policy::*,
};
use mackrl_env::*;
use support::team::{Team, world};

/// A policy whose agent 0 peeks at the state now and then.
#[derive(Debug)]
struct Peeking(Hierarchy);

struct PeekingActor(Box<dyn Actor>);

impl Policy for Peeking {
    fn layout(&self) -> &ParameterLayout {
        self.0.layout()
    }
    fn initialise(&self, seed: u64) -> Vec<f32> {
        self.0.initialise(seed)
    }
    fn actor(&self, environments: usize) -> Box<dyn Actor> {
        Box::new(PeekingActor(self.0.actor(environments)))
    }
    fn executor(&self, agent: AgentId) -> Box<dyn Executor> {
        self.0.executor(agent)
    }
}

impl Actor for PeekingActor {
    fn begin(&mut self, recording: Recording, experience: &mut Experience) {
        self.0.begin(recording, experience);
    }
    fn act(
        &mut self,
        parameters: &Parameters,
        situation: Situation<'_>,
        experience: &mut Experience,
        actions_bn: &mut [Action],
    ) -> Result<(), NotFinite> {
        self.0.act(parameters, situation, experience, actions_bn)?;
        let view = situation.observations.local_view(0, AgentId::new(0));
        let stop = Action::new(1);
        if situation.observations.state(0)[2]
            .to_bits()
            .is_multiple_of(5)
            && view.available()[stop.index()]
        {
            actions_bn[0] = stop;
        }
        Ok(())
    }
    fn report(&self, tally: &mut Tally) {
        self.0.report(tally);
    }
    fn stopwatch(&mut self) -> &mut Stopwatch {
        self.0.stopwatch()
    }
    fn controller_inputs(&self, experience: &Experience, b: usize) -> Vec<ControllerInput> {
        self.0.controller_inputs(experience, b)
    }
}

/// Certifies an untrained team; `central` is what the central run plays with.
fn certify(team: &Team, episodes: usize, central: &dyn Policy) -> Certificate {
    let parameters = Parameters::new(team.initialise());
    certify_with(team, episodes, central, [&parameters, &parameters], 0.3)
}

/// The same, with parameters of the central run and of the agents on their own.
fn certify_with(
    team: &Team,
    episodes: usize,
    central: &dyn Policy,
    [parameters, own]: [&Parameters; 2],
    exploration: f64,
) -> Certificate {
    let mut links: Vec<Box<dyn AgentLink + '_>> = (0..team.world.spec().agents)
        .map(|agent| team.hierarchy.executor(AgentId::new(agent)))
        .map(|executor| Box::new(InProcessAgent::new(executor, own)) as Box<dyn AgentLink>)
        .collect();
    let mut environment = team.world.environments(1).remove(0);
    let mut subject = Subject {
        policy: central,
        parameters,
        environment: &mut *environment,
        links: &mut links,
        seed: 5,
        sampled: Behaviour::sampled(exploration),
    };
    subject.certify(episodes, |_, _| {}).expect("agents answer")
}

fn certify_honest(team: &Team, episodes: usize) -> Certificate {
    certify(team, episodes, &team.hierarchy)
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
fn a_controller_that_reads_the_state_is_caught_by_both_checks() {
    let team = Team::mackrl(&["env.map=3m"], "");
    let certificate = certify(&team, 5, &Peeking(team.hierarchy.clone()));
    let first = certificate.first_mismatch.expect("peeking is noticed");
    assert_eq!(
        (first.check, first.agent),
        (Check::SeparateAgents, AgentId::new(0))
    );
    assert_ne!(first.central_action, first.agent_action);
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
fn agents_with_another_seed_are_caught_with_the_input_that_differs() {
    let team = Team::mackrl(&["env.map=3m"], "");
    let [parameters, others] = [1, 2].map(|seed| Parameters::new(team.hierarchy.initialise(seed)));
    let parameters = [&parameters, &others];
    let certificate = certify_with(&team, 2, &team.hierarchy, parameters, 0.0);
    assert!(
        certificate.mismatches > 0,
        "other weights gave the same actions"
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
