//! An algorithm of another crate trains, is stored, resumed and certified like the built-in ones.

use std::sync::Arc;

use mackrl::decentralised::{AgentLink, InProcessAgent, Isolation, Repetition, Subject};
use mackrl_env::AgentId;
use mackrl_run::{
    config::{Config, ConfigBuilder, Registry},
    training::{
        Trainer,
        assembly::{self, RunWorld},
    },
};
use outside::ReinforceKind;

fn config(settings: &[&str]) -> Config {
    let registry = Registry::built_in().with_algorithm(Arc::new(ReinforceKind));
    let own = [
        "env.name=sanity-observe",
        "algorithm.name=reinforce",
        "test.episodes=200",
        "test.interval_steps_env=20000",
        "run.steps_env=20000",
    ];
    let all = own.iter().chain(settings);
    let builder = all.fold(ConfigBuilder::new(&registry), |builder, setting| {
        builder.set(setting).expect("a known setting")
    });
    builder.build().expect("settings within their ranges")
}

#[test]
fn an_algorithm_of_another_crate_learns_in_a_run() {
    let config = config(&[]);
    let mut trainer = Trainer::new(&config, 2).expect("a run that can begin");
    let mut tests = Vec::new();
    while !trainer.finished() {
        let row = trainer.update().expect("numbers are finite");
        tests.extend(row.and_then(|row| row.get("test_success_mean")));
    }
    assert!(tests[0] < 0.6, "untrained: {tests:?}");
    assert_eq!(tests.last(), Some(&1.0), "trained: {tests:?}");
}

#[test]
fn it_goes_on_from_a_checkpoint_to_the_byte() {
    let config = config(&["algorithm.environments=3"]);
    let world = RunWorld::new(&config).expect("a world");
    let mut whole = Trainer::new(&config, 1).expect("a run");
    for _ in 0..7 {
        whole.update().expect("numbers are finite");
    }
    let checkpoint = whole.checkpoint();
    let mut resumed = Trainer::resumed(&config, &world, 2, &checkpoint).expect("its checkpoint");
    for _ in 0..7 {
        whole.update().expect("numbers are finite");
        resumed.update().expect("numbers are finite");
    }
    assert!(whole.checkpoint() == resumed.checkpoint());
}

#[test]
fn its_agents_alone_do_what_the_central_run_does() {
    let config = config(&[]);
    let mut trainer = Trainer::new(&config, 1).expect("a run");
    for _ in 0..20 {
        trainer.update().expect("numbers are finite");
    }
    let world = RunWorld::new(&config).expect("a world");
    let algorithm = assembly::trained(&config, &world, &trainer.weights()).expect("its weights");
    let mut links: Vec<Box<dyn AgentLink + '_>> = (0..world.spec().agents)
        .map(|agent| {
            let executor = algorithm.policy().executor(AgentId::new(agent));
            Box::new(InProcessAgent::new(executor, algorithm.parameters())) as _
        })
        .collect();
    let mut environment = world.environments(1).remove(0);
    let mut subject = Subject {
        policy: algorithm.policy(),
        parameters: algorithm.parameters(),
        environment: &mut *environment,
        repetition: Repetition::Exact,
        isolation: Isolation::None,
        links: &mut links,
        seed: 1,
        sampled: algorithm.behaviour(0),
    };
    let certificate = subject.certify(10, |_, _| ()).expect("agents answer");
    assert_eq!(certificate.mismatches, 0);
    assert!(certificate.inputs_compared > 0, "{certificate:?}");
}
