//! V(s) to be asked, without what teaches it.

use crate::nn::{FeedForward, FeedForwardTrace, FeedForwardWeights, NetworkSizes, ParameterLayout};

/// The network of [`CentralCritic`](super::CentralCritic) alone.
#[derive(Debug)]
pub struct ValueFunction {
    layout: ParameterLayout,
    network: FeedForward,
    weights: FeedForwardWeights<f32>,
    trace: FeedForwardTrace<f32>,
}

impl ValueFunction {
    /// The function for states of `state_size` numbers, 0 everywhere until it has parameters.
    #[must_use]
    pub fn new(state_size: usize, hidden: usize) -> Self {
        let sizes = NetworkSizes {
            inputs: state_size,
            hidden,
            outputs: 1,
        };
        let mut layout = ParameterLayout::new();
        let network = FeedForward::new(&mut layout, super::CRITIC, sizes);
        Self {
            weights: network.weights(&vec![0.0; layout.len()]),
            trace: FeedForwardTrace::new(sizes),
            layout,
            network,
        }
    }

    /// Names and shapes of the parameters.
    #[must_use]
    pub const fn layout(&self) -> &ParameterLayout {
        &self.layout
    }

    /// Takes other parameters.
    ///
    /// # Panics
    /// If there are not as many as the layout says.
    pub fn load(&mut self, parameters: &[f32]) {
        self.network.refresh(parameters, &mut self.weights);
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
}
