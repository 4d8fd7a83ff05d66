//! The monotonic mixer of QMIX (Rashid and others, 2018): a small network whose weights are given by the state.
//!
//! Hypernetworks turn the state into the mixing network's weights, of which the absolute values are taken; biases may have any
//! sign. So the mixed value never falls in a member's value, while how much it rises depends on the state in any way.

use mackrl_env::EpisodeKey;

use super::Mixer;
use crate::{
    Real,
    nn::{
        Element, FeedForward, FeedForwardTrace, FeedForwardWeights, ParameterLayout, absolute,
        absolute_gradient, elu, elu_gradient,
    },
};

/// Sizes of a [`Monotonic`] mixer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MonotonicSizes {
    /// G: length of a state, at least 1.
    pub state: usize,
    /// N: members, at least 1.
    pub members: usize,
    /// H: units of the mixing network's hidden layer, at least 1.
    pub hidden: usize,
    /// Units of the hidden layer of the hypernetworks that give weights; without it, they are affine.
    pub hypernetwork_hidden: Option<usize>,
}

/// A mixing network and its hypernetworks.
///
/// # Equation
/// `q_tot = |w₂(s)| · elu(|W₁(s)| q + b₁(s)) + v(s)`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Monotonic {
    sizes: MonotonicSizes,
    /// W₁, b₁, w₂ and v.
    networks: [FeedForward; 4],
}

/// The hypernetworks' weights.
#[derive(Debug, Clone)]
pub struct MonotonicWeights<R>([FeedForwardWeights<R>; 4]);

/// Activations of a [`Monotonic`] mixer.
#[derive(Debug, Clone)]
pub struct MonotonicTrace<R> {
    networks: [FeedForwardTrace<R>; 4],
    /// |W₁| \[S, N, H\]
    first_snh: Vec<R>,
    /// |w₂| \[S, H\]
    second_sh: Vec<R>,
    /// elu(…) \[S, H\]
    hidden_sh: Vec<R>,
    d_hidden_sh: Vec<R>,
}

impl Monotonic {
    /// Adds the tensors of `mixer.first_weight`, `mixer.first_bias`, `mixer.second_weight` and `mixer.value` to a layout.
    pub fn new(layout: &mut ParameterLayout, sizes: MonotonicSizes) -> Self {
        let MonotonicSizes {
            state,
            members,
            hidden,
            hypernetwork_hidden,
        } = sizes;
        let mut network = |name: &str, between: Option<usize>, outputs: usize| {
            let widths: Vec<usize> = [Some(state), between, Some(outputs)]
                .into_iter()
                .flatten()
                .collect();
            FeedForward::with_widths(layout, &format!("mixer.{name}"), &widths)
        };
        Self {
            sizes,
            networks: [
                network("first_weight", hypernetwork_hidden, members * hidden),
                network("first_bias", None, hidden),
                network("second_weight", hypernetwork_hidden, hidden),
                network("value", Some(hidden), 1),
            ],
        }
    }
}

impl Mixer for Monotonic {
    type Weights<E: Element> = MonotonicWeights<E>;
    type Trace<E: Element> = MonotonicTrace<E>;

    fn outputs(&self) -> usize {
        1
    }

    fn initialise<R: Real>(&self, key: &EpisodeKey, parameters: &mut [R]) {
        let networks = self.networks.iter();
        networks.for_each(|network| network.initialise(key, parameters));
    }

    fn weights<E: Element>(&self, parameters: &[E]) -> MonotonicWeights<E> {
        MonotonicWeights(
            self.networks
                .each_ref()
                .map(|network| network.weights(parameters)),
        )
    }

    fn trace<E: Element>(&self) -> MonotonicTrace<E> {
        MonotonicTrace {
            networks: self.networks.each_ref().map(FeedForwardTrace::of),
            first_snh: Vec::new(),
            second_sh: Vec::new(),
            hidden_sh: Vec::new(),
            d_hidden_sh: Vec::new(),
        }
    }

