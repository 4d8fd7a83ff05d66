//! Learning learns: micromanagement is won, and the matrix game is played better than its baselines can.

mod support;

use std::num::NonZeroUsize;

use mackrl::tabular::{Learner, SweepSettings, sweep};
use mackrl_env::matrix_game::{ObservationDistribution, Payoffs};
use mackrl_run::{
    config::Config,
    training::{Evaluation, Trainer, evaluate},
};
use support::team::config;

/// Trains to the end and plays `episodes` greedy episodes that training has not seen.
fn train_and_evaluate(config: &Config, episodes: usize) -> Evaluation {
    let threads = 2;
    let mut trainer = Trainer::new(config, threads).expect("a run that can begin");
    while !trainer.finished() {
        trainer.update().expect("finite gradients");
    }
    evaluate(config, &trainer.weights(), episodes, 1, threads).expect("its own weights")
}

#[test]
fn a_team_learns_to_win_three_marines_against_three() {
    let config = config(&[
        "env.map=3m",
        "algorithm.name=mackrl-ppo",
        "run.steps_env=50000",
        "test.interval_steps_env=50000",
    ]);
    let evaluation = train_and_evaluate(&config, 160);
    let won = evaluation
        .mean("battle_won")
        .expect("a statistic of battles");
    assert!(won >= 0.9, "won {won}");
    let untrained = Config::default();
    let trainer = Trainer::new(&untrained, 1).expect("a run that can begin");
    let before = evaluate(&untrained, &trainer.weights(), 32, 1, 1).expect("its own weights");
    let before = before.mean("battle_won").expect("a statistic of battles");
    assert!(
        before < 0.1,
        "no learning is needed: an untrained team wins {before}"
    );
}

#[test]
#[ignore = "minutes"]
fn every_seed_and_both_algorithms_learn_to_win_three_marines_against_three() {
    for algorithm in ["algorithm.name=mackrl-ppo", "algorithm.name=mappo"] {
        for seed in ["run.seed=1", "run.seed=2", "run.seed=3"] {
            let settings = ["env.map=3m", "run.steps_env=200000"];
            let config = config(&[&settings[..], &[algorithm, seed]].concat());
            let won = train_and_evaluate(&config, 320).mean("battle_won");
            let won = won.expect("a statistic of battles");
            assert!(won >= 0.9, "{algorithm}, {seed}: won {won}");
        }
    }
}

/// Where the matrix is common knowledge in 7 of 10 games, joint action learners can reach 0.85 and independent learners
/// get stuck near 0.81 (`mackrl reproduce figure5`); the networks must do better than both.
#[test]
fn networks_play_the_matrix_game_better_than_both_tabular_baselines() {
    let point = 0.7;
    let baselines = sweep(
        &SweepSettings {
            payoffs: Payoffs::Coded,
            distribution: ObservationDistribution::Y2018,
            points: vec![point],
            runs: 30,
            seed: 1,
            threads: NonZeroUsize::MIN,
        },
        |_| (),
    )
    .expect("a probability");
    let [independent, joint] = [Learner::Iac, Learner::Jal]
        .map(|learner| baselines.curve(learner, |run| run.test).mean[0]);
    for seed in ["run.seed=1", "run.seed=2", "run.seed=3"] {
        let config = config(&[
            "env.name=matrix-game",
            &format!("env.common_knowledge={point}"),
            "algorithm.environments=32",
            "algorithm.learning_rate=0.001",
            "algorithm.critic_learning_rate=0.005",
            "algorithm.exploration_start=0.9",
            "run.steps_env=40000",
            "test.interval_steps_env=40000",
            seed,
        ]);
        let found = train_and_evaluate(&config, 4000)
            .mean("return")
            .expect("of every world");
        let margin = 0.02;
        assert!(
            found > joint + margin && found > independent + margin,
            "{seed}: {found} against {joint} (joint) and {independent} (independent)"
        );
    }
}
