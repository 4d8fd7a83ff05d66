//! Sanity worlds are solved: learners have the ability that each of them needs.

use mackrl_run::{
    config::{ConfigBuilder, registry},
    training::{Trainer, evaluate},
};

/// Each world needs one ability: to act on one's own observation, to remember, to coordinate on common knowledge.
#[test]
fn sanity_worlds_are_solved() {
    for kind in mackrl_env::sanity::kinds() {
        let settings = [
            &format!("env.name={}", kind.name()),
            "algorithm.environments=32",
            "algorithm.learning_rate=0.002",
            "algorithm.critic_learning_rate=0.005",
            "algorithm.exploration_steps_env=10000",
            "run.steps_env=20000",
            "test.interval_steps_env=20000",
        ];
        let config = settings
            .iter()
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
        assert!(success >= 0.95, "{}: {success}", kind.name());
    }
}
