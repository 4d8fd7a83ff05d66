//! The feed-forward networks of critics and mixers: affine layers with `ReLU` between them.

use mackrl_env::EpisodeKey;

use crate::{
    Real,
    nn::{
        aligned::Aligned,
        lanes::Element,
        linear::{Linear, LinearWeights},
        parameters::ParameterLayout,
        recurrent::{NetworkSizes, Rectify, RectifyGradient},
    },
};

/// Affine layers with `ReLU` between them; as places in a flat parameter vector.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FeedForward {
    layers: Vec<Linear>,
}

/// The weights of a [`FeedForward`] as its kernels read them: copied from the flat vector once per update.
#[derive(Debug, Clone)]
pub struct FeedForwardWeights<R> {
    layers: Vec<LinearWeights<R>>,
}

/// The activations of a [`FeedForward`] for one batch of rows; the caller's, and used from batch to batch.
#[derive(Debug, Clone)]
pub struct FeedForwardTrace<R> {
    widths: Vec<usize>,
    rows: usize,
    /// The inputs, and what each layer gives, rectified.
    values: Vec<Aligned<R>>,
    /// Their gradients; that of the inputs is never computed.
    gradients: Vec<Aligned<R>>,
    scratch: Aligned<R>,
}

impl FeedForward {
    /// Linear + `ReLU`, Linear: adds the tensors of `{name}.input` and `{name}.output` to a layout.
    pub fn new(layout: &mut ParameterLayout, name: &str, sizes: NetworkSizes) -> Self {
        Self::with_widths(layout, name, &widths(sizes))
    }

    /// As many layers as there are `widths`, less one: rows of `widths[0]` numbers become rows of `widths[1]`, and so on. Adds the
    /// tensors of a single layer under `name`, those of several under `{name}.input`, `{name}.inner` and `{name}.output`.
    ///
    /// # Panics
    /// If there are not one to three layers.
    pub fn with_widths(layout: &mut ParameterLayout, name: &str, widths: &[usize]) -> Self {
        let parts: &[&str] = match widths.len() {
            2 => &[""],
            3 => &[".input", ".output"],
            4 => &[".input", ".inner", ".output"],
            count => panic!("{count} widths, expected 2 to 4"),
        };
        let pairs = widths.windows(2).zip(parts);
        let layers = pairs.map(|(widths, part)| {
            Linear::new(layout, &format!("{name}{part}"), widths[0], widths[1])
        });
        Self {
            layers: layers.collect(),
        }
    }

    /// Length of a row of inputs, and of what each layer gives.
    fn widths(&self) -> impl Iterator<Item = usize> {
        let outputs = self.layers.iter().map(|layer| layer.outputs);
        std::iter::once(self.layers[0].inputs).chain(outputs)
    }

    /// Draws initial parameters as PyTorch does; see
    /// [`RecurrentNetwork::initialise`](crate::nn::RecurrentNetwork::initialise).
    pub fn initialise<R: Real>(&self, key: &EpisodeKey, parameters: &mut [R]) {
        let layers = self.layers.iter();
        layers.for_each(|layer| layer.initialise(key, parameters));
    }

    /// Prepares the weights for [`forward`](Self::forward) and [`backward`](Self::backward).
    #[must_use]
    pub fn weights<E: Element>(&self, parameters: &[E]) -> FeedForwardWeights<E> {
        let layers = self.layers.iter().map(|_| LinearWeights::default());
        let mut weights = FeedForwardWeights {
            layers: layers.collect(),
        };
        self.refresh(parameters, &mut weights);
        weights
    }

    /// Brings prepared weights up to date after an update, without allocating.
    pub fn refresh<E: Element>(&self, parameters: &[E], weights: &mut FeedForwardWeights<E>) {
        for (place, (layer, own)) in self.layers.iter().zip(&mut weights.layers).enumerate() {
            layer.refresh_forward(parameters, own);
            if place > 0 {
                layer.refresh_backward(parameters, own);
            }
        }
    }

