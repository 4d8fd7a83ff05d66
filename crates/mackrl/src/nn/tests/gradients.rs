//! Every backward pass against central differences in `f64`.

use super::{SIZES, network, numbers};
use crate::nn::{
    FeedForward, FeedForwardTrace, MaskedLogSoftmax, NetworkSizes, ParameterLayout,
    RecurrentNetwork, Retention, Trace,
};

/// Small, because what is normalised curves strongly where a row hardly varies.
const STEP: f64 = 1e-6;
const TOLERANCE: f64 = 1e-6;

/// Compares a gradient with central differences of `loss`, element by element.
///
/// The error is relative to the element, or to a hundredth of the largest where an element is smaller: differences of a loss
/// cannot resolve more.
fn check(gradient: &[f64], point: &[f64], mut loss: impl FnMut(&[f64]) -> f64) {
    let largest = gradient
        .iter()
        .fold(0.0_f64, |largest, g| largest.max(g.abs()));
    assert!(largest > 1e-2, "a gradient of zeros shows nothing");
    let mut moved = point.to_vec();
    for (i, &analytic) in gradient.iter().enumerate() {
        let [above, below] = [STEP, -STEP].map(|step| {
            moved[i] = point[i] + step;
            loss(&moved)
        });
        moved[i] = point[i];
        let numeric = (above - below) / (2.0 * STEP);
        let error = (analytic - numeric).abs() / analytic.abs().max(0.01 * largest);
        assert!(
            error < TOLERANCE,
            "element {i}: {analytic} is not {numeric}"
        );
    }
}

/// The inputs of step `t`.
fn inputs(rows: usize, t: usize) -> Vec<f64> {
    numbers(rows * SIZES.inputs, t)
}

/// The inputs of all steps.
fn all_inputs(episode: &[(usize, Option<Vec<usize>>)]) -> Vec<f64> {
    let steps = episode.iter().enumerate();
    steps.flat_map(|(t, (rows, _))| inputs(*rows, t)).collect()
}

/// Runs an episode and returns Σ coefficient · logit over all steps.
fn run_episode(
    network: &RecurrentNetwork,
    parameters: &[f64],
    episode: &[(usize, Option<Vec<usize>>)],
    trace: &mut Trace<f64>,
) -> f64 {
    let weights = network.weights(parameters);
    trace.begin_episode();
    let mut loss = 0.0;
    for (t, (rows, carry)) in episode.iter().enumerate() {
        trace.begin_step(*rows, carry.as_deref());
        if trace.selective {
            trace.ask(&(0..*rows).rev().collect::<Vec<_>>());
        }
        network.step(&weights, &inputs(*rows, t), trace);
        let coefficients = numbers::<f64>(rows * SIZES.outputs, 100 + t);
        loss += trace
            .last_logits()
            .iter()
            .zip(&coefficients)
            .map(|(x, c)| x * c)
            .sum::<f64>();
    }
    loss
}

fn check_episode(episode: &[(usize, Option<Vec<usize>>)]) {
    let (plain, parameters, weights) = network::<f64>(SIZES);
    for network in [plain.clone(), plain.with_normalisation()] {
        for mut trace in [
            Trace::new(SIZES, Retention::Episode),
            Trace::selective(SIZES, Retention::Episode),
        ] {
            run_episode(&network, &parameters, episode, &mut trace);
            for (t, (rows, _)) in episode.iter().enumerate() {
                let coefficients = numbers::<f64>(rows * SIZES.outputs, 100 + t);
                trace.logits_gradient_mut(t).copy_from_slice(&coefficients);
            }
            let mut gradient = vec![0.0; parameters.len()];
            network.backward(&weights, &all_inputs(episode), &mut trace, &mut gradient);
            check(&gradient, &parameters, |parameters| {
                run_episode(&network, parameters, episode, &mut trace)
            });
        }
    }
}

#[test]
fn network_gradient_is_right_where_all_rows_stay() {
    check_episode(&[(5, None), (5, None), (5, None)]);
}

#[test]
fn network_gradient_is_right_where_rows_leave() {
    check_episode(&[
        (5, None),
        (3, Some(vec![0, 2, 4])),
        (3, None),
        (2, Some(vec![2, 0])),
    ]);
}

#[test]
fn network_gradient_is_right_where_no_row_is_left_at_the_end() {
    check_episode(&[(3, None), (3, None), (0, Some(vec![])), (0, None)]);
}

#[test]
fn network_gradient_is_right_where_two_rows_continue_one() {
    check_episode(&[(2, None), (3, Some(vec![1, 1, 0])), (1, None)]);
}

#[test]
fn network_gradient_is_right_over_several_blocks_of_steps() {
    check_episode(&[(71, None), (67, None), (67, None), (59, None), (53, None)]);
}

