//! The activations of a recurrent network over an episode.
//!
//! The caller owns a trace and uses it from update to update; it is filled while acting and read by the backward pass, so
//! there is no second forward pass (the inputs are the caller's, too, and stay there), and after the longest episode nothing is allocated any more. All steps lie one after the
//! other, however many rows each has: products over whole steps or many steps see one matrix.

use std::ops::Range;

use crate::{
    Real,
    nn::{aligned::Aligned, gates::GATES, layer_norm::KEPT, recurrent::NetworkSizes},
};

/// Stands in place of the row to continue where a row begins with a hidden state of zero.
pub const BEGINS: usize = usize::MAX;

/// How much of an episode a [`Trace`] keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Retention {
    /// Every step, for the backward pass.
    Episode,
    /// The last step only, for acting without learning.
    LastStep,
}

/// One step of a trace.
#[derive(Debug, Clone)]
pub(crate) struct Step {
    /// Its rows among those of all steps.
    pub(crate) rows: Range<usize>,
    /// Its rows of logits among those of all steps.
    pub(crate) asked: Range<usize>,
    /// Whether row i continues row i of the previous step, for every i.
    pub(crate) unchanged: bool,
    /// Whether every row begins with a hidden state of zero.
    pub(crate) begins: bool,
}

/// The activations of a recurrent network, step after step.
#[derive(Debug, Clone)]
pub struct Trace<R> {
    pub(crate) sizes: NetworkSizes,
    retention: Retention,
    /// Whether only the rows that are asked for get logits.
    pub(crate) selective: bool,
    steps_begun: usize,
    /// Whether a backward pass has used the activations up.
    pub(crate) spent: bool,
    pub(crate) steps: Vec<Step>,
    /// For every row, the row of the previous step that it continues.
    pub(crate) carry: Vec<usize>,
    /// [rows, hidden], the rectified output of the first layer.
    pub(crate) features: Aligned<R>,
    /// [rows, 2], what normalised features keep for the backward pass.
    pub(crate) norms: Aligned<R>,
    /// [rows, hidden], the hidden state that each row continues.
    pub(crate) previous: Aligned<R>,
    /// [rows, 4 hidden]
    pub(crate) gates: Aligned<R>,
    /// [rows, hidden]
    pub(crate) hidden: Aligned<R>,
    /// For every row of logits of a selective trace, its row among those of all steps.
    pub(crate) asked: Vec<usize>,
    /// [rows of logits, hidden], what the last layer read where it is not `hidden` itself: some rows of it, or normalised ones.
    pub(crate) asked_hidden: Aligned<R>,
    /// [rows of logits, 2], what the latter keep for the backward pass.
    pub(crate) state_norms: Aligned<R>,
    /// [rows of logits, outputs]
    pub(crate) logits: Aligned<R>,
    /// [rows of logits, outputs]
    pub(crate) logits_gradient: Aligned<R>,
    pub(crate) workspace: Workspace<R>,
}

/// Buffers of the backward pass.
#[derive(Debug, Clone, Default)]
pub(crate) struct Workspace<R> {
    /// [rows of a block, hidden]
    pub(crate) features_gradient: Aligned<R>,
    /// [rows of a step, hidden]
    pub(crate) hidden_gradient: Aligned<R>,
    /// [rows of a step, hidden]
    pub(crate) carried_gradient: Aligned<R>,
    /// [rows of logits of a step, hidden]
    pub(crate) asked_gradient: Aligned<R>,
    pub(crate) scratch: Aligned<R>,
}

impl<R: Real> Trace<R> {
    /// An empty trace for networks of these sizes, in which every row has logits.
    #[must_use]
    pub fn new(sizes: NetworkSizes, retention: Retention) -> Self {
        Self::with_selection(sizes, retention, false)
    }

    /// An empty trace in which only those rows have logits that [`ask`](Self::ask) names: recurrences advance in all rows, but
    /// the last layer, the widest where there are many actions, is computed for a few of them.
    #[must_use]
    pub fn selective(sizes: NetworkSizes, retention: Retention) -> Self {
        Self::with_selection(sizes, retention, true)
    }

    fn with_selection(sizes: NetworkSizes, retention: Retention, selective: bool) -> Self {
        Self {
            sizes,
            retention,
            selective,
            steps_begun: 0,
            spent: false,
            steps: Vec::new(),
            carry: Vec::new(),
            features: Aligned::default(),
            norms: Aligned::default(),
            previous: Aligned::default(),
            gates: Aligned::default(),
            hidden: Aligned::default(),
            asked: Vec::new(),
            asked_hidden: Aligned::default(),
            state_norms: Aligned::default(),
            logits: Aligned::default(),
            logits_gradient: Aligned::default(),
            workspace: Workspace::default(),
        }
    }

    /// Forgets all steps; the next one starts from a hidden state of zero.
    pub fn begin_episode(&mut self) {
        self.steps_begun = 0;
        self.spent = false;
        self.steps.clear();
        self.carry.clear();
        self.asked.clear();
    }

