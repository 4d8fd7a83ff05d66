//! The mixer against its equation, its gradients against differences, and the property that gives it its name.

use mackrl_env::{Draw, Stream};
use proptest::prelude::*;

use super::*;

const STEPS: usize = 5;

fn sizes(hypernetwork_hidden: Option<usize>) -> MonotonicSizes {
    MonotonicSizes {
        state: 7,
        members: 3,
        hidden: 11,
        hypernetwork_hidden,
    }
}

fn numbers(count: usize, kind: usize) -> Vec<f64> {
    let key = EpisodeKey::new(2, Stream::Other, 0);
    (0..count)
        .map(|i| key.normal(kind, Draw::World(i)))
        .collect()
}

/// A mixer whose parameters are all of about unit size, the biases too.
fn mixer(hypernetwork_hidden: Option<usize>) -> (ParameterLayout, Monotonic, Vec<f64>) {
    let mut layout = ParameterLayout::new();
    let mixer = Monotonic::new(&mut layout, sizes(hypernetwork_hidden));
    let parameters = numbers(layout.len(), 1);
    (layout, mixer, parameters)
}

fn mix(mixer: &Monotonic, parameters: &[f64], state_sg: &[f64], value_sn: &[f64]) -> Vec<f64> {
    let mut mixed = vec![0.0; STEPS];
    let mut trace = mixer.trace();
    let weights = mixer.weights(parameters);
    mixer.mix(&weights, [state_sg, value_sn], &mut trace, &mut mixed);
    mixed
}

/// The equation, from tensors by their names.
fn literal(layout: &ParameterLayout, parameters: &[f64], state_g: &[f64], value_n: &[f64]) -> f64 {
    let affine = |name: &str, x: &[f64]| -> Vec<f64> {
        let tensor = |part: &str| {
            let name = format!("mixer.{name}.{part}");
            let mut tensors = layout.tensors().iter();
            let found = tensors.find(|tensor| tensor.name == name);
            &parameters[found.expect("a tensor of this name").range.clone()]
        };
        let (weight, bias) = (tensor("weight"), tensor("bias"));
        let output = |j: usize| {
            let terms = x.iter().enumerate();
            bias[j]
                + terms
                    .map(|(k, x)| x * weight[k * bias.len() + j])
                    .sum::<f64>()
        };
        (0..bias.len()).map(output).collect()
    };
    let two = |name: &str| {
        let between = affine(&format!("{name}.input"), state_g);
        let between: Vec<f64> = between.iter().map(|x| x.max(0.0)).collect();
        affine(&format!("{name}.output"), &between)
    };
    let (first, second) = (two("first_weight"), two("second_weight"));
    let bias = affine("first_bias", state_g);
    let mut mixed = two("value")[0];
    for h in 0..11 {
        let sum: f64 = (0..3).map(|n| value_n[n] * first[n * 11 + h].abs()).sum();
        let x = sum + bias[h];
        let unit = if x > 0.0 { x } else { x.exp() - 1.0 };
        mixed += unit * second[h].abs();
    }
    mixed
}

#[test]
fn it_is_the_equation() {
    let (layout, mixer, parameters) = mixer(Some(5));
    let (states, values) = (numbers(STEPS * 7, 2), numbers(STEPS * 3, 3));
    let mixed = mix(&mixer, &parameters, &states, &values);
    for (s, mixed) in mixed.iter().enumerate() {
        let expected = literal(
            &layout,
            &parameters,
            &states[s * 7..][..7],
            &values[s * 3..][..3],
        );
        assert!((mixed - expected).abs() < 1e-9, "{mixed}, {expected}");
    }
}

#[test]
fn gradients_are_those_of_what_it_mixes() {
    for hypernetwork_hidden in [None, Some(5)] {
        let (layout, mixer, parameters) = mixer(hypernetwork_hidden);
        let (states, values) = (numbers(STEPS * 7, 2), numbers(STEPS * 3, 3));
        let coefficients = numbers(STEPS, 4);
        let loss = |parameters: &[f64], values: &[f64]| -> f64 {
            let mixed = mix(&mixer, parameters, &states, values);
            mixed.iter().zip(&coefficients).map(|(v, c)| v * c).sum()
        };
        let (mut trace, mut mixed) = (mixer.trace(), vec![0.0; STEPS]);
        let weights = mixer.weights(&parameters);
        mixer.mix(&weights, [&states, &values], &mut trace, &mut mixed);
        let (mut d_values, mut gradient) = (vec![0.0; STEPS * 3], vec![0.0; layout.len()]);
        mixer.backward(
            &weights,
            [&values, &coefficients],
            &mut trace,
            &mut d_values,
            &mut gradient,
        );
        let check = |name: &str, found: &[f64], point: &[f64], loss: &dyn Fn(&[f64]) -> f64| {
            let largest = found.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            for i in 0..point.len() {
                let [above, below] = [1e-6, -1e-6].map(|step| {
                    let mut moved = point.to_vec();
                    moved[i] += step;
                    loss(&moved)
                });
                let slope = (above - below) / 2e-6;
                let error = (found[i] - slope).abs() / slope.abs().max(0.01 * largest);
                assert!(error < 1e-6, "{name} {i}: {} is not {slope}", found[i]);
            }
        };
        check("parameter", &gradient, &parameters, &|p| loss(p, &values));
        check("value", &d_values, &values, &|v| loss(&parameters, v));
    }
}

proptest! {
    #[test]
    fn what_is_mixed_never_falls_where_a_value_rises(
        seed in 0..1000_usize,
        member in 0..3_usize,
        rise in 0.0..100.0_f64,
        scale in 0.01..100.0_f64,
    ) {
        let (layout, mixer, _) = mixer(Some(5));
        let scaled = |numbers: Vec<f64>| -> Vec<f64> {
            numbers.into_iter().map(|x| x * scale).collect()
        };
        let parameters = scaled(numbers(layout.len(), 10 + seed));
        let states = numbers(STEPS * 7, 2 + seed);
        let values = scaled(numbers(STEPS * 3, 3 + seed));
        let mut risen = values.clone();
        risen.iter_mut().skip(member).step_by(3).for_each(|value| *value += rise);
        let [before, after] = [values, risen].map(|v| mix(&mixer, &parameters, &states, &v));
        for (before, after) in before.iter().zip(&after) {
            // Sums of rounded terms may lose a little of what is lost in them.
            prop_assert!(*after >= before - 1e-9 * before.abs().max(1.0));
        }
    }
}
