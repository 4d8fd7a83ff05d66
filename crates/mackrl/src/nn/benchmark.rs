//! The update that this project measures itself by: pair controllers over whole episodes, on made-up data.

use mackrl_env::{Draw, EpisodeKey, Stream};

use crate::nn::{
    MaskedLogSoftmax, NetworkSizes, Optimiser, OptimiserKind, ParameterLayout, RecurrentNetwork,
    RecurrentWeights, Retention, Trace, clip_gradient_norm,
};

/// Every third feature is not zero: observations are mostly one-hot codes and units out of sight.
const FEATURE_EVERY: usize = 3;

/// Everything that one update of a recurrent controller needs, allocated once.
#[derive(Debug, Clone)]
pub struct UpdateProbe {
    network: RecurrentNetwork,
    parameters: Vec<f32>,
    weights: RecurrentWeights<f32>,
    optimiser: Optimiser<f32>,
    gradient: Vec<f32>,
    trace: Trace<f32>,
    steps: usize,
    rows: usize,
    inputs: Vec<f32>,
    mask: Vec<bool>,
    log_p: Vec<f32>,
    softmax: Vec<f32>,
}

impl UpdateProbe {
    /// The pair controllers of the design's table of figures have sizes 128 → 64 → 64 → 122, 80 rows and 60 steps.
    pub const PAIR_CONTROLLER: NetworkSizes = NetworkSizes {
        inputs: 128,
        hidden: 64,
        outputs: 122,
    };

    /// Makes up an update of a network of the given sizes, over `steps` steps of `rows` rows.
    #[must_use]
    pub fn new(sizes: NetworkSizes, rows: usize, steps: usize) -> Self {
        let key = EpisodeKey::new(0, Stream::Other, 0);
        let mut layout = ParameterLayout::new();
        let network = RecurrentNetwork::new(&mut layout, "pair_controller", sizes);
        let mut parameters = vec![0.0; layout.len()];
        network.initialise(&key, &mut parameters);
        let uniform = |step: usize, index: usize| key.uniform(step, Draw::World(index));
        let inputs = (0..steps * rows * sizes.inputs).map(|index| {
            if index % FEATURE_EVERY == 0 {
                crate::Real::from_f64(uniform(0, index))
            } else {
                0.0
            }
        });
        let mask = (0..steps * rows * sizes.outputs)
            .map(|index| index % sizes.outputs == 0 || uniform(1, index) < 0.7);
        Self {
            weights: network.weights(&parameters),
            optimiser: Optimiser::new(OptimiserKind::ADAM, layout.len()),
            gradient: vec![0.0; layout.len()],
            trace: Trace::new(sizes, Retention::Episode),
            steps,
            rows,
            inputs: inputs.collect(),
            mask: mask.collect(),
            log_p: vec![0.0; steps * rows * sizes.outputs],
            softmax: vec![0.0; steps * rows * sizes.outputs],
            network,
            parameters,
        }
    }

    /// Floating-point operations of an update's matrix products, a multiplication and an addition counted apart. The backward
    /// pass has two products for each of the forward pass, but none for the gradient of the inputs.
    #[must_use]
    pub const fn flop(sizes: NetworkSizes, rows: usize, steps: usize) -> f64 {
        let NetworkSizes {
            inputs,
            hidden,
            outputs,
        } = sizes;
        let first = inputs * hidden;
        let others = 2 * hidden * 3 * hidden + hidden * outputs;
        (2 * rows * steps * (2 * first + 3 * others)) as f64
    }

    /// Runs one whole update: the forward pass step by step with the masked log-softmax, the backward pass, clipping, Adam.
    /// Returns the gradient's norm.
    pub fn run(&mut self) -> f64 {
        let sizes = self.network.sizes();
        let law = MaskedLogSoftmax {
            columns: sizes.outputs,
            epsilon: 0.1,
        };
        self.forward(law);
        for t in 0..self.steps {
            let gradients = self.trace.logits_gradient_mut(t);
            let first = t * self.rows;
            for (row, gradient) in gradients.chunks_exact_mut(sizes.outputs).enumerate() {
                let place = (first + row) * sizes.outputs..(first + row + 1) * sizes.outputs;
                let weights = [(0, -0.01), (1 + (first + row) % (sizes.outputs - 1), 0.02)];
                law.row_gradient(
                    &self.log_p[place.clone()],
                    &self.softmax[place],
                    &weights,
                    gradient,
                );
            }
        }
        self.gradient.fill(0.0);
        self.network.backward(
            &self.weights,
            &self.inputs,
            &mut self.trace,
            &mut self.gradient,
        );
        let norm = clip_gradient_norm(&mut self.gradient, 10.0);
        self.optimiser
            .step(5e-4, &self.gradient, &mut self.parameters);
        self.network.refresh(&self.parameters, &mut self.weights);
        norm
    }

    fn forward(&mut self, law: MaskedLogSoftmax<f32>) {
        let (inputs, outputs) = (self.network.sizes().inputs, self.network.sizes().outputs);
        self.trace.begin_episode();
        for t in 0..self.steps {
            self.trace.begin_step(self.rows, None);
            let x = &self.inputs[t * self.rows * inputs..][..self.rows * inputs];
            self.network.step(&self.weights, x, &mut self.trace);
            let place = t * self.rows * outputs..(t + 1) * self.rows * outputs;
            law.forward(
                self.trace.last_logits(),
                &self.mask[place.clone()],
                &mut self.log_p[place.clone()],
                &mut self.softmax[place],
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_design_s_update_has_1_09_gflop() {
        let flop = UpdateProbe::flop(UpdateProbe::PAIR_CONTROLLER, 80, 60);
        assert!((flop * 1e-9 - 1.09).abs() < 0.005, "{flop}");
    }

    #[test]
    fn an_update_repeats_to_the_bit() {
        let sizes = NetworkSizes {
            inputs: 11,
            hidden: 7,
            outputs: 13,
        };
        let mut first = UpdateProbe::new(sizes, 5, 3);
        let mut second = first.clone();
        for _ in 0..2 {
            let (a, b) = (first.run(), second.run());
            assert!(a.is_finite() && a > 0.0, "gradient norm {a}");
            assert_eq!(a.to_bits(), b.to_bits(), "gradient norms");
        }
        assert_eq!(first.parameters, second.parameters, "parameters");
    }
}
