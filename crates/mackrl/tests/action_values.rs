//! Teams that act by action values: decentralised, and able to learn.

use std::collections::BTreeMap;

use mackrl::{
    algorithms::Algorithm,
    decentralised::{AgentLink, InProcessAgent, Isolation, Repetition, Subject},
    policy::Behaviour,
};
use mackrl_env::{AgentId, Draw, EpisodeKey, Stream};
use mackrl_run::{
    config::{Config, ConfigBuilder, registry},
    training::{Trainer, assembly, evaluate},
};

fn config(settings: &[&str]) -> Config {
    let builder = settings
        .iter()
        .fold(ConfigBuilder::new(registry()), |builder, setting| {
            builder.set(setting).expect("a known setting")
        });
    builder.build().expect("settings within their ranges")
}

/// Plays whole episodes, centrally and by each agent alone, with all checks of the certificate.
fn assert_decentralised(settings: &[&str]) {
    let config = config(settings);
    let world = assembly::RunWorld::new(&config).expect("a world that can be built");
    let team: Box<dyn Algorithm> =
        assembly::algorithm(&config, &world, 1).expect("a team for this world");
    let mut environment = world.environments(1).remove(0);
    let mut links: Vec<Box<dyn AgentLink + '_>> = (0..world.spec().agents)
        .map(|agent| team.policy().executor(AgentId::new(agent)))
        .map(|executor| InProcessAgent::new(executor, team.parameters()))
        .map(|agent| Box::new(agent) as Box<dyn AgentLink>)
        .collect();
    let mut subject = Subject {
        policy: team.policy(),
        parameters: team.parameters(),
        environment: &mut *environment,
        repetition: Repetition::Exact,
        isolation: Isolation::None,
        links: &mut links,
        seed: 5,
        sampled: Behaviour::sampled(0.3),
    };
    let certificate = subject.certify(2, |_, _| {}).expect("agents answer");
    assert_eq!(certificate.first_mismatch, None, "{settings:?}");
    assert!(
        certificate.actions_compared > 0 && certificate.inputs_compared > 0,
        "{settings:?}"
    );
}

#[test]
fn agents_on_their_own_play_the_central_run() {
    for map in ["3m", "2s3z", "MMM"] {
        assert_decentralised(&["algorithm.name=qmix", &format!("env.map={map}")]);
    }
    assert_decentralised(&["algorithm.name=iql", "env.name=matrix-game"]);
}

#[test]
fn an_agent_explores_by_its_own_draws_alone() {
    let config = config(&["algorithm.name=vdn", "env.map=3m"]);
    let world = assembly::RunWorld::new(&config).expect("a world that can be built");
    let team = assembly::algorithm(&config, &world, 1).expect("a team for this world");
    let mut environment = world.environments(1).remove(0);
    let mut observations = mackrl_env::Observations::new(world.spec(), 1);
    environment.reset(
        EpisodeKey::new(1, Stream::Other, 0),
        &mut observations.row_mut(0),
    );
    let agent = AgentId::new(1);
    let view = observations.local_view(0, agent);
    let mut taken = BTreeMap::new();
    for episode in 0..300 {
        let key = EpisodeKey::new(1, Stream::Other, episode);
        let mut executor = team.policy().executor(agent);
        executor.begin();
        let behaviour = Behaviour::sampled(0.5);
        let action = executor.act(team.parameters(), view, &key, 0, behaviour);
        let explores = key.uniform(0, Draw::Agent(1)) < 0.5;
        *taken.entry((explores, action)).or_insert(0) += 1;
        assert!(view.available()[action.index()], "{action} is available");
    }
    let greedy = taken.keys().filter(|(explores, _)| !explores).count();
    assert_eq!(
        greedy, 1,
        "without exploration the best is taken: {taken:?}"
    );
    let explored = taken.keys().filter(|(explores, _)| *explores).count();
    assert!(explored > 3, "exploration takes any: {taken:?}");
}

/// To act on what one observes, and to remember it. (What the third sanity world needs, acting jointly, agents alone cannot do.)
#[test]
fn sanity_worlds_for_agents_alone_are_solved() {
    for world in ["sanity-observe", "sanity-remember"] {
        for algorithm in ["iql", "vdn", "qmix"] {
            let config = config(&[
                &format!("env.name={world}"),
                &format!("algorithm.name={algorithm}"),
                "algorithm.hidden=32",
                "algorithm.environments=8",
                "algorithm.optimiser=adam",
                "algorithm.learning_rate=0.003",
                "algorithm.exploration_steps_env=5000",
                "algorithm.target_interval_episodes=100",
                "run.steps_env=10000",
                "test.interval_steps_env=10000",
            ]);
            let mut trainer = Trainer::new(&config, 2).expect("a run that can begin");
            while !trainer.finished() {
                trainer.update().expect("finite gradients");
            }
            let found = evaluate(&config, &trainer.weights(), 400, 1, 2);
            let success = found.expect("its own weights").mean("success");
            let success = success.expect("a statistic of the world");
            assert!(success >= 0.95, "{algorithm}, {world}: {success}");
        }
    }
}
