//! The recurrent network of every controller: Linear + `ReLU`, a gated recurrent unit, Linear.

use std::ops::Range;

use mackrl_env::EpisodeKey;

use crate::{
    Real,
    nn::{
        gates::GATES,
        gru::{Gru, GruWeights},
        lanes::{Element, Kernel, Lanes},
        layer_norm::{KEPT, Normalise, NormaliseGradient},
        linear::{Linear, LinearWeights},
        parameters::ParameterLayout,
        trace::{Step, Trace, Workspace},
    },
};

/// Rows of a block of the backward pass, at least: the gradients of the weights are taken over as many whole steps together.
///
/// Step by step, small batches load and store the whole gradient for a few rows (6 rows: 1.6 ms an update instead of 1.1);
/// over the whole episode, large batches come back from the third cache (80 rows: 30 ms instead of 17, beside other load).
const BLOCK_ROWS: usize = 128;

/// The sizes of a [`RecurrentNetwork`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NetworkSizes {
    /// Length of a row of inputs.
    pub inputs: usize,
    /// Units of the first layer and of the recurrent unit.
    pub hidden: usize,
    /// Length of a row of logits.
    pub outputs: usize,
}

/// Linear + `ReLU`, a gated recurrent unit, Linear; as places in a flat parameter vector.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecurrentNetwork {
    input: Linear,
    gru: Gru,
    output: Linear,
    /// Whether features and what the last layer reads are normalised.
    normalises: bool,
}

/// The weights of a [`RecurrentNetwork`] as its kernels read them: copied from the flat vector once per update.
#[derive(Debug, Clone)]
pub struct RecurrentWeights<R> {
    input: LinearWeights<R>,
    gru: GruWeights<R>,
    output: LinearWeights<R>,
}

impl RecurrentNetwork {
    /// Adds the tensors of `{name}.input`, `{name}.gru` and `{name}.output` to a layout.
    pub fn new(layout: &mut ParameterLayout, name: &str, sizes: NetworkSizes) -> Self {
        let NetworkSizes {
            inputs,
            hidden,
            outputs,
        } = sizes;
        Self {
            input: Linear::new(layout, &format!("{name}.input"), inputs, hidden),
            gru: Gru::new(layout, &format!("{name}.gru"), hidden, hidden),
            output: Linear::new(layout, &format!("{name}.output"), hidden, outputs),
            normalises: false,
        }
    }

    /// The same network with its features (the output of the first layer after `ReLU`) and what the last layer reads of the
    /// recurrent states normalised row by row.
    #[must_use]
    pub const fn with_normalisation(mut self) -> Self {
        self.normalises = true;
        self
    }

    /// The sizes it was made with.
    #[must_use]
    pub const fn sizes(&self) -> NetworkSizes {
        NetworkSizes {
            inputs: self.input.inputs,
            hidden: self.gru.hidden,
            outputs: self.output.outputs,
        }
    }

    /// Draws initial parameters as PyTorch does. The draw of a parameter is named by `key` and its index in the flat vector,
    /// so models with vectors of their own need different keys.
    pub fn initialise<R: Real>(&self, key: &EpisodeKey, parameters: &mut [R]) {
        self.input.initialise(key, parameters);
        self.gru.initialise(key, parameters);
        self.output.initialise(key, parameters);
    }

    /// Draws orthogonal weights: times √2 before `ReLU`, times `gain` in the last layer; biases are 0.
    pub fn initialise_orthogonally<R: Real>(
        &self,
        key: &EpisodeKey,
        gain: f64,
        parameters: &mut [R],
    ) {
        self.input
            .initialise_orthogonally(key, std::f64::consts::SQRT_2, parameters);
        self.gru.initialise_orthogonally(key, parameters);
        self.output.initialise_orthogonally(key, gain, parameters);
    }

    /// Where the biases of the logits stand in the flat vector.
    #[must_use]
    pub fn logit_biases(&self) -> Range<usize> {
        self.output.bias()
    }

    /// Prepares the weights for [`step`](Self::step) and [`backward`](Self::backward).
    #[must_use]
    pub fn weights<E: Element>(&self, parameters: &[E]) -> RecurrentWeights<E> {
        let mut weights = RecurrentWeights {
            input: LinearWeights::default(),
            gru: GruWeights::default(),
            output: LinearWeights::default(),
        };
        self.refresh(parameters, &mut weights);
        weights
    }

