//! The contract of decentralised execution: a row's results depend on that row and the parameters, to the bit.

use super::{SIZES, network, numbers};
use crate::nn::{
    InstructionSet, MaskedLogSoftmax, NetworkSizes, Optimiser, OptimiserKind, Retention, Trace,
    clip_gradient_norm, instructions::on,
};

const STEPS: usize = 3;
/// Wider than a panel, with a rest of columns.
const WIDE: NetworkSizes = NetworkSizes {
    inputs: 37,
    hidden: 64,
    outputs: 122,
};

/// All numbers that an agent bases a decision on, for one row: logits and explored log-probabilities of every step.
fn row_results(
    sizes: NetworkSizes,
    rows: usize,
    position: usize,
    retention: Retention,
) -> Vec<u32> {
    let (network, _, weights) = network::<f32>(sizes);
    let mut trace = Trace::new(sizes, retention);
    let mut results = Vec::new();
    for t in 0..STEPS {
        trace.begin_step(rows, None);
        let seeds = (0..rows).map(|row| if row == position { 0 } else { 1 + row });
        let x: Vec<f32> = seeds
            .flat_map(|seed| numbers::<f32>(sizes.inputs, 1000 * t + seed))
            .collect();
        network.step(&weights, &x, &mut trace);
        let mask: Vec<bool> = (0..rows * sizes.outputs)
            .map(|place| (place % sizes.outputs) % 5 != 2)
            .collect();
        let (mut log_p, mut softmax) = (vec![0.0; mask.len()], vec![0.0; mask.len()]);
        for epsilon in [0.0, 0.25] {
            let law = MaskedLogSoftmax {
                columns: sizes.outputs,
                epsilon,
            };
            law.forward(trace.last_logits(), &mask, &mut log_p, &mut softmax);
            let place = position * sizes.outputs..(position + 1) * sizes.outputs;
            for values in [trace.last_logits(), &log_p, &softmax] {
                results.extend(values[place.clone()].iter().map(|value| value.to_bits()));
            }
        }
    }
    results
}

#[test]
fn a_row_alone_equals_the_row_in_any_batch_at_any_position() {
    for sizes in [SIZES, WIDE] {
        let alone = row_results(sizes, 1, 0, Retention::Episode);
        for rows in [2, 7, 40, 83] {
            for position in 0..rows {
                let among = row_results(sizes, rows, position, Retention::Episode);
                assert_eq!(among, alone, "row {position} of {rows}");
            }
        }
    }
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    for sizes in [SIZES, WIDE] {
        for (rows, position) in [(1, 0), (7, 3), (13, 12)] {
            let chosen = row_results(sizes, rows, position, Retention::Episode);
            for set in InstructionSet::available() {
                let results = on(set, || {
                    row_results(sizes, rows, position, Retention::Episode)
                });
                assert_eq!(results, chosen, "{set}, row {position} of {rows}");
            }
        }
    }
}

/// The parameters after two updates of each rule, and the norms of their gradients.
fn learned(sizes: NetworkSizes, rows: usize) -> Vec<u64> {
    let (network, initial, _) = network::<f32>(sizes);
    let mut trace = Trace::new(sizes, Retention::Episode);
    let mut gradient = vec![0.0; initial.len()];
    let mut results = Vec::new();
    for kind in [OptimiserKind::ADAM, OptimiserKind::RMSPROP] {
        let mut optimiser = Optimiser::new(kind, initial.len());
        let mut parameters = initial.clone();
        for update in 0..2 {
            let weights = network.weights(&parameters);
            trace.begin_episode();
            let mut inputs = Vec::new();
            for t in 0..STEPS {
                trace.begin_step(rows, None);
                let x = numbers::<f32>(rows * sizes.inputs, 10 * update + t);
                network.step(&weights, &x, &mut trace);
                inputs.extend(x);
            }
            for t in 0..STEPS {
                let of_logits = numbers::<f32>(rows * sizes.outputs, 100 + 10 * update + t);
                trace.logits_gradient_mut(t).copy_from_slice(&of_logits);
            }
            gradient.fill(0.0);
            network.backward(&weights, &inputs, &mut trace, &mut gradient);
            results.push(clip_gradient_norm(&mut gradient, 1.0).to_bits());
            optimiser.step(0.01, &gradient, &mut parameters);
        }
        results.extend(parameters.iter().map(|value| u64::from(value.to_bits())));
    }
    results
}