#[test]
#[should_panic(expected = "activations can be differentiated once")]
fn used_up_activations_are_not_differentiated_again() {
    let (network, parameters, weights) = network::<f64>(SIZES);
    let mut trace = Trace::new(SIZES, Retention::Episode);
    run_episode(&network, &parameters, &[(3, None)], &mut trace);
    trace.logits_gradient_mut(0).fill(1.0);
    let mut gradient = vec![0.0; parameters.len()];
    for _ in 0..2 {
        network.backward(&weights, &inputs(3, 0), &mut trace, &mut gradient);
    }
}

#[test]
fn gradients_add_to_what_is_there() {
    let (network, parameters, weights) = network::<f64>(SIZES);
    let mut trace = Trace::new(SIZES, Retention::Episode);
    let mut gradient_from = |start: f64| {
        run_episode(&network, &parameters, &[(3, None)], &mut trace);
        trace.logits_gradient_mut(0).fill(1.0);
        let mut gradient = vec![start; parameters.len()];
        network.backward(&weights, &inputs(3, 0), &mut trace, &mut gradient);
        gradient
    };
    for (more, less) in gradient_from(1.0).iter().zip(gradient_from(0.0)) {
        assert!(
            (more - less - 1.0).abs() < 1e-12,
            "{more} is not 1 + {less}"
        );
    }
}

#[test]
fn critic_gradient_is_right() {
    let sizes = NetworkSizes {
        inputs: 13,
        hidden: 7,
        outputs: 1,
    };
    let mut layout = ParameterLayout::new();
    let critic = FeedForward::new(&mut layout, "critic", sizes);
    let parameters = numbers::<f64>(layout.len(), 1);
    let rows = 5;
    let coefficients = numbers::<f64>(rows, 3);
    let run = |parameters: &[f64]| {
        let mut trace = FeedForwardTrace::new(sizes);
        let inputs = numbers::<f64>(rows * sizes.inputs, 2);
        trace.begin(rows).copy_from_slice(&inputs);
        critic.forward(&critic.weights(parameters), &mut trace);
        trace
    };
    let mut trace = run(&parameters);
    let (_, outputs_gradient) = trace.outputs_and_gradient_mut();
    outputs_gradient.copy_from_slice(&coefficients);
    let mut gradient = vec![0.0; layout.len()];
    critic.backward(&critic.weights(&parameters), &mut trace, &mut gradient);
    check(&gradient, &parameters, |parameters| {
        let trace = run(parameters);
        let terms = trace.outputs().iter().zip(&coefficients);
        terms.map(|(y, c)| y * c).sum()
    });
}

fn check_softmax(epsilon: f64) {
    let columns = 19;
    let law = MaskedLogSoftmax { columns, epsilon };
    let logits = numbers::<f64>(columns, 4);
    let mask: Vec<bool> = (0..columns).map(|column| column % 3 != 1).collect();
    let weights = [(0, 0.7), (5, -1.3), (17, 0.2), (5, 0.4)];
    let forward = |logits: &[f64]| {
        let (mut log_p, mut softmax) = (vec![0.0; columns], vec![0.0; columns]);
        law.forward(logits, &mask, &mut log_p, &mut softmax);
        (log_p, softmax)
    };
    let (log_p, softmax) = forward(&logits);
    let total: f64 = log_p.iter().map(|log_p| log_p.exp()).sum();
    assert!((total - 1.0).abs() < 1e-12, "probabilities sum to {total}");
    let mut gradient = vec![f64::NAN; columns];
    law.row_gradient(&log_p, &softmax, &weights, &mut gradient);
    check(&gradient, &logits, |logits| {
        let (log_p, _) = forward(logits);
        weights
            .iter()
            .map(|&(column, weight)| weight * log_p[column])
            .sum()
    });
    for column in (0..columns).filter(|&column| !mask[column]) {
        assert_eq!(log_p[column], f64::NEG_INFINITY, "masked log-probability");
        assert_eq!(gradient[column], 0.0, "masked gradient");
    }
}

#[test]
fn softmax_gradient_is_right_without_exploration() {
    check_softmax(0.0);
}

#[test]
fn softmax_gradient_is_right_with_exploration() {
    check_softmax(0.3);
}

#[test]
fn entropy_of_equal_columns_is_the_logarithm_of_their_number() {
    let law = MaskedLogSoftmax {
        columns: 5,
        epsilon: 0.0_f64,
    };
    let (mut log_p, mut softmax) = ([0.0; 5], [0.0; 5]);
    law.forward(
        &[2.0; 5],
        &[true, false, true, true, false],
        &mut log_p,
        &mut softmax,
    );
    let entropy = MaskedLogSoftmax::row_entropy(&log_p);
    assert!((entropy - 3.0_f64.ln()).abs() < 1e-12, "entropy {entropy}");
}
