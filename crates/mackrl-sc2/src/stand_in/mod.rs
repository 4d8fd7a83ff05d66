//! A server that answers the StarCraft II API from MACKRL's simulator, so that unmodified clients take it for the game.
//!
//! [`Arena`] plays a map by orders alone and knows SMAC's map script: when nobody is left, both armies appear again. [`Game`] is
//! the protocol around it, from one request to one response, without any socket; [`StandIn`] is the socket. [`install`] lays out
//! a folder that clients take for an installation of StarCraft II, and [`GameArguments`] are what they start its program with.
//!
//! What a peer sends is bounded and checked; nothing of it makes the server panic.

mod answers;
mod arena;
mod arguments;
pub mod faults;
mod game;
pub mod install;
mod server;

pub(crate) use answers::race;
pub use arena::{Arena, EpisodeRecord};
pub use arguments::{GameArguments, InvalidArgument};
pub use game::{Game, NOT_SERVED, ReplayWriter};
pub use server::{StandIn, StandInOptions};

#[cfg(test)]
mod tests;
