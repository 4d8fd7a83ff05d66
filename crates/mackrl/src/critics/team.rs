//! V of each member of a team, from what it sees and, where the critic is central, from the state.
//!
//! A value of the state alone says of a member only what the whole team can expect; one that reads the member's own
//! observation too tells it from the others. The value of a group is the mean of its members', so every group that may be
//! formed has one, whichever was formed before.
//!
//! Values are learnt in units of the returns that were met so far (van Hasselt and others, 2016, without the correction of
//! weights): the network's outputs are of about unit size in every world.

use mackrl_env::EpisodeKey;

use crate::{
    NotFinite, Real,
    experience::Experience,
    nn::{
        Optimiser, OptimiserKind, ParameterLayout, ValueNetwork, ValueSizes, ValueTrace,
        ValueWeights, finite_step, normalise_rows,
    },
    objectives::ValueLoss,
};

/// Rows that are worked on together, so that what is computed of them stays in the cache.
const BLOCK_ROWS: usize = 256;
/// Weight of the past in the averages of returns; as long as there have been few, all count alike.
const SMOOTHING: f32 = 0.999_99;
/// Least variance of returns.
const LEAST_VARIANCE: f32 = 1e-2;

/// Sizes and rules of a [`TeamCritic`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TeamCriticSettings {
    /// G: length of the state if the critic is central, else 0.
    pub state: usize,
    /// F: length of what a member reads.
    pub own: usize,
    /// Where in it the member's identity, one-hot, begins.
    pub identity: usize,
    /// N: members.
    pub members: usize,
    /// H: units of each layer.
    pub hidden: usize,
    /// How parameters follow the gradient.
    pub optimiser: OptimiserKind,
    /// What makes a value wrong.
    pub loss: ValueLoss<f32>,
}

/// The values of a team's members.
#[derive(Debug)]
pub struct TeamCritic {
    settings: TeamCriticSettings,
    layout: ParameterLayout,
    network: ValueNetwork,
    parameters: Vec<f32>,
    weights: ValueWeights<f32>,
    optimiser: Optimiser<f32>,
    scale: ReturnScale,
}

/// What the values of an experience are computed from: for each step of each episode a row of the state and one of each member.
#[derive(Debug, Clone, Default)]
pub struct ValueInputs {
    /// \[steps, G\]
    state_sg: Vec<f32>,
    /// \[steps, N, F\]; of the dead, only their identity.
    own_snf: Vec<f32>,
    /// The first step of each episode \[B\].
    first_b: Vec<usize>,
}

/// Averages of returns.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ReturnScale {
    /// Of returns, of their squares, and of ones: the last says how much of an average there is.
    averages: [f32; 3],
}

impl TeamCritic {
    /// A critic whose initial parameters are drawn from `key`.
    #[must_use]
    pub fn new(settings: TeamCriticSettings, key: &EpisodeKey) -> Self {
        let (layout, network) = Self::network(settings);
        let mut parameters = vec![0.0; layout.len()];
        network.initialise(key, &mut parameters);
        let mut weights = ValueWeights::default();
        network.refresh(&parameters, &mut weights);
        Self {
            optimiser: Optimiser::new(settings.optimiser, parameters.len()),
            settings,
            layout,
            network,
            parameters,
            weights,
            scale: ReturnScale::default(),
        }
    }

    /// How many parameters such a critic has.
    #[must_use]
    pub fn size(settings: TeamCriticSettings) -> usize {
        Self::network(settings).0.len()
    }

