//! Sanity worlds are solved: learners have the ability that each of them needs.

use mackrl_run::{
    config::{ConfigBuilder, registry},
    training::{Trainer, evaluate},
};

/// The learners that are tried: that of the paper and the default, with settings for such small worlds.
const LEARNERS: [&[&str]; 2] = [
    &[
        "algorithm.name=mackrl",
        "algorithm.environments=32",
        "algorithm.learning_rate=0.002",
        "algorithm.critic_learning_rate=0.005",
        "algorithm.exploration_steps_env=10000",
    ],
    &[
        "algorithm.name=mackrl-ppo",
        "algorithm.environments=64",
        "algorithm.learning_rate=0.002",
    ],
];

/// Each world needs one ability: to act on one's own observation, to remember, to coordinate on common knowledge.
#[test]
fn sanity_worlds_are_solved() {
    for kind in mackrl_env::sanity::kinds() {
        for learner in LEARNERS {
            let world = format!("env.name={}", kind.name());
            let length = ["run.steps_env=20000", "test.interval_steps_env=20000"];
            let settings = [world.as_str()].into_iter().chain(length);
            let config = settings
                .chain(learner.iter().copied())
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
            let success = found.mean("success").expect("a statistic of all three");
            assert!(
                success >= 0.95,
                "{} on {}: {success}",
                learner[0],
                kind.name()
            );
        }
    }
}