#[test]
fn every_instruction_set_learns_the_same_bits() {
    for (sizes, rows) in [(SIZES, 5), (WIDE, 83)] {
        let chosen = learned(sizes, rows);
        for set in InstructionSet::available() {
            let results = on(set, || learned(sizes, rows));
            assert_eq!(results, chosen, "{set}, {rows} rows");
        }
    }
}

#[test]
fn keeping_the_last_step_alone_changes_nothing() {
    let all = row_results(WIDE, 5, 2, Retention::Episode);
    assert_eq!(row_results(WIDE, 5, 2, Retention::LastStep), all, "results");
}

#[test]
fn rows_that_leave_change_nothing_for_those_that_stay() {
    let (network, _, weights) = network::<f32>(SIZES);
    let logits = |carry: Option<&[usize]>, watched: usize, rows: usize| {
        let mut trace = Trace::new(SIZES, Retention::Episode);
        trace.begin_step(5, None);
        network.step(&weights, &numbers(5 * SIZES.inputs, 0), &mut trace);
        trace.begin_step(rows, carry);
        network.step(&weights, &vec![0.5; rows * SIZES.inputs], &mut trace);
        trace.logits(1)[watched * SIZES.outputs..][..SIZES.outputs].to_vec()
    };
    let stays = logits(None, 3, 5);
    assert_eq!(logits(Some(&[4, 3]), 1, 2), stays, "row 3, now row 1");
    assert_ne!(logits(Some(&[4, 3]), 0, 2), stays, "row 4, now row 0");
}

#[test]
fn f32_equals_f64_up_to_rounding() {
    let sizes = WIDE;
    let (rows, steps) = (43, 5);
    let (network32, parameters, weights32) = network::<f32>(sizes);
    let parameters: Vec<f64> = parameters.iter().map(|&x| f64::from(x)).collect();
    let weights64 = network32.weights(&parameters);
    let mut trace32 = Trace::<f32>::new(sizes, Retention::Episode);
    let mut trace64 = Trace::<f64>::new(sizes, Retention::Episode);
    let (mut inputs32, mut inputs64) = (Vec::new(), Vec::new());
    for t in 0..steps {
        let size = rows * sizes.inputs;
        inputs32.extend(numbers::<f32>(size, t));
        inputs64.extend(inputs32[t * size..].iter().map(|&x| f64::from(x)));
        trace32.begin_step(rows, None);
        network32.step(&weights32, &inputs32[t * size..], &mut trace32);
        trace64.begin_step(rows, None);
        network32.step(&weights64, &inputs64[t * size..], &mut trace64);
        for (&single, &double) in trace32.logits(t).iter().zip(trace64.logits(t)) {
            assert!(
                (f64::from(single) - double).abs() < 2e-6,
                "{single} is not {double}"
            );
        }
    }
    for t in 0..steps {
        let gradient = numbers::<f32>(rows * sizes.outputs, 100 + t);
        trace32.logits_gradient_mut(t).copy_from_slice(&gradient);
        for (to, &from) in trace64.logits_gradient_mut(t).iter_mut().zip(&gradient) {
            *to = f64::from(from);
        }
    }
    let mut gradient32 = vec![0.0_f32; parameters.len()];
    let mut gradient64 = vec![0.0_f64; parameters.len()];
    network32.backward(&weights32, &inputs32, &mut trace32, &mut gradient32);
    network32.backward(&weights64, &inputs64, &mut trace64, &mut gradient64);
    let largest = gradient64
        .iter()
        .fold(0.0_f64, |largest, g| largest.max(g.abs()));
    for (i, (&single, &double)) in gradient32.iter().zip(&gradient64).enumerate() {
        let error = (f64::from(single) - double).abs() / largest;
        assert!(error < 2e-6, "parameter {i}: {single} is not {double}");
    }
}
