//! `mackrl bench train`: environment steps a second in training, and where the time goes.

use std::{collections::BTreeMap, time::Instant};

use mackrl::{Phase, nn::InstructionSet};
use mackrl_run::training::Trainer;
use serde::Serialize;

use super::print_rows;
use crate::{
    args::{BenchTrainArgs, ConfigurationArgs},
    output,
};

/// Environment steps to train for if nothing else is asked for.
const STEPS: u64 = 100_000;

#[derive(Debug, Serialize)]
struct TrainingSpeed {
    map: String,
    algorithm: String,
    preset: String,
    simd: &'static str,
    threads: usize,
    steps: u64,
    wall_s: f64,
    env_steps_per_s: f64,
    /// Share of the wall-clock time by phase; all sum to 1.
    shares: BTreeMap<&'static str, f64>,
}

pub(super) fn run(args: &BenchTrainArgs) -> anyhow::Result<()> {
    let speed = measure(args)?;
    if args.json {
        return output::print_json(&speed);
    }
    let mut rows = vec![
        ("map", speed.map),
        ("algorithm", speed.algorithm),
        ("instruction set", speed.simd.to_owned()),
        ("threads", speed.threads.to_string()),
        ("environment steps", speed.steps.to_string()),
        ("seconds", format!("{:.3}", speed.wall_s)),
        ("steps a second", format!("{:.0}", speed.env_steps_per_s)),
    ];
    for phase in Phase::ALL {
        let share = 100.0 * speed.shares[phase.name()];
        rows.push((phase.name(), format!("{share:.1} %")));
    }
    print_rows(&rows)
}

fn measure(args: &BenchTrainArgs) -> anyhow::Result<TrainingSpeed> {
    let typed = &args.configuration;
    let configuration = ConfigurationArgs {
        steps: Some(typed.steps.unwrap_or(STEPS)),
        ..typed.clone()
    };
    let config = configuration.layers()?.build()?;
    let threads = args.threads.count();
    let mut trainer = Trainer::new(&config, threads)?;
    trainer.start_stopwatch();
    let start = Instant::now();
    while !trainer.finished() {
        trainer.update()?;
    }
    let wall_s = start.elapsed().as_secs_f64();
    let spent_s = |phase| trainer.stopwatch().spent(phase).as_secs_f64();
    let total_s: f64 = Phase::ALL.map(spent_s).iter().sum();
    let share = |phase: Phase| (phase.name(), spent_s(phase) / total_s.max(1e-9));
    Ok(TrainingSpeed {
        map: config.env.map().to_owned(),
        algorithm: config.algorithm.name().to_owned(),
        preset: typed.preset().to_owned(),
        simd: InstructionSet::chosen()?.name(),
        threads,
        steps: trainer.steps_env(),
        wall_s,
        env_steps_per_s: trainer.steps_env() as f64 / wall_s.max(1e-9),
        shares: Phase::ALL.map(share).into_iter().collect(),
    })
}
