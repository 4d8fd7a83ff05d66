//! The central critic.

mod learning;

use mackrl_env::{EpisodeKey, declare_words};

pub use learning::CriticReport;

use crate::{
    nn::{
        FeedForward, FeedForwardTrace, FeedForwardWeights, Moments, NetworkSizes, Optimiser,
        OptimiserKind, ParameterLayout,
    },
    objectives::ReturnSettings,
};

declare_words! {
    /// The states on which the critic takes one optimiser step.
    pub enum CriticMinibatch {
        /// Those of one time, from the last time of the batch to the first, as the authors' code runs.
        #[default]
        Time = "time",
        /// All states of the batch.
        Batch = "batch",
    }
}

/// How the critic learns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CriticSettings {
    /// H: width of the hidden layer, at least 1.
    pub hidden: usize,
    /// How parameters follow the gradient.
    pub optimiser: OptimiserKind,
    /// Step size, > 0.
    pub learning_rate: f64,
    /// Largest norm of a gradient, > 0; longer ones are scaled down.
    pub gradient_norm_max: f64,
    /// γ and λ of the returns.
    pub returns: ReturnSettings,
    /// The states of one optimiser step.
    pub minibatch: CriticMinibatch,
    /// Times that a batch is learnt from, at least 1.
    pub sweeps: u64,
    /// λ of the advantages.
    pub advantage_lambda: f64,
    /// Critic updates after which the target copy is refreshed.
    pub target_interval_updates: u64,
    /// Whether the state at which time ran out has a value; otherwise a time limit counts as the end of the game.
    pub bootstrap_at_time_limit: bool,
}

/// All that a critic has learnt: with its settings, everything that its future depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct CriticState {
    /// The parameters.
    pub parameters: Vec<f32>,
    /// Those of the target copy.
    pub target_parameters: Vec<f32>,
    /// What the optimiser remembers.
    pub moments: Moments<f32>,
    /// Updates so far.
    pub updates: u64,
    /// Updates when the target copy was refreshed.
    pub updates_at_refresh: u64,
}

/// V(s), a feed-forward network, with a target copy.
#[derive(Debug)]
pub struct CentralCritic {
    settings: CriticSettings,
    layout: ParameterLayout,
    network: FeedForward,
    parameters: Vec<f32>,
    weights: FeedForwardWeights<f32>,
    target_parameters: Vec<f32>,
    target_weights: FeedForwardWeights<f32>,
    optimiser: Optimiser<f32>,
    gradient: Vec<f32>,
    trace: FeedForwardTrace<f32>,
    updates: u64,
    updates_at_refresh: u64,
}

impl CentralCritic {
    /// A critic for states of `state_size` numbers; initial parameters are drawn from `key`.
    #[must_use]
    pub fn new(state_size: usize, settings: CriticSettings, key: &EpisodeKey) -> Self {
        let sizes = NetworkSizes {
            inputs: state_size,
            hidden: settings.hidden,
            outputs: 1,
        };
        let mut layout = ParameterLayout::new();
        let network = FeedForward::new(&mut layout, super::CRITIC, sizes);
        let mut parameters = vec![0.0; layout.len()];
        network.initialise(key, &mut parameters);
        let optimiser = Optimiser::new(settings.optimiser, parameters.len());
        Self {
            settings,
            weights: network.weights(&parameters),
            target_parameters: parameters.clone(),
            target_weights: network.weights(&parameters),
            optimiser,
            gradient: vec![0.0; parameters.len()],
            trace: FeedForwardTrace::new(sizes),
            layout,
            network,
            parameters,
            updates: 0,
            updates_at_refresh: 0,
        }
    }

    /// How many parameters a critic for states of `state_size` numbers has.
    #[must_use]
    pub fn size(state_size: usize, hidden: usize) -> usize {
        let sizes = NetworkSizes {
            inputs: state_size,
            hidden,
            outputs: 1,
        };
        let mut layout = ParameterLayout::new();
        FeedForward::new(&mut layout, super::CRITIC, sizes);
        layout.len()
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

    /// Takes other parameters, to be asked for values.
    ///
    /// # Panics
    /// If there are not as many as the layout says.
    pub fn load(&mut self, parameters: &[f32]) {
        self.network.refresh(parameters, &mut self.weights);
        self.parameters.copy_from_slice(parameters);
    }

    /// V(s) of the state \[G\].
    ///
    /// # Panics
    /// If the state has another size.
    pub fn value(&mut self, state_g: &[f32]) -> f32 {
        self.trace.begin(1).copy_from_slice(state_g);
        self.network.forward(&self.weights, &mut self.trace);
        self.trace.outputs()[0]
    }

    /// What a checkpoint must hold.
    #[must_use]
    pub fn state(&self) -> CriticState {
        CriticState {
            parameters: self.parameters.clone(),
            target_parameters: self.target_parameters.clone(),
            moments: self.optimiser.moments().clone(),
            updates: self.updates,
            updates_at_refresh: self.updates_at_refresh,
        }
    }

    /// Continues from a checkpoint.
    ///
    /// # Panics
    /// If the state is that of a critic of another size or optimiser.
    pub fn restore(&mut self, state: CriticState) {
        self.network.refresh(&state.parameters, &mut self.weights);
        self.network
            .refresh(&state.target_parameters, &mut self.target_weights);
        self.optimiser.restore(state.moments);
        self.parameters = state.parameters;
        self.target_parameters = state.target_parameters;
        self.updates = state.updates;
        self.updates_at_refresh = state.updates_at_refresh;
    }
}

#[cfg(test)]
mod tests;
