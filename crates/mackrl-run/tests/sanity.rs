//! Sanity worlds are solved: learners have the ability that each of them needs.

use mackrl_run::{
    config::{ConfigBuilder, registry},
    training::{Trainer, evaluate},
};

/// Trains a team and asserts that it succeeds in 95 of 100 episodes that it has not seen.
fn assert_solves(world: &str, steps: u64, settings: &[&str]) {
    let own = [
        format!("env.name={world}"),
        format!("run.steps_env={steps}"),
        format!("test.interval_steps_env={steps}"),
    ];
    let config = (own.iter().map(String::as_str))
        .chain(settings.iter().copied())
        .fold(ConfigBuilder::new(registry()), |builder, setting| {
            builder.set(setting).expect("a known setting")
        })
        .build()
        .expect("settings within their ranges");
    let mut trainer = Trainer::new(&config, 2).expect("a run that can begin");
    while !trainer.finished() {
        trainer.update().expect("finite gradients");
    }
    let found = evaluate(&config, &trainer.weights(), 400, 1, 2).expect("its own weights");
    let success = found.mean("success").expect("a statistic of all worlds");
    assert!(success >= 0.95, "{} on {world}: {success}", settings[0]);
}

/// The learner of the paper and the default. Each world needs one ability: to act on one's own observation, to remember, to
/// coordinate on common knowledge.
#[test]
fn sanity_worlds_are_solved() {
    for kind in mackrl_env::sanity::kinds() {
        for learner in [
            &[
                "algorithm.name=mackrl",
                "algorithm.environments=32",
                "algorithm.learning_rate=0.002",
                "algorithm.critic_learning_rate=0.005",
                "algorithm.exploration_steps_env=10000",
            ][..],
            &[
                "algorithm.name=mackrl-ppo",
                "algorithm.environments=64",
                "algorithm.learning_rate=0.002",
            ],
        ] {
            assert_solves(kind.name(), 20_000, learner);
        }
    }
}

/// Learners whose groups have advantages of their own, where they have the ability that is needed.
#[test]
fn groups_with_their_own_advantages_solve_sanity_worlds() {
    for (world, algorithm) in [
        ("sanity-observe", "algorithm.name=iac"),
        ("sanity-observe", "algorithm.name=coma"),
        ("sanity-remember", "algorithm.name=coma"),
        ("sanity-observe", "algorithm.name=mackrl-coma"),
        ("sanity-coordinate", "algorithm.name=mackrl-coma"),
    ] {
        let settings = [
            algorithm,
            "algorithm.environments=32",
            "algorithm.optimiser=adam",
            "algorithm.learning_rate=0.002",
            "algorithm.critic_learning_rate=0.005",
            "algorithm.exploration_steps_env=10000",
        ];
        assert_solves(world, 25_000, &settings);
    }
}
