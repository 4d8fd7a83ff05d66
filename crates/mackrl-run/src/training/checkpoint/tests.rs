use super::*;
use crate::{
    config::Config,
    training::{MetricRow, Trainer},
};

fn config(algorithm: &str) -> Config {
    // A team that acts as one has to see itself.
    let sight = if algorithm == "jal" { 64 } else { 9 };
    let settings = [
        &format!("algorithm.name={algorithm}"),
        &format!("env.sight_range={sight}"),
        "algorithm.hidden=5",
        "algorithm.environments=7",
        "algorithm.target_interval_updates=13",
        "algorithm.exploration_steps_env=1009",
        "test.interval_steps_env=701",
        "test.episodes=3",
        "run.metrics_interval_steps_env=307",
        "run.steps_env=2003",
    ];
    Config::with(&settings).unwrap()
}

/// Rows as bytes, without what depends on the clock.
fn bytes(row: &MetricRow) -> String {
    let timeless = row.iter().filter(|(name, _)| !name.starts_with("sys/"));
    timeless
        .map(|(name, value)| format!("{name}={:x} ", value.to_bits()))
        .collect()
}

/// Trains to the end on `threads[0]`, or on each of `threads` in turn, with an interruption after every `pause` iterations.
fn train(config: &Config, threads: &[usize], pause: u64) -> (Vec<String>, Checkpoint) {
    let mut rows = Vec::new();
    let mut trainer = Trainer::new(config, threads[0]).unwrap();
    let mut turns = threads.iter().cycle().skip(1);
    while !trainer.finished() {
        rows.extend(trainer.update().unwrap().as_ref().map(bytes));
        if trainer.iterations().is_multiple_of(pause) {
            let checkpoint = trainer.checkpoint();
            trainer = Trainer::new(config, *turns.next().unwrap()).unwrap();
            trainer.restore(&checkpoint).unwrap();
            assert_eq!(trainer.checkpoint(), checkpoint, "there and back");
        }
    }
    (rows, trainer.checkpoint())
}

#[test]
fn an_interrupted_run_equals_an_uninterrupted_one_on_any_number_of_threads() {
    for algorithm in ["mackrl", "central-v"] {
        let config = config(algorithm);
        let whole = train(&config, &[1], u64::MAX);
        assert!(whole.0.len() > 5, "tests and rows: {}", whole.0.len());
        for (threads, pause) in [([1, 1], 1), ([2, 1], 2), ([1, 3], 3)] {
            assert!(
                train(&config, &threads, pause) == whole,
                "{algorithm} on {threads:?} threads, interrupted every {pause} iterations"
            );
        }
    }
}

/// A learner whose memory is full, and forgets, long before the end.
fn remembering(algorithm: &str) -> Config {
    let settings = [
        &format!("algorithm.name={algorithm}"),
        "algorithm.hidden=5",
        "algorithm.environments=3",
        "algorithm.memory_episodes=23",
        "algorithm.minibatch_episodes=7",
        "algorithm.target_interval_episodes=13",
        "algorithm.exploration_steps_env=1009",
        "test.interval_steps_env=701",
        "test.episodes=3",
        "run.metrics_interval_steps_env=307",
        "run.steps_env=2003",
    ];
    Config::with(&settings).unwrap()
}

#[test]
fn a_replay_memory_comes_back_to_the_byte_on_any_number_of_threads() {
    for algorithm in ["iql", "vdn", "qmix"] {
        let config = remembering(algorithm);
        let whole = train(&config, &[1], u64::MAX);
        assert!(whole.0.len() > 5, "tests and rows: {}", whole.0.len());
        assert_eq!(whole.1.memory, None, "nothing is learnt after the end");
        for (threads, pause) in [([1, 1], 1), ([2, 1], 3)] {
            assert!(
                train(&config, &threads, pause) == whole,
                "{algorithm} on {threads:?} threads, interrupted every {pause} iterations"
            );
        }
    }
}

#[test]
fn a_run_that_goes_on_does_not_do_so_without_its_memory() {
    let mut trainer = Trainer::new(&remembering("qmix"), 1).unwrap();
    while trainer.steps_env() < 500 {
        trainer.update().unwrap();
    }
    let sound = trainer.checkpoint();
    let memory = sound.memory.clone().expect("episodes to learn from");
    assert!(!memory.episodes.is_empty());
    let mut refused = |memory: Option<MemoryState>, why: &str| {
        let damaged = Checkpoint {
            memory,
            ..sound.clone()
        };
        let error = trainer.restore(&damaged).unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    };
    refused(None, "checkpoint has no replay memory");
    let mut cut = memory.clone();
    cut.episodes[1] = cut.episodes[1][..40].into();
    refused(Some(cut), "it is cut off");
    let mut larger = memory;
    larger.episodes.extend(larger.episodes.clone());
    larger.episodes.extend(larger.episodes.clone());
    refused(Some(larger), "expected at most 23");
    assert!(trainer.checkpoint() == sound, "nothing has changed");
}

