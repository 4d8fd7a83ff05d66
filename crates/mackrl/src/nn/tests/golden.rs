//! Golden values, written by `scripts/golden/nn.py` from the published formulas.

use serde_json::Value;

use crate::{
    Real,
    nn::{
        Element, NetworkSizes, Optimiser, OptimiserKind, ParameterLayout, RecurrentNetwork,
        Retention, Trace,
    },
};

const SIZES: NetworkSizes = NetworkSizes {
    inputs: 5,
    hidden: 3,
    outputs: 7,
};
const ROWS: usize = 2;
const STEPS: usize = 4;

fn golden() -> Value {
    serde_json::from_str(include_str!("../../../tests/golden/nn.json")).unwrap()
}

/// All numbers in a value, in order.
fn flatten<R: Real>(value: &Value) -> Vec<R> {
    match value {
        Value::Array(values) => values.iter().flat_map(flatten).collect(),
        value => vec![R::from_f64(value.as_f64().unwrap())],
    }
}

fn assert_close<R: Real>(found: &[R], expected: &Value, tolerance: f64) {
    let expected = flatten::<f64>(expected);
    assert_eq!(found.len(), expected.len(), "how many numbers");
    for (found, expected) in found.iter().zip(expected) {
        let error = (found.to_f64() - expected).abs();
        assert!(error < tolerance, "{found:?} is not {expected}");
    }
}

fn check_network<E: Element>(tolerance: f64) {
    let golden = &golden()["network"];
    let mut layout = ParameterLayout::new();
    let network = RecurrentNetwork::new(&mut layout, "pair_controller", SIZES);
    let mut pytorch = Vec::<E>::new();
    for tensor in layout.tensors() {
        let name = tensor.name.strip_prefix("pair_controller.").unwrap();
        let values = flatten::<E>(&golden["parameters"][name]);
        assert_eq!(values.len(), tensor.range.len(), "size of {name}");
        pytorch.extend(values);
    }
    let weights = network.weights(&layout.from_pytorch(&pytorch));
    let inputs = flatten::<E>(&golden["inputs"]);
    let mut trace = Trace::new(SIZES, Retention::Episode);
    let (mut hidden, mut logits) = (Vec::new(), Vec::new());
    for t in 0..STEPS {
        trace.begin_step(ROWS, None);
        let input = &inputs[t * ROWS * SIZES.inputs..][..ROWS * SIZES.inputs];
        network.step(&weights, input, &mut trace);
        hidden.extend_from_slice(trace.hidden(t));
        logits.extend_from_slice(trace.logits(t));
    }
    assert_close(&hidden, &golden["hidden"], tolerance);
    assert_close(&logits, &golden["logits"], tolerance);
}

#[test]
fn network_in_f64_gives_the_golden_values() {
    check_network::<f64>(1e-13);
}

#[test]
fn network_in_f32_gives_the_golden_values() {
    check_network::<f32>(1e-6);
}

fn check_optimiser(kind: OptimiserKind, name: &str) {
    let golden = &golden()["optimisers"];
    let mut parameters = flatten::<f64>(&golden["parameters"]);
    let mut optimiser = Optimiser::new(kind, parameters.len());
    let rate = golden["learning_rate"].as_f64().unwrap();
    let gradients = golden["gradients"].as_array().unwrap();
    for (gradient, expected) in gradients.iter().zip(golden[name].as_array().unwrap()) {
        optimiser.step(rate, &flatten::<f64>(gradient), &mut parameters);
        assert_close(&parameters, expected, 1e-14);
    }
}

#[test]
fn adam_gives_the_golden_values() {
    check_optimiser(OptimiserKind::ADAM, "adam");
}

#[test]
fn rmsprop_gives_the_golden_values() {
    check_optimiser(OptimiserKind::RMSPROP, "rmsprop");
}
