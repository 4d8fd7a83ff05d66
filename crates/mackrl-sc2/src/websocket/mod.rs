//! Websockets (RFC 6455), as far as StarCraft II and its clients use them.
//!
//! Both ends are here. Two things made it ours instead of a library's: clients of the game send protobuf bytes in frames that
//! are marked as *text*, which libraries rightly refuse as invalid UTF-8, and every exchange has to end by a deadline on a plain
//! blocking socket. Messages are bounded in both directions, and nothing that a peer sends makes this code panic.

mod connection;
mod frame;
mod handshake;

use std::{io, time::Duration};

use thiserror::Error;

pub use connection::Connection;
pub use frame::MESSAGE_LENGTH_MAX;

/// The only path at which StarCraft II answers.
pub const PATH: &str = "/sc2api";

/// Why a connection cannot be used any more.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WebsocketError {
    /// The peer said nothing for too long.
    #[error("no answer within {:.1} s", .0.as_secs_f64())]
    Late(Duration),
    /// The peer closed the connection.
    #[error("the connection was closed")]
    Closed,
    /// The peer does not speak this protocol.
    #[error("not a websocket: {0}")]
    Protocol(String),
    /// The operating system's word.
    #[error("{0}")]
    InputOutput(#[from] io::Error),
}

impl WebsocketError {
    fn protocol(problem: impl Into<String>) -> Self {
        Self::Protocol(problem.into())
    }
}

#[cfg(test)]
mod tests;
