//! What the networks computed over an experience: a cache that saves the first epoch a forward pass.
//!
//! Activations belong to one version of the parameters, and a backward pass uses them up. [`Activations::serve`] says whether they
//! can be differentiated; where they cannot, the experience is computed again from its inputs.

use super::tables::Tables;
use crate::{
    experience::{Rows, StepRows},
    nn::{MaskedLogSoftmax, RecurrentNetwork, RecurrentWeights, Retention, Trace},
    policy::Recording,
};

/// The activations of all banks.
#[derive(Debug, Default)]
pub struct Activations {
    /// The parameters that they were computed with; 0 before anything was.
    pub(crate) version: u64,
    /// Of each level that has a network.
    pub(crate) banks: Vec<Option<BankActivations>>,
    /// log p(u) under these parameters \[B\]\[T\].
    pub(crate) log_p_bt: Vec<Vec<f32>>,
    /// Room for computing an experience again, one for each environment.
    pub(super) tables: Vec<Tables>,
}

/// The activations of one bank, row by row as in its [`Rows`].
#[derive(Debug)]
pub(crate) struct BankActivations {
    pub(crate) trace: Trace<f32>,
    pub(crate) epsilon: f32,
    selective: bool,
    retention: Retention,
    columns: usize,
    /// \[rows that were asked, C\], of all steps if they are recorded, else of the latest.
    pub(crate) log_p_rc: Vec<f32>,
    pub(crate) softmax_rc: Vec<f32>,
    /// How log p(u) depends on the rows, ascending by row and column.
    pub(crate) entries: Vec<Entry>,
}

/// That log p(u) of one step depends on one entry of a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) step: usize,
    pub(crate) environment: usize,
    /// Row among all that were asked.
    pub(crate) row: usize,
    pub(crate) column: usize,
    /// ∂ log p(u) / ∂ log p of the entry: a posterior probability.
    pub(crate) posterior: f32,
}

impl Activations {
    /// Whether the activations are those of `version` and unspent: they can be differentiated as they are.
    #[must_use]
    pub fn serve(&self, version: u64) -> bool {
        let mut banks = self.banks.iter().flatten();
        self.version == version && !banks.any(|bank| bank.trace.is_spent())
    }

    /// log p(u) of every step under the parameters that the activations belong to \[B\]\[T\], over all ways to it (eq. 5).
    #[must_use]
    pub fn log_p_bt(&self) -> &[Vec<f32>] {
        &self.log_p_bt
    }

    /// Forgets everything but the memory.
    pub(crate) fn begin(&mut self, version: u64, recording: Recording) {
        self.version = version;
        self.log_p_bt.iter_mut().for_each(Vec::clear);
        for bank in self.banks.iter_mut().flatten() {
            bank.begin(recording);
        }
    }
}

impl BankActivations {
    /// Room for the activations of `network`.
    pub(crate) fn new(network: &RecurrentNetwork, selective: bool) -> Self {
        let mut activations = Self {
            trace: Trace::new(network.sizes(), Retention::LastStep),
            epsilon: 0.0,
            selective,
            retention: Retention::LastStep,
            columns: network.sizes().outputs,
            log_p_rc: Vec::new(),
            softmax_rc: Vec::new(),
            entries: Vec::new(),
        };
        activations.trace = activations.empty_trace();
        activations
    }

    fn empty_trace(&self) -> Trace<f32> {
        if self.selective {
            Trace::selective(self.trace.sizes, self.retention)
        } else {
            Trace::new(self.trace.sizes, self.retention)
        }
    }

    fn begin(&mut self, recording: Recording) {
        let retention = match recording {
            Recording::ForLearning => Retention::Episode,
            Recording::Off => Retention::LastStep,
        };
        if self.retention != retention {
            self.retention = retention;
            self.trace = self.empty_trace();
        }
        self.trace.begin_episode();
        self.entries.clear();
    }

    /// Whether only some rows are asked for a choice at a step.
    pub(crate) const fn is_selective(&self) -> bool {
        self.selective
    }

    /// Computes the log-probabilities of one step's rows, which is the next after those that were computed.
    pub(crate) fn compute(
        &mut self,
        network: &RecurrentNetwork,
        weights: &RecurrentWeights<f32>,
        (rows, step): (&Rows, &StepRows),
        epsilon: f32,
    ) {
        self.epsilon = epsilon;
        let carry = (!step.unchanged).then(|| rows.carry_of(step));
        self.trace.begin_step(step.rows.len(), carry);
        if self.selective {
            self.trace.ask(rows.asked_of(step));
        }
        network.step(weights, rows.inputs_of(step), &mut self.trace);
        let place = step.asked.start * self.columns..step.asked.end * self.columns;
        grow(&mut self.log_p_rc, place.end);
        grow(&mut self.softmax_rc, place.end);
        self.law().forward(
            self.trace.last_logits(),
            rows.masks_of(step),
            &mut self.log_p_rc[place.clone()],
            &mut self.softmax_rc[place],
        );
    }

    /// The log-probabilities \[C\] of a row, counted among all that were asked.
    pub(crate) fn log_p(&self, row: usize) -> &[f32] {
        &self.log_p_rc[row * self.columns..(row + 1) * self.columns]
    }

    /// Writes the gradient of a row's logits, counted among all that were asked, from that of a few of its log-probabilities.
    pub(crate) fn write_row_gradient(&mut self, row: usize, weights: &[(usize, f32)]) {
        let (law, place) = (self.law(), row * self.columns..(row + 1) * self.columns);
        law.row_gradient(
            &self.log_p_rc[place.clone()],
            &self.softmax_rc[place.clone()],
            weights,
            &mut self.trace.all_logits_gradient_mut()[place],
        );
    }

    pub(crate) const fn law(&self) -> MaskedLogSoftmax<f32> {
        MaskedLogSoftmax {
            columns: self.columns,
            epsilon: self.epsilon,
        }
    }
}

/// Makes room for `len` elements; never shrinks.
fn grow(buffer: &mut Vec<f32>, len: usize) {
    if buffer.len() < len {
        buffer.resize(len, 0.0);
    }
}