    /// Brings prepared weights up to date after an update, without allocating.
    pub fn refresh<E: Element>(&self, parameters: &[E], weights: &mut RecurrentWeights<E>) {
        self.input.refresh_forward(parameters, &mut weights.input);
        self.gru.refresh_forward(parameters, &mut weights.gru);
        self.gru.refresh_backward(parameters, &mut weights.gru);
        self.output.refresh_forward(parameters, &mut weights.output);
        self.output
            .refresh_backward(parameters, &mut weights.output);
    }

    /// Computes the current step of a trace from its inputs.
    ///
    /// # Shapes
    /// `x` [rows, inputs]: the inputs of the current step.
    ///
    /// # Panics
    /// If no step was begun, if the trace is for other sizes or was used up, or if there are not as many inputs.
    pub fn step<E: Element>(&self, weights: &RecurrentWeights<E>, x: &[E], trace: &mut Trace<E>) {
        assert_eq!(trace.sizes, self.sizes(), "sizes of the trace");
        assert!(!trace.spent, "an episode that was differentiated has ended");
        let NetworkSizes {
            inputs,
            hidden,
            outputs,
        } = trace.sizes;
        let range = trace.last_rows();
        let (first, rows) = (range.start, range.len());
        let begins = trace.last_step().begins;
        assert_eq!(x.len(), rows * inputs, "inputs are [rows, inputs]");
        if rows == 0 {
            return;
        }
        let features = &mut trace.features.as_mut_slice()[first * hidden..][..rows * hidden];
        self.input.forward(&weights.input, rows, x, features);
        if self.normalises {
            E::dispatch(Normalise {
                columns: hidden,
                rectifies: true,
                values: &mut *features,
                kept: &mut trace.norms.as_mut_slice()[first * KEPT..][..rows * KEPT],
            });
        } else {
            E::dispatch(Rectify {
                values: &mut *features,
            });
        }
        let next = &mut trace.hidden.as_mut_slice()[first * hidden..];
        self.gru.forward(
            &weights.gru,
            (rows, begins),
            features,
            &trace.previous.as_slice()[first * hidden..],
            &mut trace.gates.as_mut_slice()[first * GATES * hidden..],
            next,
        );
        let asked = trace.steps.last().expect("a step was begun").asked.clone();
        if asked.is_empty() {
            return;
        }
        let logits = &mut trace.logits.as_mut_slice()[asked.start * outputs..];
        let states = if self.copies_states(trace.selective) {
            trace.asked_hidden.grow(asked.end * hidden);
            let states = &mut trace.asked_hidden.as_mut_slice()[asked.start * hidden..];
            let hidden_states = trace.hidden.as_slice();
            if trace.selective {
                let gathered = states.chunks_exact_mut(hidden);
                for (state, &row) in gathered.zip(&trace.asked[asked.clone()]) {
                    state.copy_from_slice(&hidden_states[row * hidden..][..hidden]);
                }
            } else {
                let size = rows * hidden;
                states[..size].copy_from_slice(&hidden_states[first * hidden..][..size]);
            }
            if self.normalises {
                trace.state_norms.grow(asked.end * KEPT);
                E::dispatch(Normalise {
                    columns: hidden,
                    rectifies: false,
                    values: &mut states[..asked.len() * hidden],
                    kept: &mut trace.state_norms.as_mut_slice()[asked.start * KEPT..]
                        [..asked.len() * KEPT],
                });
            }
            &*states
        } else {
            &*next
        };
        self.output
            .forward(&weights.output, asked.len(), states, logits);
    }