    /// Begins a step of `rows` rows.
    ///
    /// Row i continues row `carry[i]` of the previous step (or begins anew, where that is [`BEGINS`]), or row i where `carry` is
    /// `None`. The first step of an episode has nothing to continue and ignores `carry`.
    ///
    /// # Panics
    /// If `carry` does not have one entry a row, or an entry (or, without `carry`, a row) that the previous step lacks.
    pub fn begin_step(&mut self, rows: usize, carry: Option<&[usize]>) {
        let last = self.steps.last();
        let [start, first_asked] = match (self.retention, last) {
            (Retention::Episode, Some(last)) => [last.rows.end, last.asked.end],
            _ => [0, 0],
        };
        let previous = last.map(|step| step.rows.clone());
        if self.retention == Retention::LastStep {
            self.steps.clear();
            self.carry.clear();
            self.asked.clear();
        }
        self.grow(start + rows);
        let h = self.sizes.hidden;
        let states = &mut self.previous.as_mut_slice()[start * h..(start + rows) * h];
        if let Some(previous) = &previous {
            let last = &self.hidden.as_slice()[previous.start * h..previous.end * h];
            match carry {
                Some(carry) => {
                    assert_eq!(carry.len(), rows, "one row to continue for each row");
                    for (state, &row) in states.chunks_exact_mut(h).zip(carry) {
                        match row {
                            BEGINS => state.fill(R::ZERO),
                            row => state.copy_from_slice(&last[row * h..][..h]),
                        }
                    }
                    self.carry.extend_from_slice(carry);
                }
                None => {
                    states.copy_from_slice(&last[..rows * h]);
                    self.carry.extend(0..rows);
                }
            }
        } else {
            states.fill(R::ZERO);
            self.carry.extend(0..rows);
        }
        let begins =
            previous.is_none() || carry.is_some_and(|carry| carry.iter().all(|&row| row == BEGINS));
        let unchanged = carry.is_none() && previous.is_none_or(|previous| previous.len() == rows);
        let asked = if self.selective { 0 } else { rows };
        self.logits.grow((first_asked + asked) * self.sizes.outputs);
        self.steps.push(Step {
            rows: start..start + rows,
            asked: first_asked..first_asked + asked,
            unchanged,
            begins,
        });
        self.steps_begun += 1;
    }

    /// Asks for logits of these rows of the current step, in this order; row i of the step's logits is that of `rows[i]`. Of a
    /// step that is not asked about, no logits are computed.
    ///
    /// # Panics
    /// If the trace is not selective, no step was begun, the step was asked about before, or a row is none of the step's.
    pub fn ask(&mut self, rows: &[usize]) {
        assert!(self.selective, "every row of this trace has logits");
        let step = self.steps.last_mut().expect("a step was begun");
        assert!(step.asked.is_empty(), "a step is asked about once");
        assert!(
            rows.iter().all(|&row| row < step.rows.len()),
            "rows of the current step"
        );
        step.asked.end += rows.len();
        let (first, end) = (step.rows.start, step.asked.end);
        self.asked.extend(rows.iter().map(|row| first + row));
        self.logits.grow(end * self.sizes.outputs);
    }

    /// Whether a backward pass has used the activations up; a new episode begins unspent.
    #[must_use]
    pub const fn is_spent(&self) -> bool {
        self.spent
    }

    /// How many steps the episode has so far.
    #[must_use]
    pub const fn steps(&self) -> usize {
        self.steps_begun
    }

    /// How many rows step `t` has.
    ///
    /// # Panics
    /// If the trace does not hold step `t`.
    #[must_use]
    pub fn rows(&self, t: usize) -> usize {
        self.rows_of(t).len()
    }

    /// The hidden state after step `t` [rows, hidden].
    ///
    /// # Panics
    /// If the trace does not hold step `t`.
    #[must_use]
    pub fn hidden(&self, t: usize) -> &[R] {
        rows_of(&self.hidden, self.rows_of(t), self.sizes.hidden)
    }

    /// The logits of step `t` [rows, outputs], or of the rows that were asked for.
    ///
    /// # Panics
    /// If the trace does not hold step `t`.
    #[must_use]
    pub fn logits(&self, t: usize) -> &[R] {
        rows_of(&self.logits, self.step(t).asked.clone(), self.sizes.outputs)
    }

    /// The logits of the current step [rows, outputs], or of the rows that were asked for.
    ///
    /// # Panics
    /// If no step was begun.
    #[must_use]
    pub fn last_logits(&self) -> &[R] {
        let asked = self.last_step().asked.clone();
        rows_of(&self.logits, asked, self.sizes.outputs)
    }

