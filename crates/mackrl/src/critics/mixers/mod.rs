//! Mixers: from what each member of a team expects of its own choice to what the team expects of all of them.
//!
//! A team may learn one value and still let each member choose by its own, as long as the mixed value never falls where a
//! member's rises: the choices that are best for each are then best for the team (Rashid and others, 2018).

mod monotonic;

use std::fmt::Debug;

use mackrl_env::EpisodeKey;

pub use monotonic::{Monotonic, MonotonicSizes, MonotonicTrace, MonotonicWeights};

use crate::{Real, nn::Element};

/// What mixes the values of a team's members, as places in a flat parameter vector.
///
/// # Shapes
/// Over S steps: `value_sn` \[S, N\], `state_sg` \[S, G\], `mixed_so` \[S, outputs\].
pub trait Mixer: Debug + Clone + Send + Sync + 'static {
    /// Its weights as kernels read them.
    type Weights<E: Element>: Debug + Send + Sync;
    /// Its activations for some steps.
    type Trace<E: Element>: Debug + Send;

    /// Values that a step has after mixing: one of the team, or one of each member.
    fn outputs(&self) -> usize;

    /// Draws initial parameters; see [`RecurrentNetwork::initialise`](crate::nn::RecurrentNetwork::initialise).
    fn initialise<R: Real>(&self, key: &EpisodeKey, parameters: &mut [R]);

    /// Prepares the weights.
    fn weights<E: Element>(&self, parameters: &[E]) -> Self::Weights<E>;

    /// Room for activations.
    fn trace<E: Element>(&self) -> Self::Trace<E>;

    /// Mixes the values of some steps: `[state_sg, value_sn]`.
    fn mix<E: Element>(
        &self,
        weights: &Self::Weights<E>,
        states_and_values: [&[E]; 2],
        trace: &mut Self::Trace<E>,
        mixed_so: &mut [E],
    );

    /// Adds the parameters' gradients to the flat `gradient` and writes that of the members' values, from that of what the latest
    /// [`mix`](Self::mix) gave for the same values: `[value_sn, d_mixed_so]`.
    fn backward<E: Element>(
        &self,
        weights: &Self::Weights<E>,
        values_and_slopes: [&[E]; 2],
        trace: &mut Self::Trace<E>,
        d_value_sn: &mut [E],
        gradient: &mut [E],
    );
}
