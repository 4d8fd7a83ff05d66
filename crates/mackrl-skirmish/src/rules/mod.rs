//! The rules of battle. They know nothing of agents, rewards or observations.
//!
//! A [`Battle`] is a [`BattleState`] (plain data: copy it, compare it, hash it) on a [`Battlefield`] (what never changes: the
//! terrain and the unit types). It advances by game loops of 1/16 s. In a loop everybody decides and acts on the state at its
//! beginning, then everybody moves, then all damage lands at once: neither side gains by the order in which units are visited.
//!
//! Times are fractions of loops and are kept exactly: a marine with a period of 13.77 loops shoots after 14 loops three times
//! out of four and after 13 the fourth time (before jitter). Positions are multiples
//! of 2⁻¹² map units, as the engine's are, so that differences of them are exact.

mod battle;
mod chance;
mod combat;
mod healing;
mod movement;
mod neighbours;
mod obstacles;
mod opponent;
mod placement;
mod profile;
mod state;

pub use battle::Battle;
pub use chance::Chance;
pub use placement::{Taken, spread_around};
pub use profile::{Battlefield, Care, Profile, Strike, Sweep};
pub use state::{BattleState, Blow, Missile, Order, Stance, Team, Unit, UnitIndex};

#[cfg(test)]
mod tests;
