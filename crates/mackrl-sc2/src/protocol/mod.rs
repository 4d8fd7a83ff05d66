//! The messages of the StarCraft II API that are used here, by their public field numbers.
//!
//! Fields that are not listed are skipped when read, as protobuf has it; SMAC's maps need none of them. Numbers and names are
//! those of Blizzard's published protocol (version 2 of protobuf, hence unpacked repeated numbers).

mod data;
mod requests;
mod responses;
mod units;

pub use data::{ImageData, Point, Point2D, PointI, RectangleI, Size2DI};
pub use requests::{
    Action, ActionChat, ActionRaw, CreateGame, DebugCommand, DebugKillUnit, InterfaceOptions,
    JoinGame, LocalMap, PlayerSetup, Request, RequestAction, RequestData, RequestDebug,
    RequestGameInfo, RequestObservation, RequestPing, RequestQuit, RequestSaveReplay, RequestStep,
    UnitCommand, Unread, debug_command, request, unit_command,
};
pub use responses::{
    Observation, ObservationRaw, PlayerCommon, PlayerInfo, Response, ResponseAction,
    ResponseCreateGame, ResponseData, ResponseDebug, ResponseGameInfo, ResponseJoinGame,
    ResponseObservation, ResponsePing, ResponseQuit, ResponseSaveReplay, ResponseStep, StartRaw,
    UnitTypeData, response,
};
pub use units::Unit;

/// How far a game program is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum Status {
    /// It runs; there is no game.
    Launched = 1,
    /// A game is made; nobody has joined.
    InitGame = 2,
    /// A game is played.
    InGame = 3,
    /// A replay is shown.
    InReplay = 4,
    /// The game is over.
    Ended = 5,
    /// It is about to end.
    Quit = 6,
    /// Something else.
    Unknown = 99,
}

/// Who a player is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum PlayerType {
    /// A client of the API.
    Participant = 1,
    /// The game itself.
    Computer = 2,
    /// Somebody who watches.
    Observer = 3,
}

/// The peoples, by the game's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum Race {
    /// None.
    NoRace = 0,
    /// Terrans.
    Terran = 1,
    /// Zerg.
    Zerg = 2,
    /// Protoss.
    Protoss = 3,
    /// Any.
    Random = 4,
}

/// `VeryHard`, the level at which SMAC's maps are played: without a bot's own tactics it makes little difference.
pub const DIFFICULTY_VERY_HARD: i32 = 7;
/// The player whose units the agents are.
pub const OWNER_ALLY: i32 = 1;
/// The player whose units the enemies are.
pub const OWNER_ENEMY: i32 = 2;

/// The commands that SMAC gives, by the game's numbers of abilities.
pub mod ability {
    /// Stand still.
    pub const STOP: i32 = 4;
    /// Walk to a point.
    pub const MOVE: i32 = 16;
    /// Attack a unit.
    pub const ATTACK: i32 = 23;
    /// Heal a unit.
    pub const HEAL: i32 = 386;
}
