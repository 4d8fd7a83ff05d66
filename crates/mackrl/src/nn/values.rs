//! The feed-forward network of a value of each member of a team: two layers of `ReLU` with normalised features, then a number.
//!
//! Members share what they all read, the state. What the first layer makes of it is computed once for all of them: of five
//! members, that saves four fifths of its largest product.

use mackrl_env::EpisodeKey;

use crate::{
    Real,
    nn::{
        aligned::Aligned,
        lanes::Element,
        layer_norm::{KEPT, Normalise, NormaliseGradient},
        linear::{Linear, LinearWeights},
        parameters::ParameterLayout,
    },
};

/// The sizes of a [`ValueNetwork`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ValueSizes {
    /// Length of what all members share; 0 if nothing.
    pub shared: usize,
    /// Length of what each member has of its own.
    pub own: usize,
    /// Members, at least 1.
    pub members: usize,
    /// Units of each layer.
    pub hidden: usize,
}

/// A value of each member, as places in a flat parameter vector.
///
/// # Equation
/// `f = N(W_s s + W_o o + b)`, `g = N(W f + b)`, `v = w g + b`, where N rectifies and normalises.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValueNetwork {
    sizes: ValueSizes,
    shared: Option<Linear>,
    own: Linear,
    inner: Linear,
    output: Linear,
}

/// The weights of a [`ValueNetwork`] as its kernels read them.
#[derive(Debug, Clone, Default)]
pub struct ValueWeights<R> {
    shared: LinearWeights<R>,
    own: LinearWeights<R>,
    inner: LinearWeights<R>,
    output: LinearWeights<R>,
}

/// The activations of a [`ValueNetwork`] for some steps; the caller's, and used again and again.
#[derive(Debug, Clone, Default)]
pub struct ValueTrace<R> {
    steps: usize,
    /// [steps, hidden]
    shared: Aligned<R>,
    /// [steps · members, hidden]
    features: [Aligned<R>; 2],
    norms: [Aligned<R>; 2],
    gradients: [Aligned<R>; 2],
    /// [steps · members]
    values: Aligned<R>,
    values_gradient: Aligned<R>,
    scratch: Aligned<R>,
}

impl ValueNetwork {
    /// Adds the tensors of `{name}.state` (if there is something shared), `{name}.own`, `{name}.inner` and `{name}.output`.
    pub fn new(layout: &mut ParameterLayout, name: &str, sizes: ValueSizes) -> Self {
        let ValueSizes {
            shared,
            own,
            hidden,
            ..
        } = sizes;
        let mut linear = |part: &str, inputs, outputs| {
            Linear::new(layout, &format!("{name}.{part}"), inputs, outputs)
        };
        Self {
            sizes,
            shared: (shared > 0).then(|| linear("state", shared, hidden)),
            own: linear("own", own, hidden),
            inner: linear("inner", hidden, hidden),
            output: linear("output", hidden, 1),
        }
    }

    /// The sizes it was made with.
    #[must_use]
    pub const fn sizes(&self) -> ValueSizes {
        self.sizes
    }

    /// Draws orthogonal weights, times √2 before `ReLU`; biases are 0.
    pub fn initialise<R: Real>(&self, key: &EpisodeKey, parameters: &mut [R]) {
        let rectified = std::f64::consts::SQRT_2;
        for layer in self.shared.iter().chain([&self.own, &self.inner]) {
            layer.initialise_orthogonally(key, rectified, parameters);
        }
        self.output.initialise_orthogonally(key, 1.0, parameters);
    }

    /// Prepares the weights for [`forward`](Self::forward) and [`backward`](Self::backward).
    pub fn refresh<E: Element>(&self, parameters: &[E], weights: &mut ValueWeights<E>) {
        if let Some(shared) = &self.shared {
            shared.refresh_forward(parameters, &mut weights.shared);
        }
        self.own.refresh_forward(parameters, &mut weights.own);
        self.inner.refresh_forward(parameters, &mut weights.inner);
        self.inner.refresh_backward(parameters, &mut weights.inner);
        self.output.refresh_forward(parameters, &mut weights.output);
        self.output
            .refresh_backward(parameters, &mut weights.output);
    }

