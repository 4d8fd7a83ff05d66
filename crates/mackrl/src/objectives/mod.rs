//! Objectives: pure functions on arrays.
//!
//! An objective takes log p(u) of the joint actions under the present parameters, what it needs beside it (advantages, weights
//! of steps, the log p(u) of the policy that acted), and gives its value and ∂ objective / ∂ log p(u). It sees no network, no
//! hierarchy and no environment: [`Hierarchy::backward`](crate::hierarchy::Hierarchy::backward) takes what it gives down to the
//! parameters, in one place, for every objective alike.

mod average;
mod clipped_surrogate;
mod entropy_regularised;
mod policy_gradient;
mod returns;
mod temporal_difference;
mod value_loss;

pub use average::LossAverage;
pub use clipped_surrogate::{Surrogate, clipped_surrogate};
pub use entropy_regularised::entropy_regularised;
pub use policy_gradient::policy_gradient;
pub use returns::{ReturnSettings, generalised_advantages, lambda_returns};
pub use temporal_difference::{ValueErrors, squared_errors};
pub use value_loss::ValueLoss;
