//! What all controllers have in common: a recurrent network and a masked softmax with bounded exploration.
//!
//! A [`Controller`] is the network; a [`ControllerMemory`] holds the rows that it works on, one per instance that still
//! acts (a pair in an environment, say). Rows may leave between steps; those that stay keep their recurrence.

use mackrl_env::EpisodeKey;

use crate::{
    NotFinite,
    nn::{
        MaskedLogSoftmax, Named, NetworkSizes, ParameterLayout, RecurrentNetwork, RecurrentWeights,
        Retention, Trace, first_not_finite,
    },
    policy::{ControllerId, ControllerInput, Recording},
};

/// No row.
const ABSENT: usize = usize::MAX;

/// One controller's network.
#[derive(Debug, Clone)]
pub(crate) struct Controller {
    name: &'static str,
    network: RecurrentNetwork,
}

impl Controller {
    /// Adds the controller's parameters to `layout`.
    pub(crate) fn new(
        layout: &mut ParameterLayout,
        name: &'static str,
        sizes: NetworkSizes,
    ) -> Self {
        Self {
            name,
            network: RecurrentNetwork::new(layout, name, sizes),
        }
    }

    /// Draws the controller's initial parameters.
    pub(crate) fn initialise(&self, key: &EpisodeKey, parameters: &mut [f32]) {
        self.network.initialise(key, parameters);
    }

    /// The weights in the form that rows are computed with.
    pub(crate) fn weights(&self, parameters: &[f32]) -> RecurrentWeights<f32> {
        self.network.weights(parameters)
    }

    /// Brings the weights up to date with the parameters.
    pub(crate) fn refresh(&self, parameters: &[f32], weights: &mut RecurrentWeights<f32>) {
        self.network.refresh(parameters, weights);
    }
}

/// The rows of one controller over an episode.
#[derive(Debug)]
pub(crate) struct ControllerMemory {
    name: &'static str,
    sizes: NetworkSizes,
    recording: Recording,
    trace: Trace<f32>,
    /// The row of each instance at this step and at the one before, [`ABSENT`] for those that have left.
    row_of: Vec<usize>,
    previous_row_of: Vec<usize>,
    carry: Vec<usize>,
    /// Rows before this step, of those that `log_p` and `softmax` hold.
    first_row: usize,
    rows: usize,
    mask_rc: Vec<bool>,
    /// \[rows, C\], of all steps if they are recorded, else of this one.
    log_p_rc: Vec<f32>,
    softmax_rc: Vec<f32>,
    exploration: f32,
    choices: Vec<Choice>,
}

/// That log p(u) of one step depends on one entry of a row.
#[derive(Debug, Clone, Copy)]
struct Choice {
    step: usize,
    environment: usize,
    /// Row within its step.
    row: usize,
    column: usize,
    /// ∂ log p(u) / ∂ log p of the entry: a posterior probability.
    posterior: f32,
}

impl Choice {
    /// The entry's column, and the gradient of the objective with respect to its log-probability.
    fn weighted(&self, weight_bt: &[Vec<f32>]) -> (usize, f32) {
        (
            self.column,
            self.posterior * weight_bt[self.environment][self.step],
        )
    }
}

impl ControllerMemory {
    pub(crate) fn new(controller: &Controller) -> Self {
        let sizes = controller.network.sizes();
        Self {
            name: controller.name,
            sizes,
            recording: Recording::Off,
            trace: Trace::new(sizes, Retention::LastStep),
            row_of: Vec::new(),
            previous_row_of: Vec::new(),
            carry: Vec::new(),
            first_row: 0,
            rows: 0,
            mask_rc: Vec::new(),
            log_p_rc: Vec::new(),
            softmax_rc: Vec::new(),
            exploration: 0.0,
            choices: Vec::new(),
        }
    }

