//! You will see a hash of every kind of number that learning and acting come from: the same on every machine and instruction set.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use mackrl::{
    Real,
    nn::{
        InstructionSet, MaskedLogSoftmax, NetworkSizes, Optimiser, OptimiserKind, ParameterLayout,
        RecurrentNetwork, Retention, Trace, clip_gradient_norm,
    },
};
use mackrl_env::{Draw, EpisodeKey, Stream};
use mackrl_run::{config::Config, training::Trainer};

/// A rest of columns after whole vectors of every width.
const SIZES: NetworkSizes = NetworkSizes {
    inputs: 37,
    hidden: 64,
    outputs: 122,
};
const ROWS: usize = 13;
const STEPS: usize = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("instruction set: {}", InstructionSet::chosen()?);
    let key = EpisodeKey::new(7, Stream::Other, 0);
    let numbers = |seed: usize, count: usize| -> Vec<f32> {
        let draw = |index| f32::from_f64(2.0 * key.uniform(seed, Draw::World(index)) - 1.0);
        (0..count).map(draw).collect()
    };
    let wide = numbers(0, 100_000);
    tell(
        "exponentials",
        bits(wide.iter().map(|&x| Real::exp(90.0 * x))),
    );
    tell(
        "logarithms",
        bits(wide.iter().map(|&x| Real::ln(x.abs() + 1e-6))),
    );

    let mut layout = ParameterLayout::new();
    let network = RecurrentNetwork::new(&mut layout, "controller", SIZES);
    for (name, kind) in [
        ("Adam", OptimiserKind::ADAM),
        ("RMSprop", OptimiserKind::RMSPROP),
    ] {
        let mut parameters = vec![0.0; layout.len()];
        network.initialise(&key, &mut parameters);
        let mut optimiser = Optimiser::new(kind, layout.len());
        let mut trace = Trace::new(SIZES, Retention::Episode);
        let law = MaskedLogSoftmax {
            columns: SIZES.outputs,
            epsilon: 0.1,
        };
        let [mut hidden, mut logits, mut tables, mut gradients] = [const { Vec::new() }; 4];
        for update in 0..3 {
            let weights = network.weights(&parameters);
            let inputs = numbers(1 + update, STEPS * ROWS * SIZES.inputs);
            let mask: Vec<bool> = (0..ROWS * SIZES.outputs).map(|i| i % 5 != 2).collect();
            let [mut log_p, mut softmax] = [(); 2].map(|()| vec![0.0; mask.len()]);
            trace.begin_episode();
            for (t, x) in inputs.chunks(ROWS * SIZES.inputs).enumerate() {
                trace.begin_step(ROWS, None);
                network.step(&weights, x, &mut trace);
                law.forward(trace.last_logits(), &mask, &mut log_p, &mut softmax);
                hidden.extend_from_slice(trace.hidden(t));
                logits.extend_from_slice(trace.last_logits());
                tables.extend_from_slice(&log_p);
                let rows = log_p
                    .chunks(SIZES.outputs)
                    .zip(softmax.chunks(SIZES.outputs));
                let places = trace.logits_gradient_mut(t).chunks_mut(SIZES.outputs);
                for ((log_p, softmax), gradient) in rows.zip(places) {
                    law.row_gradient(log_p, softmax, &[(0, -0.3), (t, 0.7)], gradient);
                }
            }
            let mut gradient = vec![0.0; layout.len()];
            network.backward(&weights, &inputs, &mut trace, &mut gradient);
            clip_gradient_norm(&mut gradient, 1.0);
            gradients.extend_from_slice(&gradient);
            optimiser.step(0.01, &gradient, &mut parameters);
        }
        for (what, numbers) in [
            ("hidden states (sigmoid, tanh)", hidden),
            ("logits", logits),
            ("explored log-probabilities", tables),
            ("gradients", gradients),
            ("parameters", parameters),
        ] {
            tell(&format!("{name}: {what}"), bits(numbers));
        }
    }
    let mut trainer = Trainer::new(
        &Config::with(&["algorithm.name=mackrl", "run.steps_env=1000"])?,
        1,
    )?;
    while !trainer.finished() {
        trainer.update()?;
    }
    let weights = trainer.weights();
    tell(
        "weights of a team that drew its actions and learnt from them",
        weights,
    );
    Ok(())
}

/// Prints the FNV-1a hash of some bytes.
fn tell(what: &str, bytes: impl IntoIterator<Item = u8>) {
    let hash = bytes
        .into_iter()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
    println!("{hash:016x}  {what}");
}

fn bits(numbers: impl IntoIterator<Item = f32>) -> impl Iterator<Item = u8> {
    let words = numbers.into_iter().map(f32::to_bits);
    words.flat_map(u32::to_le_bytes)
}