    fn mix<E: Element>(
        &self,
        weights: &MonotonicWeights<E>,
        [state_sg, value_sn]: [&[E]; 2],
        trace: &mut MonotonicTrace<E>,
        mixed_so: &mut [E],
    ) {
        let MonotonicSizes {
            state,
            members,
            hidden,
            ..
        } = self.sizes;
        let steps = mixed_so.len();
        assert_eq!(state_sg.len(), steps * state, "a state of every step");
        assert_eq!(value_sn.len(), steps * members, "a value of every member");
        let networks = self.networks.iter().zip(&weights.0);
        for ((network, weights), trace) in networks.zip(&mut trace.networks) {
            trace.begin(steps).copy_from_slice(state_sg);
            network.forward(weights, trace);
        }
        let [first, first_bias, second, value] = trace.networks.each_ref().map(|own| own.outputs());
        let MonotonicTrace {
            first_snh,
            second_sh,
            hidden_sh,
            ..
        } = trace;
        first_snh.resize(first.len(), E::ZERO);
        second_sh.resize(second.len(), E::ZERO);
        absolute(first, first_snh);
        absolute(second, second_sh);
        hidden_sh.clear();
        hidden_sh.extend_from_slice(first_bias);
        let rows = first_snh.chunks_exact(hidden).zip(value_sn);
        for (row, (weight_h, &value)) in rows.enumerate() {
            let sum_h = &mut hidden_sh[row / members * hidden..][..hidden];
            for (sum, &weight) in sum_h.iter_mut().zip(weight_h) {
                *sum += value * weight;
            }
        }
        elu(hidden_sh);
        let rows = hidden_sh
            .chunks_exact(hidden)
            .zip(second_sh.chunks_exact(hidden));
        for ((mixed, &value), (hidden_h, weight_h)) in mixed_so.iter_mut().zip(value).zip(rows) {
            *mixed = value;
            for (&unit, &weight) in hidden_h.iter().zip(weight_h) {
                *mixed += unit * weight;
            }
        }
    }

    fn backward<E: Element>(
        &self,
        weights: &MonotonicWeights<E>,
        [value_sn, d_mixed_so]: [&[E]; 2],
        trace: &mut MonotonicTrace<E>,
        d_value_sn: &mut [E],
        gradient: &mut [E],
    ) {
        let MonotonicSizes {
            members, hidden, ..
        } = self.sizes;
        let MonotonicTrace {
            networks: [first, first_bias, second, value],
            first_snh,
            second_sh,
            hidden_sh,
            d_hidden_sh,
        } = trace;
        value
            .outputs_and_gradient_mut()
            .1
            .copy_from_slice(d_mixed_so);
        let (outputs, d_second_sh) = second.outputs_and_gradient_mut();
        d_hidden_sh.resize(hidden_sh.len(), E::ZERO);
        for (i, &d_mixed) in d_mixed_so.iter().enumerate() {
            for i in i * hidden..(i + 1) * hidden {
                d_second_sh[i] = d_mixed * hidden_sh[i];
                d_hidden_sh[i] = d_mixed * second_sh[i];
            }
        }
        absolute_gradient(outputs, d_second_sh);
        elu_gradient(hidden_sh, d_hidden_sh);
        first_bias
            .outputs_and_gradient_mut()
            .1
            .copy_from_slice(d_hidden_sh);
        let (outputs, d_first_snh) = first.outputs_and_gradient_mut();
        for (row, (d_value, &value)) in d_value_sn.iter_mut().zip(value_sn).enumerate() {
            let d_hidden_h = &d_hidden_sh[row / members * hidden..][..hidden];
            let weight_h = &first_snh[row * hidden..][..hidden];
            let d_weight_h = &mut d_first_snh[row * hidden..][..hidden];
            *d_value = E::ZERO;
            for ((&d_hidden, &weight), d_weight) in d_hidden_h.iter().zip(weight_h).zip(d_weight_h)
            {
                *d_value += d_hidden * weight;
                *d_weight = d_hidden * value;
            }
        }
        absolute_gradient(outputs, d_first_snh);
        let networks = self.networks.iter().zip(&weights.0);
        for ((network, weights), trace) in networks.zip(&mut trace.networks) {
            network.backward(weights, trace, gradient);
        }
    }
}

#[cfg(test)]
mod tests;
