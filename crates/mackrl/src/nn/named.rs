//! The numbers of a computation by their names, for whoever looks for the one that broke it.

use crate::nn::{FeedForwardTrace, ParameterLayout, Trace, gates::GATES, lanes::Element};

/// Axes of activations: a row is a controller at a step.
const ROWS: [&str; 2] = ["row", "column"];

/// A matrix with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Named<'a, R> {
    /// What it is called: the model, then the layer, then what it is of the layer.
    pub name: String,
    /// What a row and what a column is.
    pub axes: [&'static str; 2],
    /// Length of a row.
    pub columns: usize,
    /// [rows, columns]
    pub values: &'a [R],
}

impl<'a, R> Named<'a, R> {
    /// A matrix called `name`.
    #[must_use]
    pub fn new(
        name: impl Into<String>,
        axes: [&'static str; 2],
        columns: usize,
        values: &'a [R],
    ) -> Self {
        Self {
            name: name.into(),
            axes,
            columns: columns.max(1),
            values,
        }
    }
}

impl ParameterLayout {
    /// Every tensor of a flat vector, its name after `prefix`; the layers in the order in which the gradient meets them, last
    /// layer first.
    #[must_use]
    pub fn named<'a, R>(&self, prefix: &str, values: &'a [R]) -> Vec<Named<'a, R>> {
        let tensors = self.tensors().iter().rev().map(|tensor| {
            let name = format!("{prefix}{}", tensor.name);
            let values = &values[tensor.range.clone()];
            match tensor.shape[..] {
                [outputs, _] => Named::new(name, ["input", "output"], outputs, values),
                _ => Named::new(name, ["output", ""], 1, values),
            }
        });
        tensors.collect()
    }
}

impl<E: Element> Trace<E> {
    /// The activations of all steps that are kept, in the order in which they were computed. After a backward pass the gates
    /// are their gradients.
    pub(crate) fn named(&self, model: &str) -> Vec<Named<'_, E>> {
        let rows = self.steps.last().map_or(0, |step| step.rows.end);
        let (inputs, hidden, outputs) = (self.sizes.inputs, self.sizes.hidden, self.sizes.outputs);
        [
            ("inputs", inputs, &self.inputs),
            ("input layer", hidden, &self.features),
            ("gru gates", GATES * hidden, &self.gates),
            ("gru hidden state", hidden, &self.hidden),
            ("logits", outputs, &self.logits),
        ]
        .map(|(name, columns, values)| {
            let values = &values.as_slice()[..rows * columns];
            Named::new(format!("{model} {name}"), ROWS, columns, values)
        })
        .into()
    }

    /// The gradients that the backward pass keeps, in the order in which it computes them: those of the logits and of the
    /// gates' pre-activations. To be asked after it.
    pub(crate) fn named_gradients(&self, model: &str) -> Vec<Named<'_, E>> {
        let rows = self.steps.last().map_or(0, |step| step.rows.end);
        let (hidden, outputs) = (self.sizes.hidden, self.sizes.outputs);
        [
            ("logits", outputs, &self.logits_gradient),
            ("gru gates", GATES * hidden, &self.gates),
        ]
        .map(|(name, columns, values)| {
            let values = &values.as_slice()[..rows * columns];
            Named::new(format!("gradient of {model} {name}"), ROWS, columns, values)
        })
        .into()
    }
}

impl<E: Element> FeedForwardTrace<E> {
    /// The activations of the latest batch, in the order in which they were computed.
    pub(crate) fn named(&self, model: &str) -> Vec<Named<'_, E>> {
        [
            ("inputs", self.sizes.inputs, &self.inputs),
            ("input layer", self.sizes.hidden, &self.features),
            ("values", self.sizes.outputs, &self.outputs),
        ]
        .map(|(name, columns, values)| {
            let values = &values.as_slice()[..self.rows * columns];
            Named::new(format!("{model} {name}"), ROWS, columns, values)
        })
        .into()
    }
}
