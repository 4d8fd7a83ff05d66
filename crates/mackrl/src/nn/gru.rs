//! A gated recurrent unit with PyTorch's semantics.
//!
//! The four pre-activations of a row lie side by side as [n, r, z, q]: then the input feeds the contiguous columns (n, r, z),
//! the hidden state the contiguous columns (r, z, q), and each direction needs one product instead of three.

use std::ops::Range;

use mackrl_env::EpisodeKey;

use crate::{
    Real,
    nn::{
        aligned::Aligned,
        gates::{Activate, Differentiate, GATES},
        lanes::Element,
        parameters::{ParameterLayout, fill_orthogonal, fill_uniform},
        product::{Packed, Product, Rows, Start},
        weight_gradient::{ColumnSums, WeightGradient},
    },
};

/// A gated recurrent unit, as places in a flat parameter vector.
///
/// # Equation
/// `r = σ(W_ir x + b_ir + W_hr h + b_hr)`, `z = σ(W_iz x + b_iz + W_hz h + b_hz)`, `q = W_hn h + b_hn`,
/// `n = tanh(W_in x + b_in + r q)`, `h' = (1 − z) n + z h`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gru {
    /// Length of x.
    pub inputs: usize,
    /// Length of h.
    pub hidden: usize,
    weight_ih: Range<usize>,
    weight_hh: Range<usize>,
    bias_ih: Range<usize>,
    bias_hh: Range<usize>,
}

/// A unit's weights as its kernels read them.
#[derive(Debug, Clone, Default)]
pub(crate) struct GruWeights<R> {
    /// [inputs, (n, r, z)]
    input_forward: Packed<R>,
    /// [hidden, (r, z)]
    hidden_forward: Packed<R>,
    /// [hidden, q]
    candidate_forward: Packed<R>,
    /// [(n, r, z), inputs]
    input_backward: Packed<R>,
    /// [(r, z, q), hidden]
    hidden_backward: Packed<R>,
    /// Both biases of (n, r, z) except `b_hn`.
    bias: Vec<R>,
    /// `b_hn`
    candidate_bias: Vec<R>,
}

impl Gru {
    /// Adds `{name}.weight_ih` [3 hidden, inputs], `{name}.weight_hh` [3 hidden, hidden], `{name}.bias_ih` and
    /// `{name}.bias_hh` [3 hidden] to a layout; gates in PyTorch's order r, z, n.
    pub fn new(layout: &mut ParameterLayout, name: &str, inputs: usize, hidden: usize) -> Self {
        Self {
            inputs,
            hidden,
            weight_ih: layout.add(format!("{name}.weight_ih"), &[3 * hidden, inputs]),
            weight_hh: layout.add(format!("{name}.weight_hh"), &[3 * hidden, hidden]),
            bias_ih: layout.add(format!("{name}.bias_ih"), &[3 * hidden]),
            bias_hh: layout.add(format!("{name}.bias_hh"), &[3 * hidden]),
        }
    }

    /// Draws all parameters uniformly from ±1/√hidden, as PyTorch does.
    pub fn initialise<R: Real>(&self, key: &EpisodeKey, parameters: &mut [R]) {
        let bound = 1.0 / (self.hidden as f64).sqrt();
        for range in [
            &self.weight_ih,
            &self.weight_hh,
            &self.bias_ih,
            &self.bias_hh,
        ] {
            fill_uniform(key, range.clone(), bound, parameters);
        }
    }

    /// Draws orthogonal weights, those of all gates together; biases are 0.
    pub(crate) fn initialise_orthogonally<R: Real>(&self, key: &EpisodeKey, parameters: &mut [R]) {
        for (range, inputs) in [
            (&self.weight_ih, self.inputs),
            (&self.weight_hh, self.hidden),
        ] {
            let shape = [inputs, 3 * self.hidden];
            fill_orthogonal(key, range.clone(), shape, 1.0, parameters);
        }
        parameters[self.bias_ih.clone()].fill(R::ZERO);
        parameters[self.bias_hh.clone()].fill(R::ZERO);
    }