    /// Back-propagates the gradients of the logits through all steps and adds the parameters' gradients to the flat
    /// `gradient`.
    ///
    /// The trace's activations are used up, because gates become their gradients in place: to differentiate again, the
    /// episode has to be computed again, step by step, from its inputs.
    ///
    /// # Shapes
    /// `x` [rows of all steps, inputs]: what the steps were computed from.
    ///
    /// # Panics
    /// If the trace is for other sizes, does not hold the whole episode or was used up, or if there are not as many inputs.
    pub fn backward<E: Element>(
        &self,
        weights: &RecurrentWeights<E>,
        x: &[E],
        trace: &mut Trace<E>,
        gradient: &mut [E],
    ) {
        assert_eq!(trace.sizes, self.sizes(), "sizes of the trace");
        assert!(!trace.spent, "activations can be differentiated once");
        let rows = trace.steps.last().map_or(0, |step| step.rows.end);
        assert_eq!(
            x.len(),
            rows * trace.sizes.inputs,
            "inputs are [rows of all steps, inputs]"
        );
        trace.spent = true;
        assert_eq!(
            trace.steps.len(),
            trace.steps(),
            "a trace that holds the whole episode"
        );
        let last = trace.steps.last().map_or(0, |step| step.rows.len());
        let hidden_gradient = &mut trace.workspace.hidden_gradient;
        hidden_gradient.grow(last * trace.sizes.hidden);
        hidden_gradient.as_mut_slice()[..last * trace.sizes.hidden].fill(E::ZERO);
        let mut end = trace.steps.len();
        while end > 0 {
            let block = block_before(&trace.steps, end);
            let start = block.start;
            let rows = trace.steps[start].rows.start..trace.steps[end - 1].rows.end;
            trace
                .workspace
                .features_gradient
                .grow(rows.len() * trace.sizes.hidden);
            for t in block.clone().rev() {
                // Behind a step without rows there may be no room that kernels could look at.
                if !trace.steps[t].rows.is_empty() {
                    self.step_backward(weights, trace, t, rows.start);
                }
                trace.carry_gradient_back(t);
            }
            if !rows.is_empty() {
                let asked = trace.steps[start].asked.start..trace.steps[end - 1].asked.end;
                self.output_gradient(trace, asked, gradient);
                let begins = trace.steps[block].iter().all(|step| step.begins);
                self.parameter_gradient(x, trace, (rows, begins), gradient);
            }
            end = start;
        }
    }

    /// Turns the gates of step `t` into their gradients, and the gradient of its hidden state into that of the state before.
    fn step_backward<E: Element>(
        &self,
        weights: &RecurrentWeights<E>,
        trace: &mut Trace<E>,
        t: usize,
        block_start: usize,
    ) {
        let hidden = trace.sizes.hidden;
        let first = trace.steps[t].rows.start;
        let rows = trace.steps[t].rows.len();
        let begins = trace.steps[t].begins;
        self.output_backward(weights, trace, t);
        let Workspace {
            features_gradient,
            hidden_gradient,
            ..
        } = &mut trace.workspace;
        let hidden_gradient = hidden_gradient.as_mut_slice();
        let gates = &mut trace.gates.as_mut_slice()[first * GATES * hidden..];
        let previous = &trace.previous.as_slice()[first * hidden..];
        self.gru.hidden_gradient(
            &weights.gru,
            (rows, begins),
            previous,
            gates,
            hidden_gradient,
        );

        let place = (first - block_start) * hidden;
        let features_gradient = &mut features_gradient.as_mut_slice()[place..][..rows * hidden];
        self.gru
            .input_gradient(&weights.gru, rows, gates, features_gradient);
        let features = &trace.features.as_slice()[first * hidden..][..rows * hidden];
        if self.normalises {
            E::dispatch(NormaliseGradient {
                columns: hidden,
                rectifies: true,
                normalised: features,
                kept: &trace.norms.as_slice()[first * KEPT..][..rows * KEPT],
                gradient: features_gradient,
            });
        } else {
            E::dispatch(RectifyGradient {
                values: features,
                gradient: features_gradient,
            });
        }
    }

