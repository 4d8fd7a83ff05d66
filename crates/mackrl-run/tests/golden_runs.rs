//! What a run computes has a version: the same configuration gives the same weights until that version is raised.

use std::{fs, path::Path};

use mackrl_run::{
    config::{Config, ConfigBuilder, Registry},
    provenance::{LEARNING_VERSION, sha256},
    training::Trainer,
};
use mackrl_skirmish::SIMULATOR_VERSION;
use serde_json::{Value, json};

/// Preset, map and algorithm.
const RUNS: [[&str; 3]; 9] = [
    ["paper-code", "3m", "mackrl"],
    ["paper-code", "3m", "central-v"],
    ["paper-code", "2s3z", "mackrl"],
    ["paper-code", "2s3z", "central-v"],
    ["default", "3m", "mackrl-ppo"],
    ["default", "2s3z", "mappo"],
    ["pymarl-qmix", "3m", "qmix"],
    ["pymarl-coma", "3m", "coma"],
    ["default", "3m", "mackrl-coma"],
];

fn config([preset, map, algorithm]: [&str; 3]) -> Config {
    let settings = [
        format!("env.map={map}"),
        format!("algorithm.name={algorithm}"),
        "run.steps_env=3000".to_owned(),
        "run.seed=1".to_owned(),
    ];
    let preset = ConfigBuilder::new(&Registry::built_in()).preset(preset);
    let builder = settings
        .iter()
        .try_fold(preset.expect("a shipped preset"), |builder, setting| {
            builder.set(setting)
        });
    let config = builder.and_then(|builder| builder.build());
    config.expect("a configuration that can be trained")
}

fn weights_sha256(run: [&str; 3]) -> String {
    let mut trainer = Trainer::new(&config(run), 2).expect("a run");
    while !trainer.finished() {
        trainer.update().expect("the run goes on");
    }
    sha256(&trainer.weights())
}

#[test]
fn the_same_versions_train_the_same_weights() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/runs.json");
    let golden = fs::read(&path).expect("the golden file");
    let golden: Value = serde_json::from_slice(&golden).expect("the golden file is JSON");
    let runs: Vec<Value> = RUNS
        .iter()
        .map(|run| {
            let [preset, map, algorithm] = run;
            let weights = weights_sha256(*run);
            json!({ "preset": preset, "map": map, "algorithm": algorithm, "weights_sha256": weights })
        })
        .collect();
    let found = json!({
        "of": "mackrl train --preset PRESET --map MAP --algorithm ALGORITHM --steps 3000 --seed 1: SHA-256 of weights.safetensors without its __metadata__",
        "simulator": SIMULATOR_VERSION,
        "learning": LEARNING_VERSION,
        "runs": runs,
    });
    assert!(
        found == golden,
        "runs give other weights than before. If that is meant, raise SIMULATOR_VERSION (mackrl-skirmish) if battles differ or \
         LEARNING_VERSION (mackrl-run) if learning does, tell it in CHANGELOG.md, and put this into {}:\n{found:#}",
        path.display()
    );
}