    /// Computes the outputs of all rows of a trace.
    ///
    /// # Panics
    /// If the trace is for other sizes.
    pub fn forward<E: Element>(
        &self,
        weights: &FeedForwardWeights<E>,
        trace: &mut FeedForwardTrace<E>,
    ) {
        self.expect_sizes(trace);
        let rows = trace.rows;
        let layers = self.layers.iter().zip(&weights.layers).enumerate();
        for (place, (layer, own)) in layers {
            let (before, after) = trace.values.split_at_mut(place + 1);
            let (x, y) = (before[place].as_slice(), after[0].as_mut_slice());
            layer.forward(own, rows, x, y);
            if place + 1 < self.layers.len() {
                let values = &mut y[..rows * layer.outputs];
                E::dispatch(Rectify { values });
            }
        }
    }

    /// Adds the parameters' gradients to the flat `gradient`, from the gradients of the outputs.
    ///
    /// # Panics
    /// If the trace is for other sizes.
    pub fn backward<E: Element>(
        &self,
        weights: &FeedForwardWeights<E>,
        trace: &mut FeedForwardTrace<E>,
        gradient: &mut [E],
    ) {
        self.expect_sizes(trace);
        let rows = trace.rows;
        for (place, layer) in self.layers.iter().enumerate().rev() {
            let (before, after) = trace.gradients.split_at_mut(place + 1);
            let x = &trace.values[place].as_slice()[..rows * layer.inputs];
            let dy = after[0].as_slice();
            layer.parameter_gradient(rows, x, dy, gradient, &mut trace.scratch);
            if place > 0 {
                let dx = &mut before[place].as_mut_slice()[..rows * layer.inputs];
                dx.fill(E::ZERO);
                layer.input_gradient(&weights.layers[place], rows, dy, dx);
                E::dispatch(RectifyGradient {
                    values: x,
                    gradient: dx,
                });
            }
        }
    }

    fn expect_sizes<R>(&self, trace: &FeedForwardTrace<R>) {
        let found = trace.widths.iter().copied();
        assert!(self.widths().eq(found), "sizes of the trace");
    }
}

impl<R: Real> FeedForwardTrace<R> {
    /// An empty trace for networks of these sizes.
    #[must_use]
    pub fn new(sizes: NetworkSizes) -> Self {
        Self::with_widths(widths(sizes).to_vec())
    }

    /// An empty trace for `network`.
    #[must_use]
    pub fn of(network: &FeedForward) -> Self {
        Self::with_widths(network.widths().collect())
    }

    fn with_widths(widths: Vec<usize>) -> Self {
        let buffers = || widths.iter().map(|_| Aligned::default()).collect();
        Self {
            rows: 0,
            values: buffers(),
            gradients: buffers(),
            scratch: Aligned::default(),
            widths,
        }
    }

    /// Begins a batch of `rows` rows whose inputs are all zero, and returns them [rows, inputs].
    pub fn begin(&mut self, rows: usize) -> &mut [R] {
        self.rows = rows;
        let buffers = self.values.iter_mut().zip(&mut self.gradients);
        for (place, ((values, gradients), width)) in buffers.zip(&self.widths).enumerate() {
            values.grow(rows * width);
            if place > 0 {
                gradients.grow(rows * width);
            }
        }
        let x = &mut self.values[0].as_mut_slice()[..rows * self.widths[0]];
        x.fill(R::ZERO);
        x
    }

    /// The outputs [rows, outputs].
    #[must_use]
    pub fn outputs(&self) -> &[R] {
        let last = self.widths.len() - 1;
        &self.values[last].as_slice()[..self.rows * self.widths[last]]
    }

    /// The outputs, and the place for their gradient [rows, outputs], which holds numbers of earlier batches: write every
    /// element before the backward pass.
    pub fn outputs_and_gradient_mut(&mut self) -> (&[R], &mut [R]) {
        let last = self.widths.len() - 1;
        let length = self.rows * self.widths[last];
        (
            &self.values[last].as_slice()[..length],
            &mut self.gradients[last].as_mut_slice()[..length],
        )
    }
}

const fn widths(sizes: NetworkSizes) -> [usize; 3] {
    [sizes.inputs, sizes.hidden, sizes.outputs]
}