#[test]
fn groups_with_advantages_of_their_own_resume_as_well() {
    for algorithm in ["iac", "coma", "mackrl-coma", "jal"] {
        let config = config(algorithm);
        let whole = train(&config, &[1], u64::MAX);
        assert!(train(&config, &[2, 1], 2) == whole, "{algorithm}");
    }
}

#[test]
fn rmsprop_resumes_as_well() {
    let mut config = config("central-v");
    config.algorithm.set("optimiser", "rmsprop").unwrap();
    assert!(train(&config, &[1], 2) == train(&config, &[1], u64::MAX));
}

fn trained() -> (Trainer, Checkpoint) {
    let mut trainer = Trainer::new(&config("central-v"), 1).unwrap();
    // Until something has been learnt since the last row.
    while trainer.update().unwrap().is_some() {}
    let checkpoint = trainer.checkpoint();
    (trainer, checkpoint)
}

#[test]
fn a_cut_checkpoint_is_refused_and_changes_nothing() {
    let (mut trainer, checkpoint) = trained();
    // The last byte of the counters is a line break, which nothing needs.
    for cut in [0, 1, 7, 100, checkpoint.counters.len() - 2] {
        let mut damaged = checkpoint.clone();
        damaged.counters.truncate(cut);
        assert!(trainer.restore(&damaged).is_err(), "counters cut at {cut}");
    }
    for cut in [0, 8, 100, checkpoint.tensors.len() - 1] {
        let mut damaged = checkpoint.clone();
        damaged.tensors.truncate(cut);
        assert!(trainer.restore(&damaged).is_err(), "tensors cut at {cut}");
    }
    assert!(trainer.checkpoint() == checkpoint, "nothing has changed");
}

#[test]
fn counters_that_no_run_can_have_are_refused_by_name() {
    let (mut trainer, checkpoint) = trained();
    let text = String::from_utf8(checkpoint.counters.clone()).unwrap();
    let mut message = |from: &str, to: &str| {
        assert!(text.contains(from), "{text}");
        let counters = text.replace(from, to).into_bytes();
        let damaged = Checkpoint {
            counters,
            ..checkpoint.clone()
        };
        trainer.restore(&damaged).unwrap_err().to_string()
    };
    assert_eq!(
        message("\"format\": 4", "\"format\": 2"),
        "checkpoint has format 2, expected 3 to 4"
    );
    let found = message("\"tests\": 1", "\"tests\": 18446744073709551615");
    assert!(found.contains("as `tests`, expected at most"), "{found}");
    let found = message("\"critic_loss\"", "\"critic_lost\"");
    assert!(found.contains("unknown metric `critic_lost`"), "{found}");
    let hash = message("\"experience_hash\": \"", "\"experience_hash\": \"x");
    assert!(hash.contains("expected 16 hexadecimal digits"), "{hash}");
    let found = message("\"episodes\"", "\"episode\"");
    assert!(found.contains("unknown field `episode`"), "{found}");
}

#[test]
fn the_best_weights_come_back_with_their_test_or_not_at_all() {
    let (mut trainer, checkpoint) = trained();
    let (test, weights) = trainer.best().expect("the team was tested");
    assert_eq!(test.episodes, 3);
    assert!(test.steps_env <= trainer.steps_env());
    assert_eq!(checkpoint.best.as_deref(), Some(weights));
    let without = Checkpoint {
        best: None,
        ..checkpoint.clone()
    };
    let error = trainer.restore(&without).unwrap_err().to_string();
    assert!(error.contains("best weights without their test"), "{error}");
    // As a version wrote it that did not keep them.
    let mut counters: serde_json::Value = serde_json::from_slice(&checkpoint.counters).unwrap();
    counters["format"] = 3.into();
    counters["trainer"].as_object_mut().unwrap().remove("best");
    let earlier = Checkpoint {
        counters: counters.to_string().into_bytes(),
        ..without
    };
    trainer.restore(&earlier).unwrap();
    assert_eq!(trainer.best(), None);
    trainer.restore(&checkpoint).unwrap();
    assert!(trainer.checkpoint() == checkpoint);
}

#[test]
fn a_checkpoint_of_another_configuration_is_refused() {
    let (_, checkpoint) = trained();
    let mut wider = config("central-v");
    wider.algorithm.set("hidden", 7).unwrap();
    let error = Trainer::new(&wider, 1).unwrap().restore(&checkpoint);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("expected F32 of shape"), "{error}");
    let mut other = config("central-v");
    other.algorithm.set("optimiser", "rmsprop").unwrap();
    let error = Trainer::new(&other, 1).unwrap().restore(&checkpoint);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("no tensor `opt.rmsprop.v."), "{error}");
}
