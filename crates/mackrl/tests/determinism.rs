//! The same run gives the same bytes: twice, on any number of threads, in any company.

mod support;

use mackrl::{
    algorithms::Algorithm,
    experience::{Collector, Episode, PlaySettings},
    policy::{Behaviour, Parameters, Recording},
};
use mackrl_env::EpisodeKey;
use mackrl_run::{
    config::Config,
    training::{Evaluation, Trainer, evaluate},
};
use support::team::{CENTRAL_V, FOR_LEARNING, MACKRL, Team, config, keys, world_setting};

/// What a run leaves behind: its metrics as JSON without `sys/`, its weights, and how they play.
#[derive(PartialEq)]
struct Outcome {
    metrics: Vec<String>,
    weights: Vec<u8>,
    evaluation: Evaluation,
}

fn short_run(algorithm: &str, seed: &str) -> Config {
    // A team that acts as one has to see itself.
    let sight = if algorithm.ends_with("jal") { 64 } else { 9 };
    config(&[
        "env.map=3m",
        &format!("env.sight_range={sight}"),
        algorithm,
        seed,
        "algorithm.hidden=16",
        "run.steps_env=3000",
        "run.metrics_interval_steps_env=700",
        "test.interval_steps_env=1500",
        "test.episodes=11",
    ])
}

fn train(config: &Config, threads: usize) -> Outcome {
    let mut trainer = Trainer::new(config, threads).expect("a run that can begin");
    let mut metrics = Vec::new();
    while !trainer.finished() {
        if let Some(row) = trainer.update().expect("finite gradients") {
            let entries: Vec<_> = (row.iter())
                .filter(|(name, _)| !name.starts_with("sys/"))
                .map(|(name, value)| format!("{name} {:016x}", value.to_bits()))
                .collect();
            metrics.push(entries.join("\n"));
        }
    }
    let weights = trainer.weights();
    let evaluation = evaluate(config, &weights, 37, 5, threads).expect("its own weights");
    Outcome {
        metrics,
        weights,
        evaluation,
    }
}

fn assert_same_run(found: &Outcome, expected: &Outcome, what: &str) {
    assert_eq!(found.metrics, expected.metrics, "{what}: metrics");
    assert!(found.weights == expected.weights, "{what}: weights differ");
    assert_eq!(found.evaluation, expected.evaluation, "{what}: evaluation");
}

#[test]
fn a_run_gives_the_same_bytes_twice_and_on_any_number_of_threads() {
    let names = ["iql", "vdn", "qmix", "iac", "coma", "mackrl-coma", "jal"];
    let others = names.map(|name| format!("algorithm.name={name}"));
    let others = others.iter().map(String::as_str);
    for algorithm in [MACKRL, CENTRAL_V].into_iter().chain(others) {
        let config = short_run(algorithm, "run.seed=1");
        let once = train(&config, 1);
        assert!(once.metrics.len() >= 5, "rows of training and of tests");
        assert_same_run(&train(&config, 1), &once, "the second time");
        for threads in [2, 8] {
            assert_same_run(&train(&config, threads), &once, &format!("{threads}"));
        }
    }
}

#[test]
fn another_seed_gives_another_run() {
    let [first, second] =
        ["run.seed=1", "run.seed=2"].map(|seed| train(&short_run(MACKRL, seed), 1));
    assert!(first.metrics != second.metrics, "the same metrics");
    assert!(first.weights != second.weights, "the same weights");
}

/// Plays `keys` in 2 environments more than that, cut into `shards`.
fn play(team: &Team, keys: &[EpisodeKey], shards: usize, behaviour: Behaviour) -> Vec<Episode> {
    let parameters = Parameters::new(team.initialise());
    let mut collector = team.collector(keys.len() + 2, shards);
    let settings = PlaySettings {
        behaviour,
        recording: Recording::ForLearning,
    };
    collector
        .play(&parameters, keys, settings)
        .expect("masks agree with the world");
    let pieces = collector.pieces();
    pieces
        .flat_map(|piece| piece.experience.episodes.clone())
        .collect()
}

#[test]
fn an_episode_is_a_function_of_its_key_whoever_is_played_beside_it() {
    let keys = keys(7);
    for (map, partitions) in [
        ("3m", "all"),
        ("2s3z", "round-robin"),
        ("matrix-game", "all"),
    ] {
        let map = world_setting(map);
        let team = Team::mackrl(
            &[&map],
            &format!("hidden = 13\npartitions = {partitions:?}"),
        );
        for behaviour in [Behaviour::sampled(0.3), Behaviour::GREEDY] {
            let alone: Vec<Episode> = (keys.iter())
                .flat_map(|&key| play(&team, &[key], 3, behaviour))
                .collect();
            for shards in [9, 5, 3, 1] {
                let together = play(&team, &keys, shards, behaviour);
                assert!(together == alone, "{map}, {shards} shards");
            }
            let backwards: Vec<EpisodeKey> = keys.iter().rev().copied().collect();
            let mut reversed = play(&team, &backwards, 2, behaviour);
            reversed.reverse();
            assert!(reversed == alone, "{map}, in another order");
        }
    }
}

#[test]
fn eight_shards_on_one_thread_and_on_eight_learn_the_same_bits() {
    let learn = |threads: usize| {
        let team = Team::mackrl(&["env.map=3m"], "hidden = 13");
        let mut algorithm = team.actor_critic("hidden = 13", threads);
        let environments = team.world.environments(13);
        let mut collector = Collector::new(algorithm.policy(), environments, 8, threads);
        let mut reports = Vec::new();
        for _ in 0..3 {
            let played = collector.play(algorithm.parameters(), &keys(13), FOR_LEARNING);
            played.expect("masks agree with the world");
            let mut batch: Vec<_> = collector.pieces().collect();
            assert_eq!(batch.len(), 8);
            let report = algorithm.learn(&mut batch, &mut Default::default());
            reports.push(report.expect("finite gradients"));
        }
        (reports, algorithm.state())
    };
    let once = learn(1);
    assert!(learn(8) == once, "the number of threads changes a result");
}