    /// The place for the gradient of the logits of step `t` [rows, outputs] (or of the rows that were asked for), to be filled
    /// before the backward pass. It holds numbers of earlier episodes: write every element.
    ///
    /// # Panics
    /// If the trace does not hold step `t`.
    pub fn logits_gradient_mut(&mut self, t: usize) -> &mut [R] {
        let rows = self.step(t).asked.clone();
        let outputs = self.sizes.outputs;
        self.logits_gradient
            .grow(self.last_step().asked.end * outputs);
        &mut self.logits_gradient.as_mut_slice()[rows.start * outputs..rows.end * outputs]
    }

    /// The hidden states of all steps that are kept [rows, hidden].
    pub(crate) fn all_hidden(&self) -> &[R] {
        let end = self.steps.last().map_or(0, |step| step.rows.end);
        &self.hidden.as_slice()[..end * self.sizes.hidden]
    }

    /// The logits of all steps that are kept [rows of logits, outputs].
    pub(crate) fn all_logits(&self) -> &[R] {
        let end = self.steps.last().map_or(0, |step| step.asked.end);
        &self.logits.as_slice()[..end * self.sizes.outputs]
    }

    /// The place for the gradient of all logits [rows of logits, outputs], as [`logits_gradient_mut`](Self::logits_gradient_mut)
    /// gives it step by step.
    pub(crate) fn all_logits_gradient_mut(&mut self) -> &mut [R] {
        let end = self.steps.last().map_or(0, |step| step.asked.end) * self.sizes.outputs;
        self.logits_gradient.grow(end);
        &mut self.logits_gradient.as_mut_slice()[..end]
    }

    /// The rows of the current step among all that are kept.
    pub(crate) fn last_rows(&self) -> Range<usize> {
        self.last_step().rows.clone()
    }

    pub(crate) fn last_step(&self) -> &Step {
        self.steps.last().expect("a step was begun")
    }

    /// Gives each row of the step before `t` the sum of the hidden state's gradients of the rows that continue it.
    pub(crate) fn carry_gradient_back(&mut self, t: usize) {
        if t == 0 || self.steps[t].unchanged {
            return;
        }
        let h = self.sizes.hidden;
        let before = self.steps[t - 1].rows.len();
        let Workspace {
            hidden_gradient,
            carried_gradient,
            ..
        } = &mut self.workspace;
        carried_gradient.grow(before * h);
        let carried = &mut carried_gradient.as_mut_slice()[..before * h];
        carried.fill(R::ZERO);
        let gradients = hidden_gradient.as_slice().chunks_exact(h);
        for (&row, gradient) in self.carry[self.steps[t].rows.clone()].iter().zip(gradients) {
            if row == BEGINS {
                continue;
            }
            for (sum, &term) in carried[row * h..][..h].iter_mut().zip(gradient) {
                *sum += term;
            }
        }
        std::mem::swap(hidden_gradient, carried_gradient);
    }

    fn rows_of(&self, t: usize) -> Range<usize> {
        self.step(t).rows.clone()
    }

    fn step(&self, t: usize) -> &Step {
        let forgotten = self.steps_begun - self.steps.len();
        &self.steps[t - forgotten]
    }

    fn grow(&mut self, rows: usize) {
        let hidden = self.sizes.hidden;
        self.features.grow(rows * hidden);
        self.norms.grow(rows * KEPT);
        self.previous.grow(rows * hidden);
        self.gates.grow(rows * GATES * hidden);
        self.hidden.grow(rows * hidden);
    }
}

fn rows_of<R: Real>(buffer: &Aligned<R>, rows: Range<usize>, columns: usize) -> &[R] {
    &buffer.as_slice()[rows.start * columns..rows.end * columns]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZES: NetworkSizes = NetworkSizes {
        inputs: 3,
        hidden: 5,
        outputs: 7,
    };

    fn run_episode(trace: &mut Trace<f32>, steps: usize) {
        trace.begin_episode();
        for _ in 0..steps {
            trace.begin_step(11, None);
            let t = trace.steps() - 1;
            trace.logits_gradient_mut(t).fill(1.0);
        }
    }

    #[test]
    fn a_later_episode_moves_no_buffer() {
        let mut trace = Trace::new(SIZES, Retention::Episode);
        run_episode(&mut trace, 13);
        let places = [trace.hidden(0).as_ptr(), trace.logits(0).as_ptr()];
        run_episode(&mut trace, 13);
        assert_eq!(trace.hidden(0).as_ptr(), places[0], "place of the states");
        assert_eq!(trace.logits(0).as_ptr(), places[1], "place of the logits");
    }

    #[test]
    fn a_trace_of_the_last_step_does_not_grow() {
        let mut trace = Trace::<f32>::new(SIZES, Retention::LastStep);
        for t in 0..17 {
            trace.begin_step(2, None);
            assert_eq!(trace.steps(), t + 1, "steps begun");
            assert_eq!(trace.rows(t), 2, "rows of the current step");
        }
        assert_eq!(trace.last_rows(), 0..2, "place of the last step");
    }
}