    /// Copies the parameters into the orders that the forward pass reads.
    pub(crate) fn refresh_forward<E: Element>(&self, parameters: &[E], to: &mut GruWeights<E>) {
        let h = self.hidden;
        let [input_rz, input_n] = self.columns(&parameters[self.weight_ih.clone()]);
        to.input_forward.resize(self.inputs, 3 * h);
        to.input_forward.pack(input_n, 0, h);
        to.input_forward.pack(input_rz, h, 2 * h);
        let [hidden_rz, hidden_n] = self.columns(&parameters[self.weight_hh.clone()]);
        to.hidden_forward.resize(h, 2 * h);
        to.hidden_forward.pack(hidden_rz, 0, 2 * h);
        to.candidate_forward.resize(h, h);
        to.candidate_forward.pack(hidden_n, 0, h);

        let (bias_ih, bias_hh) = (
            &parameters[self.bias_ih.clone()],
            &parameters[self.bias_hh.clone()],
        );
        to.bias.clear();
        to.bias.extend_from_slice(&bias_ih[2 * h..]);
        to.bias.extend(
            bias_ih[..2 * h]
                .iter()
                .zip(bias_hh)
                .map(|(&input, &hidden)| input + hidden),
        );
        to.candidate_bias.clear();
        to.candidate_bias.extend_from_slice(&bias_hh[2 * h..]);
    }

    /// Copies the parameters into the orders that the backward pass reads.
    pub(crate) fn refresh_backward<E: Element>(&self, parameters: &[E], to: &mut GruWeights<E>) {
        let h = self.hidden;
        let [input_rz, input_n] = self.columns(&parameters[self.weight_ih.clone()]);
        to.input_backward.resize(3 * h, self.inputs);
        to.input_backward.pack_transposed(input_n, 0, h);
        to.input_backward.pack_transposed(input_rz, h, 2 * h);
        let [hidden_rz, hidden_n] = self.columns(&parameters[self.weight_hh.clone()]);
        to.hidden_backward.resize(3 * h, h);
        to.hidden_backward.pack_transposed(hidden_rz, 0, 2 * h);
        to.hidden_backward.pack_transposed(hidden_n, 2 * h, h);
    }