    /// Computes the values of some steps.
    ///
    /// # Shapes
    /// `shared` [steps, shared], `own` [steps · members, own].
    ///
    /// # Panics
    /// If the lengths do not fit.
    pub fn forward<E: Element>(
        &self,
        weights: &ValueWeights<E>,
        [shared, own]: [&[E]; 2],
        trace: &mut ValueTrace<E>,
    ) {
        let ValueSizes {
            members, hidden, ..
        } = self.sizes;
        let rows = own.len() / self.sizes.own;
        assert_eq!(rows % members, 0, "all members of every step");
        trace.begin(rows / members, self.sizes);
        let [first, second] = &mut trace.features;
        let [first_norms, second_norms] = &mut trace.norms;
        let first = &mut first.as_mut_slice()[..rows * hidden];
        self.own.forward(&weights.own, rows, own, first);
        if let Some(layer) = &self.shared {
            let steps = trace.steps;
            assert_eq!(
                shared.len(),
                steps * self.sizes.shared,
                "a state of every step"
            );
            let sums = &mut trace.shared.as_mut_slice()[..steps * hidden];
            layer.forward(&weights.shared, steps, shared, sums);
            let steps = first.chunks_exact_mut(members * hidden);
            for (rows, sum) in steps.zip(sums.chunks_exact(hidden)) {
                for row in rows.chunks_exact_mut(hidden) {
                    row.iter_mut().zip(sum).for_each(|(x, &s)| *x += s);
                }
            }
        }
        E::dispatch(Normalise {
            columns: hidden,
            rectifies: true,
            values: &mut *first,
            kept: &mut first_norms.as_mut_slice()[..rows * KEPT],
        });
        let second = &mut second.as_mut_slice()[..rows * hidden];
        self.inner.forward(&weights.inner, rows, first, second);
        E::dispatch(Normalise {
            columns: hidden,
            rectifies: true,
            values: &mut *second,
            kept: &mut second_norms.as_mut_slice()[..rows * KEPT],
        });
        let values = trace.values.as_mut_slice();
        self.output.forward(&weights.output, rows, second, values);
    }

    /// Adds the parameters' gradients to the flat `gradient`, from those of the values, and uses the activations up.
    ///
    /// # Shapes
    /// As [`forward`](Self::forward), whose arguments these are once more.
    pub fn backward<E: Element>(
        &self,
        weights: &ValueWeights<E>,
        [shared, own]: [&[E]; 2],
        trace: &mut ValueTrace<E>,
        gradient: &mut [E],
    ) {
        let ValueSizes {
            members, hidden, ..
        } = self.sizes;
        let rows = trace.steps * members;
        let ValueTrace {
            steps,
            shared: sums,
            features: [first, second],
            norms: [first_norms, second_norms],
            gradients: [first_gradient, second_gradient],
            values_gradient,
            scratch,
            ..
        } = trace;
        let (first, second) = (
            &first.as_slice()[..rows * hidden],
            &second.as_slice()[..rows * hidden],
        );
        let dv = &values_gradient.as_slice()[..rows];
        self.output
            .parameter_gradient(rows, second, dv, gradient, scratch);
        let d_second = &mut second_gradient.as_mut_slice()[..rows * hidden];
        d_second.fill(E::ZERO);
        self.output
            .input_gradient(&weights.output, rows, dv, d_second);
        E::dispatch(NormaliseGradient {
            columns: hidden,
            rectifies: true,
            normalised: second,
            kept: &second_norms.as_slice()[..rows * KEPT],
            gradient: &mut *d_second,
        });
        self.inner
            .parameter_gradient(rows, first, d_second, gradient, scratch);
        let d_first = &mut first_gradient.as_mut_slice()[..rows * hidden];
        d_first.fill(E::ZERO);
        self.inner
            .input_gradient(&weights.inner, rows, d_second, d_first);
        E::dispatch(NormaliseGradient {
            columns: hidden,
            rectifies: true,
            normalised: first,
            kept: &first_norms.as_slice()[..rows * KEPT],
            gradient: &mut *d_first,
        });
        self.own
            .parameter_gradient(rows, own, d_first, gradient, scratch);
        if let Some(layer) = &self.shared {
            let sums = &mut sums.as_mut_slice()[..*steps * hidden];
            sums.fill(E::ZERO);
            let steps_rows = d_first.chunks_exact(members * hidden);
            for (sum, rows) in sums.chunks_exact_mut(hidden).zip(steps_rows) {
                for row in rows.chunks_exact(hidden) {
                    sum.iter_mut().zip(row).for_each(|(sum, &d)| *sum += d);
                }
            }
            layer.parameter_gradient(*steps, shared, sums, gradient, scratch);
        }
    }
}

