//! The training loop: episodes, what learns from them, tests and metrics.
//!
//! This is the one place where a configuration becomes objects and where worlds, policies and learners meet. A run is a
//! function of its configuration alone: the number of threads changes no result, and only metrics under `sys/` depend on the
//! machine and the clock.

pub mod assembly;
mod checkpoint;
mod comparison;
mod description;
mod evaluation;
mod experience;
mod interval;
mod metrics;
mod teams;
mod trainer;
mod weights;

pub use checkpoint::Checkpoint;
pub use comparison::{Difference, compare_tensors};
pub use description::trained_steps_env;
pub use evaluation::{
    EpisodeResult, Episodes, Evaluation, Quantity, evaluate, evaluate_each, evaluate_in,
};
pub use metrics::{METRICS, MetricRow, explained, headline, is_explained, of_statistics};
pub use teams::{Score, Teams};
pub use trainer::Trainer;
pub use weights::{StoredWeights, read_weights, write_weights};
