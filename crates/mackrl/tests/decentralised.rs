//! The certificate finds what it is there to find.

use std::fmt::Debug;

use mackrl::{NotFinite, Stopwatch, decentralised::*, nn::ParameterLayout, policy::*};
use mackrl_env::*;
use mackrl_run::{
    config::Config,
    training::assembly::{self, World},
};

/// A policy whose agent 0 peeks at the state now and then.
#[derive(Debug)]
struct Peeking(Box<dyn Decentralised>);

struct PeekingActor(Box<dyn Actor>);

impl Policy for Peeking {
    fn layout(&self) -> &ParameterLayout {
        self.0.layout()
    }
    fn initialise(&self, seed: u64) -> Vec<f32> {
        self.0.initialise(seed)
    }
    fn weights(&self, parameters: &[f32]) -> Weights {
        self.0.weights(parameters)
    }
    fn refresh(&self, parameters: &[f32], weights: &mut Weights) {
        self.0.refresh(parameters, weights);
    }
    fn actor(&self, environments: usize) -> Box<dyn Actor> {
        Box::new(PeekingActor(self.0.actor(environments)))
    }
}

impl Actor for PeekingActor {
    fn begin(&mut self, recording: Recording) {
        self.0.begin(recording);
    }
    fn act(
        &mut self,
        weights: &Weights,
        situation: Situation<'_>,
        actions_bn: &mut [Action],
    ) -> Result<(), NotFinite> {
        self.0.act(weights, situation, actions_bn)?;
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
    fn backward(&mut self, weights: &Weights, w: &[Vec<f32>], gradient: &mut [f32]) -> f64 {
        self.0.backward(weights, w, gradient)
    }
    fn report(&self, tally: &mut Tally) {
        self.0.report(tally);
    }
    fn stopwatch(&mut self) -> &mut Stopwatch {
        self.0.stopwatch()
    }
    fn controller_inputs(&self, b: usize) -> Vec<ControllerInput> {
        self.0.controller_inputs(b)
    }
}

fn config(settings: &[&str]) -> Config {
    Config::with(settings).unwrap()
}

/// Certifies an untrained team; `disguise` may change the policy of the central run.
fn certify<P: Policy + ?Sized>(
    config: &Config,
    episodes: usize,
    disguise: impl FnOnce(Box<dyn Decentralised>) -> Box<P>,
    central: impl Fn(&P) -> &dyn Policy,
) -> Certificate {
    let world = World::new(config).unwrap();
    let policy = assembly::policy(config, &world).unwrap();
    let weights = policy.weights(&policy.initialise(config.run.seed));
    let mut links: Vec<Box<dyn AgentLink + '_>> = (0..world.spec().agents)
        .map(|agent| policy.executor(AgentId::new(agent)))
        .map(|executor| Box::new(InProcessAgent::new(executor, &weights)) as Box<dyn AgentLink>)
        .collect();
    let disguised = disguise(assembly::policy(config, &world).unwrap());
    let mut environment = world.environments(1).remove(0);
    let mut subject = Subject {
        policy: central(&disguised),
        weights: &weights,
        environment: &mut *environment,
        links: &mut links,
        seed: 5,
        exploration: 0.3,
    };
    subject.certify(episodes, |_, _| {}).unwrap()
}

fn certify_honest(settings: &[&str], episodes: usize) -> Certificate {
    certify(
        &config(settings),
        episodes,
        |policy| policy,
        |policy| policy,
    )
}

#[test]
fn agents_on_their_own_play_the_central_run_on_every_map() {
    for map in mackrl_skirmish::map_names() {
        let map = format!("env.map={map}");
        let certificate = certify_honest(&[&map, "algorithm.partitions=round-robin"], 1);
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
    let variants: [&[&str]; 5] = [
        &["env.map=2s3z"],
        &["env.map=2s3z", "algorithm.common_knowledge=thin"],
        &["env.map=2s3z", "algorithm.partitions=sampled:3"],
        &["env.map=2s3z", "algorithm.selector=uniform"],
        &["env.map=2s3z", "algorithm.name=central-v"],
    ];
    for variant in variants {
        let certificate = certify_honest(variant, 3);
        assert_eq!(certificate.first_mismatch, None, "{variant:?}");
    }
}

#[test]
fn a_controller_that_reads_the_state_is_caught_by_both_checks() {
    let certificate = certify(
        &config(&[]),
        5,
        |policy| Box::new(Peeking(policy)),
        |peeking| peeking,
    );
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
    let config = config(&["env.map=3m"]);
    let world = World::new(&config).unwrap();
    let policy = assembly::policy(&config, &world).unwrap();
    let weights = policy.weights(&policy.initialise(1));
    let others = policy.weights(&policy.initialise(2));
    let mut links: Vec<Box<dyn AgentLink + '_>> = (0..3)
        .map(|agent| policy.executor(AgentId::new(agent)))
        .map(|executor| Box::new(InProcessAgent::new(executor, &others)) as Box<dyn AgentLink>)
        .collect();
    let mut environment = world.environments(1).remove(0);
    let mut subject = Subject {
        policy: &*policy,
        weights: &weights,
        environment: &mut *environment,
        links: &mut links,
        seed: 5,
        exploration: 0.0,
    };
    let certificate = subject.certify(2, |_, _| {}).unwrap();
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
    let world = World::new(&config(&["env.map=2s3z"])).unwrap();
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
