//! Values of choices: one network reads a row for each choice and gives a row of numbers, one of which belongs to what was done.
//!
//! Where there is one column, it is the value of the situation; where there is one for each action, or for each joint action of a pair,
//! a row compares what was done with everything that could have been done, in one pass of the network. Only the column of what was
//! done learns. Rows lie by time, and there is one optimiser step for each time from the last to the first, as in PyMARL.

use std::ops::Range;

use mackrl_env::EpisodeKey;

use super::{CriticReport, explained};
use crate::{
    NotFinite, Real,
    nn::{
        FeedForward, FeedForwardTrace, FeedForwardWeights, Moments, Optimiser, OptimiserKind,
        ParameterLayout, finite_step,
    },
    objectives::squared_errors,
};

/// Sizes of a [`ChoiceCritic`], and how it learns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChoiceCriticSettings {
    /// What the names of its parameters begin with.
    pub name: &'static str,
    /// F: length of a row.
    pub inputs: usize,
    /// Units of each of the two hidden layers.
    pub hidden: usize,
    /// C: columns that it gives for a row.
    pub outputs: usize,
    /// How parameters follow the gradient.
    pub optimiser: OptimiserKind,
    /// Step size.
    pub learning_rate: f64,
    /// Longest gradient.
    pub gradient_norm_max: f64,
}

/// The values of choices.
#[derive(Debug)]
pub struct ChoiceCritic {
    settings: ChoiceCriticSettings,
    layout: ParameterLayout,
    pub(super) network: FeedForward,
    parameters: Vec<f32>,
    weights: FeedForwardWeights<f32>,
    optimiser: Optimiser<f32>,
    gradient: Vec<f32>,
    pub(super) trace: FeedForwardTrace<f32>,
}

/// The rows of choices, by time.
#[derive(Debug, Clone, Default)]
pub struct ChoiceRows {
    /// The first row of each time, and behind the last.
    first_t: Vec<usize>,
    /// What is read \[R, F\].
    pub input_rf: Vec<f32>,
    /// The column of what was done \[R\].
    pub column_r: Vec<usize>,
}

impl ChoiceRows {
    /// Makes room for so many rows at each time: inputs are zero and all columns 0 until they are written.
    pub fn begin(&mut self, counts: impl IntoIterator<Item = usize>, inputs: usize) {
        self.first_t.clear();
        self.first_t.push(0);
        let mut rows = 0;
        self.first_t.extend(counts.into_iter().map(|count| {
            rows += count;
            rows
        }));
        self.input_rf.clear();
        self.input_rf.resize(rows * inputs, 0.0);
        self.column_r.clear();
        self.column_r.resize(rows, 0);
    }

    /// R: how many there are.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.column_r.len()
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.column_r.is_empty()
    }

    /// The first row of time `t`; that behind the last, after the last time.
    #[must_use]
    pub fn first(&self, t: usize) -> usize {
        self.first_t[t]
    }
}

impl ChoiceCritic {
    /// A critic whose initial parameters are drawn from `key`.
    #[must_use]
    pub fn new(settings: ChoiceCriticSettings, key: &EpisodeKey) -> Self {
        let (layout, network) = Self::network(&settings);
        let mut parameters = vec![0.0; layout.len()];
        network.initialise(key, &mut parameters);
        Self {
            weights: network.weights(&parameters),
            optimiser: Optimiser::new(settings.optimiser, parameters.len()),
            gradient: vec![0.0; parameters.len()],
            trace: FeedForwardTrace::of(&network),
            settings,
            layout,
            network,
            parameters,
        }
    }

    /// How many parameters such a critic has.
    #[must_use]
    pub fn size(settings: &ChoiceCriticSettings) -> usize {
        Self::network(settings).0.len()
    }

    fn network(settings: &ChoiceCriticSettings) -> (ParameterLayout, FeedForward) {
        let mut layout = ParameterLayout::new();
        let widths = [
            settings.inputs,
            settings.hidden,
            settings.hidden,
            settings.outputs,
        ];
        let network = FeedForward::with_widths(&mut layout, settings.name, &widths);
        (layout, network)
    }

    /// Its sizes, and how it learns.
    #[must_use]
    pub const fn settings(&self) -> &ChoiceCriticSettings {
        &self.settings
    }

    /// Names and shapes of the parameters.
    #[must_use]
    pub const fn layout(&self) -> &ParameterLayout {
        &self.layout
    }

    /// The parameters.
    #[must_use]
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// What the optimiser remembers.
    #[must_use]
    pub const fn moments(&self) -> &Moments<f32> {
        self.optimiser.moments()
    }

    /// Takes other parameters.
    ///
    /// # Panics
    /// If there are not as many as the layout says.
    pub fn load(&mut self, parameters: &[f32]) {
        self.network.refresh(parameters, &mut self.weights);
        self.parameters.copy_from_slice(parameters);
    }

    /// Continues with what an optimiser remembered.
    ///
    /// # Panics
    /// If the moments are those of another number of parameters.
    pub fn restore_moments(&mut self, moments: Moments<f32>) {
        self.optimiser.restore(moments);
    }

