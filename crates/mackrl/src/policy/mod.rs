//! What acting and learning share: the tables of one step's log-probabilities.

mod tables;

pub use tables::{DELEGATE, PolicyShape, PolicyTable};