    fn network(settings: TeamCriticSettings) -> (ParameterLayout, ValueNetwork) {
        let mut layout = ParameterLayout::new();
        let sizes = ValueSizes {
            shared: settings.state,
            own: settings.own,
            members: settings.members,
            hidden: settings.hidden,
        };
        let network = ValueNetwork::new(&mut layout, super::CRITIC, sizes);
        (layout, network)
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
    pub const fn optimiser(&self) -> &Optimiser<f32> {
        &self.optimiser
    }

    /// In which units values are learnt.
    #[must_use]
    pub const fn scale(&self) -> ReturnScale {
        self.scale
    }

    /// Takes other parameters.
    ///
    /// # Panics
    /// If there are not as many as the layout says.
    pub fn load(&mut self, parameters: &[f32], scale: ReturnScale) {
        self.network.refresh(parameters, &mut self.weights);
        self.parameters.copy_from_slice(parameters);
        self.scale = scale;
    }

    /// Continues with what an optimiser remembered.
    ///
    /// # Panics
    /// If the moments are those of another number of parameters.
    pub fn restore_moments(&mut self, moments: crate::nn::Moments<f32>) {
        self.optimiser.restore(moments);
    }

    /// Notes the returns of a batch, by their number, sum and sum of squares.
    pub fn note_returns(&mut self, returns: [f64; 3]) {
        self.scale.note(returns);
    }

    /// Computes the values of an experience, in the critic's units.
    ///
    /// # Shapes
    /// `value_sn` becomes \[steps · N\].
    pub fn values(
        &self,
        inputs: &ValueInputs,
        trace: &mut ValueTrace<f32>,
        value_sn: &mut Vec<f32>,
    ) {
        value_sn.clear();
        for block in self.blocks(inputs) {
            self.network.forward(&self.weights, block, trace);
            let rows = block[1].len() / self.settings.own;
            value_sn.extend_from_slice(trace.values_and_gradient_mut(rows).0);
        }
    }

    /// Adds the gradient of the values' loss to `gradient` and gives the loss; every value counts `weight`.
    ///
    /// # Shapes
    /// `old_sn` and `target_sn` \[steps · N\], in the critic's units; `gradient` as the layout.
    pub fn differentiate(
        &self,
        inputs: &ValueInputs,
        [old_sn, target_sn]: [&[f32]; 2],
        weight: f32,
        trace: &mut ValueTrace<f32>,
        gradient: &mut [f32],
    ) -> f64 {
        let mut loss = 0.0;
        let mut first = 0;
        for block in self.blocks(inputs) {
            self.network.forward(&self.weights, block, trace);
            let rows = block[1].len() / self.settings.own;
            let (values, d_values) = trace.values_and_gradient_mut(rows);
            let known = [old_sn, target_sn].map(|numbers| &numbers[first..first + rows]);
            loss += self
                .settings
                .loss
                .of(weight, [values, known[0], known[1]], d_values);
            self.network.backward(&self.weights, block, trace, gradient);
            first += rows;
        }
        loss
    }

    /// Takes a step against `gradient`, which is shortened first if it is longer than `rates[1]`, at the rate `rates[0]`; gives
    /// the norm that it had.
    ///
    /// # Errors
    /// [`NotFinite`] if the gradient or a number after the step is not finite.
    pub fn step(&mut self, rates: [f64; 2], gradient: &mut [f32]) -> Result<f64, NotFinite> {
        let norm = finite_step(
            &mut self.optimiser,
            &self.layout,
            rates,
            gradient,
            &mut self.parameters,
        )?;
        self.network.refresh(&self.parameters, &mut self.weights);
        Ok(norm)
    }

    /// The rows of a few whole steps at a time: states, and what members read.
    fn blocks<'a>(
        &self,
        inputs: &'a ValueInputs,
    ) -> impl Iterator<Item = [&'a [f32]; 2]> + use<'a> {
        let TeamCriticSettings {
            state,
            own,
            members,
            ..
        } = self.settings;
        let steps = (BLOCK_ROWS / members).max(1);
        let all = inputs.own_snf.len() / (members * own);
        (0..all).step_by(steps).map(move |first| {
            let end = (first + steps).min(all);
            [
                &inputs.state_sg[first * state..end * state],
                &inputs.own_snf[first * members * own..end * members * own],
            ]
        })
    }
}

impl ValueInputs {
    /// Takes what a critic with these settings reads of an experience; `bank` is the bank whose rows are what members read.
    pub fn take(&mut self, settings: TeamCriticSettings, experience: &Experience, bank: usize) {
        let TeamCriticSettings {
            state,
            own,
            identity,
            members,
            ..
        } = settings;
        self.first_b.clear();
        self.state_sg.clear();
        let mut steps = 0;
        for episode in &experience.episodes {
            self.first_b.push(steps);
            steps += episode.steps();
            self.state_sg
                .extend_from_slice(&episode.state_tg[..episode.steps() * state]);
        }
        if state > 0 {
            normalise_rows(state, &mut self.state_sg);
        }
        self.own_snf.clear();
        self.own_snf.resize(steps * members * own, 0.0);
        for (row, own_f) in self.own_snf.chunks_exact_mut(own).enumerate() {
            own_f[identity + row % members] = 1.0;
        }
        let rows = &experience.banks[bank];
        for (t, step) in rows.steps().iter().enumerate() {
            let inputs = rows.inputs_of(step).chunks_exact(own);
            for (instance, input) in rows.instances_of(step).iter().zip(inputs) {
                let place = (self.first_b[instance.environment] + t) * members + instance.group;
                self.own_snf[place * own..(place + 1) * own].copy_from_slice(input);
            }
        }
    }

    /// The row of the first member at `step` of an episode.
    #[must_use]
    pub fn row(&self, episode: usize, step: usize, members: usize) -> usize {
        (self.first_b[episode] + step) * members
    }
}

impl ReturnScale {
    /// The averages, to be stored.
    #[must_use]
    pub const fn averages(&self) -> [f32; 3] {
        self.averages
    }

    /// From stored averages.
    #[must_use]
    pub const fn from_averages(averages: [f32; 3]) -> Self {
        Self { averages }
    }

    /// Mean and standard deviation of the returns so far; 0 and 1 before there were any.
    #[must_use]
    pub fn mean_and_deviation(&self) -> [f32; 2] {
        let [sum, squares, weight] = self.averages;
        if weight <= 0.0 {
            return [0.0, 1.0];
        }
        let mean = sum / weight;
        let variance = squares / weight - mean * mean;
        [mean, Real::max(variance, LEAST_VARIANCE).sqrt()]
    }

    fn note(&mut self, [count, sum, squares]: [f64; 3]) {
        let latest = [sum / count, squares / count, 1.0];
        for (average, latest) in self.averages.iter_mut().zip(latest) {
            let latest: f32 = Real::from_f64(latest);
            *average = SMOOTHING * *average + (1.0 - SMOOTHING) * latest;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_batches_of_returns_count_alike() {
        let mut scale = ReturnScale::default();
        assert_eq!(scale.mean_and_deviation(), [0.0, 1.0]);
        // Of 1 and 3, then of 5, 5: means 2 and 5, mean squares 5 and 25.
        scale.note([2.0, 4.0, 10.0]);
        let [mean, deviation] = scale.mean_and_deviation();
        assert!((mean - 2.0).abs() < 1e-3 && (deviation - 1.0).abs() < 1e-3);
        scale.note([2.0, 10.0, 50.0]);
        let [mean, deviation] = scale.mean_and_deviation();
        let expected = (15.0_f32 - 3.5 * 3.5).sqrt();
        assert!((mean - 3.5).abs() < 1e-3 && (deviation - expected).abs() < 1e-3);
    }
}