    /// Forgets all steps; recurrences start at zero.
    pub(crate) fn begin(&mut self, recording: Recording) {
        if self.recording != recording {
            self.recording = recording;
            let retention = match recording {
                Recording::ForLearning => Retention::Episode,
                Recording::Off => Retention::LastStep,
            };
            self.trace = Trace::new(self.sizes, retention);
        }
        self.trace.begin_episode();
        self.previous_row_of.clear();
        self.row_of.clear();
        self.first_row = 0;
        self.rows = 0;
        self.choices.clear();
    }

    /// Begins a step with one row for each of `instances`. An instance that was there before goes on where it was; after
    /// the first step, none joins.
    ///
    /// # Panics
    /// If an instance joins after the first step.
    pub(crate) fn begin_step(&mut self, instances: impl IntoIterator<Item = usize>) {
        std::mem::swap(&mut self.row_of, &mut self.previous_row_of);
        self.row_of.clear();
        self.carry.clear();
        for (row, instance) in instances.into_iter().enumerate() {
            if self.row_of.len() <= instance {
                self.row_of.resize(instance + 1, ABSENT);
            }
            self.row_of[instance] = row;
            self.carry.push(
                self.previous_row_of
                    .get(instance)
                    .copied()
                    .unwrap_or(ABSENT),
            );
        }
        let is_first = self.trace.steps() == 0;
        assert!(
            is_first || !self.carry.contains(&ABSENT),
            "no controller joins after the first step of an episode"
        );
        let unchanged = is_first
            || self.carry.len() == self.rows && self.carry.iter().enumerate().all(|(i, &c)| i == c);
        self.first_row = match self.recording {
            Recording::ForLearning => self.first_row + self.rows,
            Recording::Off => 0,
        };
        self.rows = self.carry.len();
        self.trace
            .begin_step(self.rows, (!unchanged).then_some(self.carry.as_slice()));
        let columns = self.sizes.outputs;
        grow(&mut self.mask_rc, self.rows * columns);
        grow(&mut self.log_p_rc, (self.first_row + self.rows) * columns);
        grow(&mut self.softmax_rc, (self.first_row + self.rows) * columns);
    }

    /// The input and the mask of a row of this step, to be filled; the input is zero when the step begins.
    ///
    /// # Shapes
    /// Input \[F\], mask \[C\].
    pub(crate) fn row_mut(&mut self, row: usize) -> (&mut [f32], &mut [bool]) {
        let NetworkSizes {
            inputs, outputs, ..
        } = self.sizes;
        (
            &mut self.trace.input_mut()[row * inputs..(row + 1) * inputs],
            &mut self.mask_rc[row * outputs..(row + 1) * outputs],
        )
    }

    /// Computes the log-probabilities of all rows of this step.
    pub(crate) fn run(
        &mut self,
        controller: &Controller,
        weights: &RecurrentWeights<f32>,
        exploration: f32,
    ) {
        self.exploration = exploration;
        controller.network.step(weights, &mut self.trace);
        let columns = self.sizes.outputs;
        let place = self.first_row * columns..(self.first_row + self.rows) * columns;
        self.softmax().forward(
            self.trace.last_logits(),
            &self.mask_rc[..self.rows * columns],
            &mut self.log_p_rc[place.clone()],
            &mut self.softmax_rc[place],
        );
    }