    /// Learns the targets of a batch's choices, one optimiser step for each time that has any, from the last to the first, and writes
    /// what it gave for each row when its step came.
    ///
    /// # Shapes
    /// `target_r` \[R\]; `value_rc` becomes \[R, C\].
    ///
    /// # Errors
    /// [`NotFinite`] if a value, a gradient or a number after a step is not finite.
    pub fn learn(
        &mut self,
        rows: &ChoiceRows,
        target_r: &[f32],
        value_rc: &mut Vec<f32>,
    ) -> Result<CriticReport, NotFinite> {
        let outputs = self.settings.outputs;
        value_rc.clear();
        value_rc.resize(rows.len() * outputs, 0.0);
        let mut report = CriticReport::default();
        let ranges = rows.first_t.windows(2).map(|ends| ends[0]..ends[1]);
        let ranges: Vec<Range<usize>> = ranges.filter(|range| !range.is_empty()).collect();
        let times = ranges.len();
        for own in ranges.into_iter().rev() {
            let values = &mut value_rc[own.start * outputs..own.end * outputs];
            let one = self.update(rows, own, target_r, values)?;
            report.loss += one.loss / times as f64;
            report.gradient_norm += one.gradient_norm / times as f64;
            report.td_error_abs += one.td_error_abs / times as f64;
            report.target_mean += one.target_mean / times as f64;
        }
        let chosen_r = chosen(value_rc, outputs, &rows.column_r);
        report.explained_variance = explained(target_r.iter().zip(chosen_r));
        Ok(report)
    }

    /// One optimiser step on some rows.
    fn update(
        &mut self,
        rows: &ChoiceRows,
        own: Range<usize>,
        target_r: &[f32],
        values: &mut [f32],
    ) -> Result<CriticReport, NotFinite> {
        let ChoiceCriticSettings {
            inputs, outputs, ..
        } = self.settings;
        let (columns, targets) = (&rows.column_r[own.clone()], &target_r[own.clone()]);
        let count = own.len() as f64;
        self.trace
            .begin(own.len())
            .copy_from_slice(&rows.input_rf[own.start * inputs..own.end * inputs]);
        self.network.forward(&self.weights, &mut self.trace);
        let (given, gradients) = self.trace.outputs_and_gradient_mut();
        values.copy_from_slice(given);
        let chosen: Vec<f32> = chosen(given, outputs, columns).copied().collect();
        let mut slopes = vec![0.0; chosen.len()];
        let weight = Real::from_f64(1.0 / count);
        let errors = squared_errors(weight, [&chosen, targets], &mut slopes);
        if !errors.absolute.is_finite() {
            let broken = chosen.iter().position(|value| !value.is_finite());
            let (name, row) = (self.settings.name, broken.unwrap_or(0));
            let name = format!("{name}.value");
            return Err(NotFinite::new(name, &[("row", row)], chosen[row]));
        }
        gradients.fill(0.0);
        for ((gradient_c, &column), slope) in
            gradients.chunks_exact_mut(outputs).zip(columns).zip(slopes)
        {
            gradient_c[column] = slope;
        }
        self.gradient.fill(0.0);
        self.network
            .backward(&self.weights, &mut self.trace, &mut self.gradient);
        let gradient_norm = finite_step(
            &mut self.optimiser,
            &self.layout,
            [self.settings.learning_rate, self.settings.gradient_norm_max],
            &mut self.gradient,
            &mut self.parameters,
        )?;
        self.network.refresh(&self.parameters, &mut self.weights);
        let target: f64 = targets.iter().map(|&target| f64::from(target)).sum();
        Ok(CriticReport {
            loss: errors.loss,
            gradient_norm,
            td_error_abs: errors.absolute / count,
            target_mean: target / count,
            // Of all rows together, which are not known here.
            explained_variance: 0.0,
        })
    }
}

/// Of values \[R, C\], those in the columns of what was done \[R\].
pub(super) fn chosen<'a>(
    value_rc: &'a [f32],
    outputs: usize,
    column_r: &'a [usize],
) -> impl Iterator<Item = &'a f32> {
    let rows = value_rc.chunks_exact(outputs).zip(column_r);
    rows.map(|(value_c, &column)| &value_c[column])
}

#[cfg(test)]
mod tests {
    use mackrl_env::Stream;

    use super::*;

    /// Rows at some times only; what was done there is worth 1 or 2, and what was not done keeps its value.
    #[test]
    fn only_what_was_done_learns_its_target() {
        let settings = ChoiceCriticSettings {
            name: "pair_critic",
            inputs: 3,
            hidden: 16,
            outputs: 4,
            optimiser: OptimiserKind::ADAM,
            learning_rate: 3e-3,
            gradient_norm_max: 10.0,
        };
        let mut critic = ChoiceCritic::new(settings, &EpisodeKey::new(1, Stream::Other, 2));
        let mut rows = ChoiceRows::default();
        rows.begin([1, 0, 2], settings.inputs);
        assert_eq!((rows.len(), rows.first(2), rows.first(3)), (3, 1, 3));
        for row in 0..3 {
            rows.input_rf[row * 3 + row] = 1.0;
            rows.column_r[row] = row;
        }
        let targets = [1.0, 2.0, 1.0];
        let mut values = Vec::new();
        let first = critic.learn(&rows, &targets, &mut values).unwrap();
        assert!(first.explained_variance < 0.9, "{first:?}");
        for _ in 0..600 {
            critic.learn(&rows, &targets, &mut values).unwrap();
        }
        let output = |name: &str| {
            let mut tensors = critic.layout().tensors().iter();
            let found = tensors.find(|tensor| tensor.name == name);
            critic.parameters()[found.expect("a tensor").range.clone()].to_vec()
        };
        for (row, target) in targets.into_iter().enumerate() {
            let value = values[row * 4 + row];
            assert!((value - target).abs() < 0.05, "{row}: {value}");
        }
        let fresh = ChoiceCritic::new(settings, &EpisodeKey::new(1, Stream::Other, 2));
        let bias = output("pair_critic.output.bias");
        let range = fresh
            .layout()
            .tensors()
            .last()
            .expect("a bias")
            .range
            .clone();
        assert_eq!(bias[3], fresh.parameters()[range][3], "the last column");
        let nothing = critic.learn(&ChoiceRows::default(), &[], &mut values);
        assert_eq!((nothing.unwrap().loss, values.len()), (0.0, 0));
    }
}