impl<R: Real> ValueTrace<R> {
    fn begin(&mut self, steps: usize, sizes: ValueSizes) {
        let rows = steps * sizes.members;
        self.steps = steps;
        self.shared.grow(steps * sizes.hidden);
        for buffer in self.features.iter_mut().chain(&mut self.gradients) {
            buffer.grow(rows * sizes.hidden);
        }
        self.norms
            .iter_mut()
            .for_each(|norms| norms.grow(rows * KEPT));
        self.values.grow(rows);
        self.values_gradient.grow(rows);
    }

    /// The values of the first `rows` rows, and the place for their gradient, of which every element is to be written before the
    /// backward pass.
    pub fn values_and_gradient_mut(&mut self, rows: usize) -> (&[R], &mut [R]) {
        (
            &self.values.as_slice()[..rows],
            &mut self.values_gradient.as_mut_slice()[..rows],
        )
    }
}

#[cfg(test)]
mod tests {
    use mackrl_env::{Draw, Stream};

    use super::*;

    /// All gradients of a loss `Σ c v` over five steps of three members, against central differences.
    fn check(shared: usize) {
        let key = EpisodeKey::new(2, Stream::Other, 0);
        let numbers = |count: usize, kind: usize| -> Vec<f64> {
            (0..count)
                .map(|i| key.normal(kind, Draw::World(i)))
                .collect()
        };
        let sizes = ValueSizes {
            shared,
            own: 4,
            members: 3,
            hidden: 7,
        };
        let mut layout = ParameterLayout::new();
        let network = ValueNetwork::new(&mut layout, "value", sizes);
        let mut parameters = vec![0.0; layout.len()];
        network.initialise(&key, &mut parameters);
        // Biases that are not zero, so that no unit sits on the edge of its ReLU.
        let noise = numbers(layout.len(), 3);
        parameters
            .iter_mut()
            .zip(noise)
            .for_each(|(p, n)| *p += 0.1 * n);
        let (states, own) = (numbers(5 * shared, 1), numbers(15 * 4, 2));
        let coefficients = numbers(15, 4);
        let mut trace = ValueTrace::default();
        let mut loss = |parameters: &[f64]| {
            let mut weights = ValueWeights::default();
            network.refresh(parameters, &mut weights);
            network.forward(&weights, [&states, &own], &mut trace);
            let (values, gradient) = trace.values_and_gradient_mut(15);
            gradient.copy_from_slice(&coefficients);
            let loss: f64 = values.iter().zip(&coefficients).map(|(v, c)| v * c).sum();
            let mut gradient = vec![0.0; parameters.len()];
            network.backward(&weights, [&states, &own], &mut trace, &mut gradient);
            (loss, gradient)
        };
        let (_, gradient) = loss(&parameters);
        for i in 0..parameters.len() {
            let [above, below] = [1e-6, -1e-6].map(|step| {
                let mut moved = parameters.clone();
                moved[i] += step;
                loss(&moved).0
            });
            let slope = (above - below) / 2e-6;
            let error = (gradient[i] - slope).abs() / slope.abs().max(1.0);
            assert!(error < 1e-6, "{i}: {} is not {slope}", gradient[i]);
        }
    }

    #[test]
    fn gradients_are_those_of_the_values_with_a_state_and_without() {
        check(6);
        check(0);
    }
}