    /// Refuses logits of this step that are not finite; `instance` names what a row belongs to, outermost axis first.
    pub(crate) fn check_logits<const N: usize>(
        &self,
        instance: impl FnOnce(usize) -> [(&'static str, usize); N],
    ) -> Result<(), NotFinite> {
        let logits = self.trace.last_logits();
        let Some(index) = first_not_finite(logits) else {
            return Ok(());
        };
        let columns = self.sizes.outputs;
        let mut place = instance(index / columns).to_vec();
        place.push(("column", index % columns));
        let tensor = format!("logits of {}", self.name);
        Err(NotFinite::new(tensor, &place, logits[index]))
    }

    /// The log-probabilities \[C\] of a row of this step.
    pub(crate) fn log_p(&self, row: usize) -> &[f32] {
        let columns = self.sizes.outputs;
        &self.log_p_rc[(self.first_row + row) * columns..(self.first_row + row + 1) * columns]
    }

    /// The row of `instance` at this step, if it is there.
    pub(crate) fn row_of(&self, instance: usize) -> Option<usize> {
        self.row_of
            .get(instance)
            .copied()
            .filter(|&row| row != ABSENT)
    }

    /// What a row of this step reads, under the name of its controller.
    pub(crate) fn input(&self, row: usize, controller: ControllerId) -> ControllerInput {
        let inputs = self.sizes.inputs;
        let all = self.trace.inputs(self.trace.steps() - 1);
        ControllerInput {
            controller,
            values: all[row * inputs..(row + 1) * inputs].to_vec(),
        }
    }

    /// What was computed since [`Self::begin`], in that order.
    pub(crate) fn activations(&self) -> Vec<Named<'_, f32>> {
        let mut activations = self.trace.named(self.name);
        let columns = self.sizes.outputs;
        let tables = &self.log_p_rc[..(self.first_row + self.rows) * columns];
        let name = format!("{} log p", self.name);
        activations.push(Named::new(name, ["row", "column"], columns, tables));
        activations
    }

    /// What the latest backward pass computed, in that order.
    pub(crate) fn gradients(&self) -> Vec<Named<'_, f32>> {
        self.trace.named_gradients(self.name)
    }

    /// Notes that log p(u) of this step in `environment` depends on an entry of a row with the weight `posterior`.
    pub(crate) fn record(&mut self, row: usize, column: usize, environment: usize, posterior: f32) {
        if posterior != 0.0 {
            let step = self.trace.steps() - 1;
            self.choices.push(Choice {
                step,
                environment,
                row,
                column,
                posterior,
            });
        }
    }

    /// Adds Σ `weight_bt` ∇ log p(u) over all recorded choices to `gradient`.
    ///
    /// # Shapes
    /// `weight_bt` \[B\]\[T\], each episode with its own T.
    pub(crate) fn backward(
        &mut self,
        controller: &Controller,
        weights: &RecurrentWeights<f32>,
        weight_bt: &[Vec<f32>],
        gradient: &mut [f32],
    ) {
        // Choices were noted environment by environment; the gradient is written row by row.
        self.choices
            .sort_unstable_by_key(|choice| (choice.step, choice.row, choice.column));
        let columns = self.sizes.outputs;
        let softmax = self.softmax();
        let mut rest = self.choices.as_slice();
        let mut entries = Vec::with_capacity(columns);
        let mut tables = self
            .log_p_rc
            .chunks_exact(columns)
            .zip(self.softmax_rc.chunks_exact(columns));
        for step in 0..self.trace.steps() {
            let step_gradient = self.trace.logits_gradient_mut(step);
            for (row, row_gradient) in step_gradient.chunks_exact_mut(columns).enumerate() {
                let own = rest
                    .iter()
                    .take_while(|c| (c.step, c.row) == (step, row))
                    .count();
                entries.clear();
                entries.extend(rest[..own].iter().map(|choice| choice.weighted(weight_bt)));
                rest = &rest[own..];
                let (log_p, softmax_c) = tables.next().expect("every row has a table");
                softmax.row_gradient(log_p, softmax_c, &entries, row_gradient);
            }
        }
        controller
            .network
            .backward(weights, &mut self.trace, gradient);
    }

    const fn softmax(&self) -> MaskedLogSoftmax<f32> {
        MaskedLogSoftmax {
            columns: self.sizes.outputs,
            epsilon: self.exploration,
        }
    }
}

/// Makes room for `len` elements; never shrinks.
fn grow<T: Clone + Default>(buffer: &mut Vec<T>, len: usize) {
    if buffer.len() < len {
        buffer.resize(len, T::default());
    }
}

#[cfg(test)]
mod tests {
    use mackrl_env::Stream;

