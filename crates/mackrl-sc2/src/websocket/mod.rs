//! Websockets (RFC 6455), as far as StarCraft II and its clients use them.
//!
//! Both ends are here. Frames are tungstenite's `FrameSocket`. Its `WebSocket` cannot be used: clients of the game send protobuf
//! bytes in frames that are marked as *text*, which it rightly refuses as invalid UTF-8. So messages are put together here
//! ([`Connection`]), and the handshake is ours because tungstenite's drops a request that asks for something else without an
//! answer, where the game's clients wait for one. Every exchange ends by a deadline on a plain blocking socket, messages are
//! bounded in both directions, and nothing that a peer sends makes this code panic.

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