    /// Adds what the logits of step `t` say to the gradient of its hidden state.
    fn output_backward<E: Element>(
        &self,
        weights: &RecurrentWeights<E>,
        trace: &mut Trace<E>,
        t: usize,
    ) {
        let NetworkSizes {
            hidden, outputs, ..
        } = trace.sizes;
        let Step { rows, asked, .. } = &trace.steps[t];
        if asked.is_empty() {
            return;
        }
        let Workspace {
            hidden_gradient,
            asked_gradient,
            ..
        } = &mut trace.workspace;
        let logits_gradient = &trace.logits_gradient.as_slice()[asked.start * outputs..];
        let count = asked.len();
        if !self.copies_states(trace.selective) {
            let gradient = hidden_gradient.as_mut_slice();
            self.output
                .input_gradient(&weights.output, count, logits_gradient, gradient);
            return;
        }
        asked_gradient.grow(count * hidden);
        asked_gradient.as_mut_slice()[..count * hidden].fill(E::ZERO);
        let gradients = asked_gradient.as_mut_slice();
        self.output
            .input_gradient(&weights.output, count, logits_gradient, gradients);
        if self.normalises {
            E::dispatch(NormaliseGradient {
                columns: hidden,
                rectifies: false,
                normalised: &trace.asked_hidden.as_slice()[asked.start * hidden..]
                    [..count * hidden],
                kept: &trace.state_norms.as_slice()[asked.start * KEPT..][..count * KEPT],
                gradient: &mut gradients[..count * hidden],
            });
        }
        let mut add = |place: usize, terms: &[E]| {
            let sums = &mut hidden_gradient.as_mut_slice()[place * hidden..][..hidden];
            for (sum, &term) in sums.iter_mut().zip(terms) {
                *sum += term;
            }
        };
        let terms = gradients.chunks_exact(hidden).take(count).enumerate();
        for (index, terms) in terms {
            let place = if trace.selective {
                trace.asked[asked.start + index] - rows.start
            } else {
                index
            };
            add(place, terms);
        }
    }

    /// Whether the last layer reads a copy of the recurrent states: of some rows, or normalised.
    const fn copies_states(&self, selective: bool) -> bool {
        selective || self.normalises
    }

    /// Adds the gradients of the last layer's parameters over some rows of logits.
    fn output_gradient<E: Element>(
        &self,
        trace: &mut Trace<E>,
        asked: Range<usize>,
        gradient: &mut [E],
    ) {
        if asked.is_empty() {
            return;
        }
        let NetworkSizes {
            hidden, outputs, ..
        } = trace.sizes;
        let states = if self.copies_states(trace.selective) {
            &trace.asked_hidden
        } else {
            &trace.hidden
        };
        self.output.parameter_gradient(
            asked.len(),
            &states.as_slice()[asked.start * hidden..],
            &trace.logits_gradient.as_slice()[asked.start * outputs..],
            gradient,
            &mut trace.workspace.scratch,
        );
    }

    /// Adds the gradients of the other layers' parameters over some rows of a trace whose gates already are gradients.
    fn parameter_gradient<E: Element>(
        &self,
        x: &[E],
        trace: &mut Trace<E>,
        (rows, begins): (Range<usize>, bool),
        gradient: &mut [E],
    ) {
        let NetworkSizes { inputs, hidden, .. } = trace.sizes;
        let (first, count) = (rows.start, rows.len());
        let Workspace {
            features_gradient,
            scratch,
            ..
        } = &mut trace.workspace;
        let features = &trace.features.as_slice()[first * hidden..];
        let previous = &trace.previous.as_slice()[first * hidden..];
        let gates = &trace.gates.as_slice()[first * GATES * hidden..];
        self.gru.parameter_gradient(
            (count, begins),
            features,
            previous,
            gates,
            gradient,
            scratch,
        );

        let x = &x[first * inputs..];
        self.input
            .parameter_gradient(count, x, features_gradient.as_slice(), gradient, scratch);
    }
}

/// The last steps before step `end` that together have [`BLOCK_ROWS`] rows, or all.
fn block_before(steps: &[Step], end: usize) -> Range<usize> {
    let last_row = steps[end - 1].rows.end;
    let mut start = end - 1;
    while start > 0 && last_row - steps[start].rows.start < BLOCK_ROWS {
        start -= 1;
    }
    start..end
}

/// max(x, 0)
pub(crate) struct Rectify<'a, R> {
    pub(crate) values: &'a mut [R],
}

impl<E: Element> Kernel<E> for Rectify<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        for part in self.values.chunks_mut(L::LANES) {
            let value = lanes.load(part);
            lanes.store(part, lanes.where_positive(value, value));
        }
    }
}

/// Keeps the gradient where max(x, 0) is positive.
pub(crate) struct RectifyGradient<'a, R> {
    pub(crate) values: &'a [R],
    pub(crate) gradient: &'a mut [R],
}

impl<E: Element> Kernel<E> for RectifyGradient<'_, E> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Element = E>>(self, lanes: L) {
        let values = self.values.chunks(L::LANES);
        for (gradient, value) in self.gradient.chunks_mut(L::LANES).zip(values) {
            let kept = lanes.where_positive(lanes.load(value), lanes.load(gradient));
            lanes.store(gradient, kept);
        }
    }
}