    /// The columns (r, z) and n of a weight [_, (r, z, n)].
    fn columns<'a, R>(&self, weight: &'a [R]) -> [Rows<'a, R>; 2] {
        let stride = 3 * self.hidden;
        [
            Rows {
                values: weight,
                stride,
            },
            Rows {
                values: &weight[2 * self.hidden..],
                stride,
            },
        ]
    }

    /// One step; the gates [n, r, z, q] are kept for the backward pass. Where all rows begin, from hidden states of zero, the products
    /// with these are left out, which changes no bit.
    ///
    /// # Shapes
    /// `x` [rows, inputs], `previous` and `next` [rows, hidden], `gates` [rows, 4 hidden].
    pub(crate) fn forward<E: Element>(
        &self,
        weights: &GruWeights<E>,
        (rows, begins): (usize, bool),
        x: &[E],
        previous: &[E],
        gates: &mut [E],
        next: &mut [E],
    ) {
        // No row needs no room: behind the last step there may be less than the columns that are skipped below.
        if rows == 0 {
            return;
        }
        let h = self.hidden;
        let c_stride = GATES * h;
        Product {
            rows,
            a: Rows {
                values: x,
                stride: self.inputs,
            },
            b: &weights.input_forward,
            start: Start::Bias(&weights.bias),
            c: gates,
            c_stride,
        }
        .compute();
        if begins {
            for gates in gates.chunks_exact_mut(c_stride).take(rows) {
                gates[3 * h..].copy_from_slice(&weights.candidate_bias);
            }
        } else {
            let a = Rows {
                values: previous,
                stride: h,
            };
            Product {
                rows,
                a,
                b: &weights.hidden_forward,
                start: Start::Kept,
                c: &mut gates[h..],
                c_stride,
            }
            .compute();
            Product {
                rows,
                a,
                b: &weights.candidate_forward,
                start: Start::Bias(&weights.candidate_bias),
                c: &mut gates[3 * h..],
                c_stride,
            }
            .compute();
        }
        E::dispatch(Activate {
            hidden: h,
            rows,
            previous,
            gates,
            next,
        });
    }

    /// Replaces the gates by the gradients of their pre-activations, and `gradient`, that of h', by that of h (or by something that
    /// is not to be read, if all rows begin).
    ///
    /// # Shapes
    /// `previous` and `gradient` [rows, hidden], `gates` [rows, 4 hidden].
    pub(crate) fn hidden_gradient<E: Element>(
        &self,
        weights: &GruWeights<E>,
        (rows, begins): (usize, bool),
        previous: &[E],
        gates: &mut [E],
        gradient: &mut [E],
    ) {
        if rows == 0 {
            return;
        }
        let h = self.hidden;
        E::dispatch(Differentiate {
            hidden: h,
            rows,
            previous,
            gates: &mut *gates,
            gradient: &mut *gradient,
        });
        if begins {
            return;
        }
        Product {
            rows,
            a: Rows {
                values: &gates[h..],
                stride: GATES * h,
            },
            b: &weights.hidden_backward,
            start: Start::Kept,
            c: gradient,
            c_stride: h,
        }
        .compute();
    }

    /// Gives the gradient of x from the gradients of the gates.
    pub(crate) fn input_gradient<E: Element>(
        &self,
        weights: &GruWeights<E>,
        rows: usize,
        gates: &[E],
        dx: &mut [E],
    ) {
        Product {
            rows,
            a: Rows {
                values: gates,
                stride: GATES * self.hidden,
            },
            b: &weights.input_backward,
            start: Start::Zero,
            c: dx,
            c_stride: self.inputs,
        }
        .compute();
    }

    /// Adds the parameters' gradients to the flat `gradient`, from the gradients of the gates.
    pub(crate) fn parameter_gradient<E: Element>(
        &self,
        (rows, begins): (usize, bool),
        x: &[E],
        previous: &[E],
        gates: &[E],
        gradient: &mut [E],
        scratch: &mut Aligned<E>,
    ) {
        if rows == 0 {
            return;
        }
        let h = self.hidden;
        let x = Rows {
            values: x,
            stride: self.inputs,
        };
        let previous = Rows {
            values: previous,
            stride: h,
        };
        let [n, rz, rzq] = [0, h, h].map(|from| Rows {
            values: &gates[from..],
            stride: GATES * h,
        });
        let products = [
            (&self.weight_ih, 0, x, rz, 2 * h),
            (&self.weight_ih, 2 * h, x, n, h),
            (&self.weight_hh, 0, previous, rzq, 3 * h),
        ];
        let count = if begins { 2 } else { 3 };
        for (place, to, a, d, columns) in products.into_iter().take(count) {
            WeightGradient {
                rows,
                inner: a.stride,
                columns,
                a,
                d,
                gradient: &mut gradient[place.clone()][to..],
                gradient_stride: 3 * h,
                scratch: &mut *scratch,
            }
            .compute();
        }
        let bias_ih = &mut gradient[self.bias_ih.clone()];
        ColumnSums {
            rows,
            d: rz,
            sums: &mut bias_ih[..2 * h],
        }
        .compute();
        ColumnSums {
            rows,
            d: n,
            sums: &mut bias_ih[2 * h..],
        }
        .compute();
        ColumnSums {
            rows,
            d: rzq,
            sums: &mut gradient[self.bias_hh.clone()],
        }
        .compute();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn issue_4_a_step_without_rows_needs_no_room() {
        let mut layout = ParameterLayout::new();
        let gru = Gru::new(&mut layout, "gru", 3, 5);
        let parameters = vec![0.1_f32; layout.len()];
        let mut weights = GruWeights::default();
        gru.refresh_forward(&parameters, &mut weights);
        gru.refresh_backward(&parameters, &mut weights);
        gru.forward(&weights, (0, false), &[], &[], &mut [], &mut []);
        gru.hidden_gradient(&weights, (0, false), &[], &mut [], &mut []);
        let mut gradient = vec![0.0; layout.len()];
        let scratch = &mut Aligned::default();
        gru.parameter_gradient((0, false), &[], &[], &[], &mut gradient, scratch);
        assert_eq!(gradient, vec![0.0; layout.len()]);
    }
}
