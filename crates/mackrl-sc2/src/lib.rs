//! The StarCraft II client API, spoken from both ends.
//!
//! StarCraft II is controlled by protobuf messages over a websocket on the machine that it runs on. This crate speaks that
//! protocol as a *client*, so that [`adapter`] makes the real game an [`mackrl_env::Environment`], and as a *server*, so that
//! [`stand_in`] answers SMAC's own unmodified client from MACKRL's simulator. Each end is the other's test.
//!
//! The messages ([`protocol`]) are structs that derive their encoding from the public field numbers: a build that needs no
//! protobuf compiler, and only what is used. The websocket ([`websocket`]) puts messages together itself, because the game's
//! clients send raw bytes in frames marked as text, which libraries refuse as invalid UTF-8. Everything here is synchronous: one
//! game, one socket, one request at a time. What fails is never data: see [`adapter`].
//!
//! This was developed against the stand-in; the real game was not available. `DEVIATIONS.md` says what only the real game can
//! settle.

pub mod adapter;
pub mod episode_name;
pub mod lifetime;
pub mod protocol;
pub mod stand_in;
pub mod units;
pub mod websocket;

#[cfg(test)]
mod recorded_client;
