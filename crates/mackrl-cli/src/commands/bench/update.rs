//! `mackrl bench update`: how long one update of the pair controllers takes.

use std::time::Instant;

use mackrl::nn::{InstructionSet, NetworkSizes, benchmark::UpdateProbe};
use serde::Serialize;

use super::print_rows;
use crate::{args::BenchUpdateArgs, failure::Failure, output};

/// Updates that are not timed: they touch the memory for the first time.
const WARM_UP: usize = 3;
/// Most rows times steps: what they need fits into the memory of small machines.
const ENTRIES_MOST: usize = 200_000;

#[derive(Debug, Serialize)]
struct UpdateSpeed {
    simd: &'static str,
    rows: usize,
    steps: usize,
    inputs: usize,
    hidden: usize,
    outputs: usize,
    updates: usize,
    min_ms: f64,
    median_ms: f64,
    /// Arithmetic of the matrix products of one update.
    gflop: f64,
    /// Its rate in the fastest update.
    gflop_per_s: f64,
}

pub(super) fn run(args: &BenchUpdateArgs) -> anyhow::Result<()> {
    let most = ENTRIES_MOST / args.rows.get();
    if args.steps.get() > most {
        let (rows, steps) = (args.rows, args.steps);
        let message = format!("--steps {steps} with --rows {rows}: expected at most {most}");
        return Err(Failure::usage(message).into());
    }
    let speed = measure(args, InstructionSet::chosen()?);
    if args.json {
        return output::print_json(&speed);
    }
    print_rows(&[
        ("instruction set", speed.simd.to_owned()),
        ("rows", speed.rows.to_string()),
        ("steps", speed.steps.to_string()),
        ("updates", speed.updates.to_string()),
        ("fastest, ms", format!("{:.3}", speed.min_ms)),
        ("median, ms", format!("{:.3}", speed.median_ms)),
        ("GFLOP of matrix products", format!("{:.3}", speed.gflop)),
        (
            "GFLOP a second, fastest",
            format!("{:.1}", speed.gflop_per_s),
        ),
    ])
}

fn measure(args: &BenchUpdateArgs, instructions: InstructionSet) -> UpdateSpeed {
    let sizes = UpdateProbe::PAIR_CONTROLLER;
    let (rows, steps) = (args.rows.get(), args.steps.get());
    let mut probe = UpdateProbe::new(sizes, rows, steps);
    for _ in 0..WARM_UP {
        probe.run();
    }
    let mut times_ms: Vec<f64> = (0..args.updates.get())
        .map(|_| {
            let start = Instant::now();
            std::hint::black_box(probe.run());
            1e3 * start.elapsed().as_secs_f64()
        })
        .collect();
    times_ms.sort_by(f64::total_cmp);
    let NetworkSizes {
        inputs,
        hidden,
        outputs,
    } = sizes;
    let gflop = 1e-9 * UpdateProbe::flop(sizes, rows, steps);
    UpdateSpeed {
        simd: instructions.name(),
        rows,
        steps,
        inputs,
        hidden,
        outputs,
        updates: times_ms.len(),
        min_ms: times_ms[0],
        median_ms: times_ms[times_ms.len() / 2],
        gflop,
        gflop_per_s: gflop / (1e-3 * times_ms[0]),
    }
}
