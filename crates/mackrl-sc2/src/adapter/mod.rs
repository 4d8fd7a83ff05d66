//! The real game as an environment.
//!
//! [`StarCraft2`] plays episodes as SMAC does: one process a game, kept over many episodes; a new episode begins by killing
//! everybody, whereupon the map's script brings both armies back. What agents see and are paid is computed by the same
//! [`mackrl_skirmish::Face`] as in the built-in simulator, from the units that the game reports.
//!
//! **Faults never become data.** Every request has a deadline, and every answer is checked: its number, its status, who is on
//! the field and whether they can be as they are said to be. Whatever fails (a crash, a hang, nonsense, a refusal) makes the episode
//! void: the process is killed, [`mackrl_env::Interruption`] tells whoever plays, and the episode is played again from its
//! beginning in a new process, as long as the budget lasts. Counters tell how often.
//!
//! **No process is left behind.** A game is started through this program itself ([`process`]), which asks the kernel to kill it
//! when we die, by whatever signal, and becomes the game.

mod client;
mod environment;
mod fault;
mod game;
mod installation;
mod launch;
mod pool;
pub mod process;
pub(crate) mod roster;

pub use environment::{StarCraft2, Watcher};
pub use fault::{FaultKind, GameFault};
pub use game::Game;
pub use installation::{Installation, InstallationProblem};
pub use pool::{FaultCounts, GamePool, GameSettings};
