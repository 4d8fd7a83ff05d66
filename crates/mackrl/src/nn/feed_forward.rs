//! The feed-forward network of the critics: Linear + `ReLU`, Linear.

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

/// Linear + `ReLU`, Linear; as places in a flat parameter vector.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FeedForward {
    input: Linear,
    output: Linear,
}

/// The weights of a [`FeedForward`] as its kernels read them: copied from the flat vector once per update.
#[derive(Debug, Clone)]
pub struct FeedForwardWeights<R> {
    input: LinearWeights<R>,
    output: LinearWeights<R>,
}

/// The activations of a [`FeedForward`] for one batch of rows; the caller's, and used from batch to batch.
#[derive(Debug, Clone)]
pub struct FeedForwardTrace<R> {
    pub(crate) sizes: NetworkSizes,
    pub(crate) rows: usize,
    pub(crate) inputs: Aligned<R>,
    pub(crate) features: Aligned<R>,
    features_gradient: Aligned<R>,
    pub(crate) outputs: Aligned<R>,
    outputs_gradient: Aligned<R>,
    scratch: Aligned<R>,
}

impl FeedForward {
    /// Adds the tensors of `{name}.input` and `{name}.output` to a layout.
    pub fn new(layout: &mut ParameterLayout, name: &str, sizes: NetworkSizes) -> Self {
        let NetworkSizes {
            inputs,
            hidden,
            outputs,
        } = sizes;
        Self {
            input: Linear::new(layout, &format!("{name}.input"), inputs, hidden),
            output: Linear::new(layout, &format!("{name}.output"), hidden, outputs),
        }
    }

    /// The sizes it was made with.
    #[must_use]
    pub const fn sizes(&self) -> NetworkSizes {
        NetworkSizes {
            inputs: self.input.inputs,
            hidden: self.input.outputs,
            outputs: self.output.outputs,
        }
    }

    /// Draws initial parameters as PyTorch does; see
    /// [`RecurrentNetwork::initialise`](crate::nn::RecurrentNetwork::initialise).
    pub fn initialise<R: Real>(&self, key: &EpisodeKey, parameters: &mut [R]) {
        self.input.initialise(key, parameters);
        self.output.initialise(key, parameters);
    }

    /// Prepares the weights for [`forward`](Self::forward) and [`backward`](Self::backward).
    #[must_use]
    pub fn weights<E: Element>(&self, parameters: &[E]) -> FeedForwardWeights<E> {
        let mut weights = FeedForwardWeights {
            input: LinearWeights::default(),
            output: LinearWeights::default(),
        };
        self.refresh(parameters, &mut weights);
        weights
    }

    /// Brings prepared weights up to date after an update, without allocating.
    pub fn refresh<E: Element>(&self, parameters: &[E], weights: &mut FeedForwardWeights<E>) {
        self.input.refresh_forward(parameters, &mut weights.input);
        self.output.refresh_forward(parameters, &mut weights.output);
        self.output
            .refresh_backward(parameters, &mut weights.output);
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
        assert_eq!(trace.sizes, self.sizes(), "sizes of the trace");
        let rows = trace.rows;
        let features = &mut trace.features.as_mut_slice()[..rows * trace.sizes.hidden];
        self.input
            .forward(&weights.input, rows, trace.inputs.as_slice(), features);
        E::dispatch(Rectify { values: features });
        self.output.forward(
            &weights.output,
            rows,
            features,
            trace.outputs.as_mut_slice(),
        );
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
        assert_eq!(trace.sizes, self.sizes(), "sizes of the trace");
        let rows = trace.rows;
        let features = &trace.features.as_slice()[..rows * trace.sizes.hidden];
        let dy = trace.outputs_gradient.as_slice();
        let dx = &mut trace.features_gradient.as_mut_slice()[..rows * trace.sizes.hidden];
        let scratch = &mut trace.scratch;
        self.output
            .parameter_gradient(rows, features, dy, gradient, scratch);
        dx.fill(E::ZERO);
        self.output.input_gradient(&weights.output, rows, dy, dx);
        E::dispatch(RectifyGradient {
            values: features,
            gradient: &mut *dx,
        });
        self.input
            .parameter_gradient(rows, trace.inputs.as_slice(), dx, gradient, scratch);
    }
}

impl<R: Real> FeedForwardTrace<R> {
    /// An empty trace for networks of these sizes.
    #[must_use]
    pub fn new(sizes: NetworkSizes) -> Self {
        Self {
            sizes,
            rows: 0,
            inputs: Aligned::default(),
            features: Aligned::default(),
            features_gradient: Aligned::default(),
            outputs: Aligned::default(),
            outputs_gradient: Aligned::default(),
            scratch: Aligned::default(),
        }
    }

    /// Begins a batch of `rows` rows whose inputs are all zero, and returns them [rows, inputs].
    pub fn begin(&mut self, rows: usize) -> &mut [R] {
        let NetworkSizes {
            inputs,
            hidden,
            outputs,
        } = self.sizes;
        self.rows = rows;
        self.inputs.grow(rows * inputs);
        self.features.grow(rows * hidden);
        self.features_gradient.grow(rows * hidden);
        self.outputs.grow(rows * outputs);
        self.outputs_gradient.grow(rows * outputs);
        let x = &mut self.inputs.as_mut_slice()[..rows * inputs];
        x.fill(R::ZERO);
        x
    }

    /// The outputs [rows, outputs].
    #[must_use]
    pub fn outputs(&self) -> &[R] {
        &self.outputs.as_slice()[..self.rows * self.sizes.outputs]
    }

    /// The outputs, and the place for their gradient [rows, outputs], which holds numbers of earlier batches: write every
    /// element before the backward pass.
    pub fn outputs_and_gradient_mut(&mut self) -> (&[R], &mut [R]) {
        let length = self.rows * self.sizes.outputs;
        (
            &self.outputs.as_slice()[..length],
            &mut self.outputs_gradient.as_mut_slice()[..length],
        )
    }
}
