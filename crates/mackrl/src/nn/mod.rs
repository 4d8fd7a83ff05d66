//! The numerical core: small recurrent networks with explicit backward passes, on one thread, without allocation.
//!
//! The controllers of the paper are tiny (64 units over 6 to 800 rows), so what a framework spends around its kernels costs
//! more than the kernels. Here a network is a handful of ranges in one flat parameter vector ([`ParameterLayout`]); its
//! activations live in a [`Trace`] that the caller owns, that acting fills one step at a time and that
//! [`RecurrentNetwork::backward`] reads: acting and learning share one forward pass.
//!
//! No crate of matrix products would do, because of the contract of decentralised execution. An agent that evaluates one row
//! must get the bits that the central run got for that row in a batch of eighty. So **every forward result of a row depends on
//! that row and the parameters alone**, whatever the number of rows, the row's place among them and the width of the machine's
//! vectors: an output is `acc = bias; for k ascending: acc = fma(x[k], w[k][j], acc)`, the exponential, hyperbolic tangent,
//! sigmoid and logarithm are our own sequences of fused operations, the same on every width, and a sum over columns has a fixed
//! number of partial sums. Sums over *rows* occur in gradients only.
//!
//! The code is written once over [`Real`](crate::Real): `f32` runs on SIMD instructions chosen at run time
//! ([`InstructionSet`]: AVX-512, AVX2, NEON, or none), `f64` runs the same kernels one number at a time, for the tests against finite differences.

mod aligned;
pub mod benchmark;
pub(crate) mod elementary;
mod elementwise;
mod feed_forward;
mod finite;
mod gates;
mod gru;
mod instructions;
mod lanes;
mod layer_norm;
mod linear;
mod optimiser;
mod parameters;
mod product;
mod recurrent;
mod softmax;
mod step;
#[cfg(test)]
mod tests;
mod trace;
mod update_length;
mod values;
mod weight_gradient;

pub(crate) use elementary::logarithms;
pub(crate) use elementwise::{absolute, absolute_gradient, elu, elu_gradient};
pub use feed_forward::{FeedForward, FeedForwardTrace, FeedForwardWeights};
pub use finite::first_not_finite;
pub use gru::Gru;
pub use instructions::{InstructionSet, UnknownInstructionSet};
pub use lanes::Element;
pub(crate) use layer_norm::normalise_rows;
pub use linear::Linear;
pub use optimiser::{BrokenStep, Moments, Optimiser, OptimiserKind, Stepped, clip_gradient_norm};
pub use parameters::{ParameterLayout, TensorSpec};
pub use recurrent::{NetworkSizes, RecurrentNetwork, RecurrentWeights};
pub use softmax::MaskedLogSoftmax;
pub(crate) use step::finite_step;
pub use trace::{BEGINS, Retention, Trace};
pub use update_length::update_length;
pub use values::{ValueNetwork, ValueSizes, ValueTrace, ValueWeights};
