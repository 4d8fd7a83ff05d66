//! What can go wrong in this library.

use thiserror::Error;

/// An error of this library.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting is unknown, out of range or impossible beside another.
    #[error("{0}")]
    Config(String),
    /// Stored data cannot be used: a damaged checkpoint, a wrong shape.
    #[error("{0}")]
    Data(String),
    /// A number that is not finite turned up.
    #[error("{tensor} holds {value} at update {update}")]
    NotFinite {
        /// The tensor in which it was found.
        tensor: String,
        /// The number.
        value: f64,
        /// The update in which it was found.
        update: u64,
    },
    /// Somebody asked to stop; what was begun was given up, and nothing has changed.
    #[error("stopped as asked")]
    Stopped,
    /// An environment refused an action.
    #[error(transparent)]
    IllegalAction(#[from] mackrl_env::IllegalAction),
}
