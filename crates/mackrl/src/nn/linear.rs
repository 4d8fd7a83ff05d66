//! An affine layer.

use std::ops::Range;

use mackrl_env::EpisodeKey;

use crate::{
    Real,
    nn::{
        aligned::Aligned,
        lanes::Element,
        parameters::{ParameterLayout, fill_orthogonal, fill_uniform},
        product::{Packed, Product, Rows, Start},
        weight_gradient::{ColumnSums, WeightGradient},
    },
};

/// y = W x + b, as places in a flat parameter vector.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Linear {
    /// Length of x.
    pub inputs: usize,
    /// Length of y.
    pub outputs: usize,
    weight: Range<usize>,
    bias: Range<usize>,
}

/// A layer's weights as its kernels read them.
#[derive(Debug, Clone, Default)]
pub(crate) struct LinearWeights<R> {
    forward: Packed<R>,
    backward: Packed<R>,
    bias: Vec<R>,
}

impl Linear {
    /// Adds `{name}.weight` [outputs, inputs] and `{name}.bias` `[outputs]` to a layout.
    pub fn new(layout: &mut ParameterLayout, name: &str, inputs: usize, outputs: usize) -> Self {
        Self {
            inputs,
            outputs,
            weight: layout.add(format!("{name}.weight"), &[outputs, inputs]),
            bias: layout.add(format!("{name}.bias"), &[outputs]),
        }
    }

    /// Draws weight and bias uniformly from ±1/√inputs, as PyTorch does.
    pub fn initialise<R: Real>(&self, key: &EpisodeKey, parameters: &mut [R]) {
        let bound = 1.0 / (self.inputs as f64).sqrt();
        fill_uniform(key, self.weight.clone(), bound, parameters);
        fill_uniform(key, self.bias.clone(), bound, parameters);
    }

    /// Draws an orthogonal weight times `gain`; the bias is 0.
    pub(crate) fn initialise_orthogonally<R: Real>(
        &self,
        key: &EpisodeKey,
        gain: f64,
        parameters: &mut [R],
    ) {
        let shape = [self.inputs, self.outputs];
        fill_orthogonal(key, self.weight.clone(), shape, gain, parameters);
        parameters[self.bias.clone()].fill(R::ZERO);
    }

    /// Where the biases stand in the flat vector.
    pub(crate) fn bias(&self) -> Range<usize> {
        self.bias.clone()
    }

    /// Copies the parameters into the order that the forward pass reads.
    pub(crate) fn refresh_forward<E: Element>(&self, parameters: &[E], to: &mut LinearWeights<E>) {
        to.bias.clear();
        to.bias.extend_from_slice(&parameters[self.bias.clone()]);
        to.forward.resize(self.inputs, self.outputs);
        to.forward
            .pack(self.weight_rows(parameters), 0, self.outputs);
    }

    /// Copies the parameters into the order that [`input_gradient`](Self::input_gradient) reads.
    pub(crate) fn refresh_backward<E: Element>(&self, parameters: &[E], to: &mut LinearWeights<E>) {
        to.backward.resize(self.outputs, self.inputs);
        to.backward
            .pack_transposed(self.weight_rows(parameters), 0, self.outputs);
    }

    /// # Shapes
    /// `x` [rows, inputs], `y` [rows, outputs].
    pub(crate) fn forward<E: Element>(
        &self,
        weights: &LinearWeights<E>,
        rows: usize,
        x: &[E],
        y: &mut [E],
    ) {
        Product {
            rows,
            a: Rows {
                values: x,
                stride: self.inputs,
            },
            b: &weights.forward,
            start: Start::Bias(&weights.bias),
            c: y,
            c_stride: self.outputs,
        }
        .compute();
    }

    /// dx += dy W.
    ///
    /// # Shapes
    /// `dy` [rows, outputs], `dx` [rows, inputs].
    pub(crate) fn input_gradient<E: Element>(
        &self,
        weights: &LinearWeights<E>,
        rows: usize,
        dy: &[E],
        dx: &mut [E],
    ) {
        Product {
            rows,
            a: Rows {
                values: dy,
                stride: self.outputs,
            },
            b: &weights.backward,
            start: Start::Kept,
            c: dx,
            c_stride: self.inputs,
        }
        .compute();
    }

    /// Adds the gradients of weight and bias to the flat `gradient`.
    ///
    /// # Shapes
    /// `x` [rows, inputs], `dy` [rows, outputs].
    pub(crate) fn parameter_gradient<E: Element>(
        &self,
        rows: usize,
        x: &[E],
        dy: &[E],
        gradient: &mut [E],
        scratch: &mut Aligned<E>,
    ) {
        let d = Rows {
            values: dy,
            stride: self.outputs,
        };
        WeightGradient {
            rows,
            inner: self.inputs,
            columns: self.outputs,
            a: Rows {
                values: x,
                stride: self.inputs,
            },
            d,
            gradient: &mut gradient[self.weight.clone()],
            gradient_stride: self.outputs,
            scratch,
        }
        .compute();
        ColumnSums {
            rows,
            d,
            sums: &mut gradient[self.bias.clone()],
        }
        .compute();
    }

    fn weight_rows<'a, R>(&self, parameters: &'a [R]) -> Rows<'a, R> {
        Rows {
            values: &parameters[self.weight.clone()],
            stride: self.outputs,
        }
    }
}
