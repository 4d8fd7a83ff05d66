//! Tests of the numerical core as a whole.

mod contract;
mod golden;
mod gradients;

use mackrl_env::{Draw, EpisodeKey, Stream};

use crate::{
    Real,
    nn::{Element, NetworkSizes, ParameterLayout, RecurrentNetwork, RecurrentWeights},
};

/// Sizes that are different primes.
const SIZES: NetworkSizes = NetworkSizes {
    inputs: 11,
    hidden: 7,
    outputs: 19,
};

/// Made-up numbers in ±1, different for every `seed`.
fn numbers<R: Real>(count: usize, seed: usize) -> Vec<R> {
    let key = EpisodeKey::new(5, Stream::Other, 0);
    let number = |index| R::from_f64(2.0 * key.uniform(seed, Draw::World(index)) - 1.0);
    (0..count).map(number).collect()
}

/// A network with made-up parameters.
fn network<E: Element>(sizes: NetworkSizes) -> (RecurrentNetwork, Vec<E>, RecurrentWeights<E>) {
    let mut layout = ParameterLayout::new();
    let network = RecurrentNetwork::new(&mut layout, "controller", sizes);
    let mut parameters = vec![E::ZERO; layout.len()];
    network.initialise(&EpisodeKey::new(3, Stream::Other, 0), &mut parameters);
    let weights = network.weights(&parameters);
    (network, parameters, weights)
}