    use super::*;

    const SIZES: NetworkSizes = NetworkSizes {
        inputs: 3,
        hidden: 5,
        outputs: 2,
    };

    struct Subject {
        controller: Controller,
        weights: RecurrentWeights<f32>,
        parameters: usize,
    }

    impl Subject {
        fn new() -> Self {
            let mut layout = ParameterLayout::new();
            let controller = Controller::new(&mut layout, "controller", SIZES);
            let mut parameters = vec![0.0; layout.len()];
            controller.initialise(&EpisodeKey::new(1, Stream::Other, 0), &mut parameters);
            Self {
                weights: controller.weights(&parameters),
                parameters: parameters.len(),
                controller,
            }
        }

        /// Plays steps with the given instances, whose inputs depend on instance and step; gives the log-probabilities of
        /// `watched` at each step.
        fn play(&self, steps: &[&[usize]], watched: usize) -> (ControllerMemory, Vec<Vec<f32>>) {
            let mut memory = ControllerMemory::new(&self.controller);
            memory.begin(Recording::ForLearning);
            let mut log_p = Vec::new();
            for (step, instances) in steps.iter().enumerate() {
                memory.begin_step(instances.iter().copied());
                for (row, &instance) in instances.iter().enumerate() {
                    let (input, mask) = memory.row_mut(row);
                    input[instance % SIZES.inputs] = 1.0 + step as f32;
                    mask.fill(true);
                }
                memory.run(&self.controller, &self.weights, 0.1);
                if let Some(row) = memory.row_of(watched) {
                    log_p.push(memory.log_p(row).to_vec());
                }
            }
            (memory, log_p)
        }

        /// The gradient after each of `choices`, (row, column, posterior), was noted at the latest step.
        fn gradient(&self, choices: &[(usize, usize, f32)]) -> Vec<f32> {
            let (mut memory, _) = self.play(&[&[0, 1], &[0, 1]], 0);
            for &(row, column, posterior) in choices {
                memory.record(row, column, 0, posterior);
            }
            let mut gradient = vec![0.0; self.parameters];
            memory.backward(
                &self.controller,
                &self.weights,
                &[vec![9.0, 0.5]],
                &mut gradient,
            );
            gradient
        }
    }

    #[test]
    fn a_row_that_stays_keeps_its_recurrence_when_others_leave() {
        let subject = Subject::new();
        let (_, among_others) = subject.play(&[&[0, 1, 4], &[1, 4], &[4]], 4);
        let (_, alone) = subject.play(&[&[4], &[4], &[4]], 4);
        assert_eq!(among_others, alone);
        assert_ne!(alone[1], alone[2], "inputs change nothing");
        let (_, gone) = subject.play(&[&[0, 1, 4], &[1, 4], &[4]], 1);
        assert_eq!(gone.len(), 2, "an instance that left has no row");
    }

    #[test]
    #[should_panic(expected = "no controller joins after the first step")]
    fn a_controller_that_joins_late_is_refused() {
        Subject::new().play(&[&[0], &[0, 1]], 0);
    }

    #[test]
    fn a_choice_weighs_what_its_posteriors_sum_to() {
        let subject = Subject::new();
        let whole = subject.gradient(&[(1, 0, 1.0), (0, 1, 0.5)]);
        let parts = subject.gradient(&[(0, 1, 0.5), (1, 0, 0.25), (1, 0, 0.75)]);
        assert!(whole.iter().any(|&g| g != 0.0), "no gradient at all");
        for (whole, parts) in whole.iter().zip(parts) {
            assert!((whole - parts).abs() < 1e-6, "{whole} {parts}");
        }
        let other = subject.gradient(&[(1, 1, 1.0), (0, 1, 0.5)]);
        assert_ne!(whole, other, "the column makes no difference");
        assert_eq!(
            subject.gradient(&[(1, 0, 0.0)]),
            vec![0.0; subject.parameters]
        );
    }
}
