//! What a client may ask.

use super::Point2D;

/// One question, and its number.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Request {
    /// The question.
    #[prost(
        oneof = "request::Kind",
        tags = "1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22"
    )]
    pub kind: Option<request::Kind>,
    /// Comes back in the answer.
    #[prost(uint32, optional, tag = "97")]
    pub id: Option<u32>,
}

/// Parts of [`Request`].
pub mod request {
    use super::{
        CreateGame, JoinGame, RequestAction, RequestData, RequestDebug, RequestGameInfo,
        RequestObservation, RequestPing, RequestQuit, RequestSaveReplay, RequestStep, Unread,
    };

    /// The questions.
    #[derive(Clone, PartialEq, prost::Oneof)]
    pub enum Kind {
        /// Make a game.
        #[prost(message, tag = "1")]
        CreateGame(CreateGame),
        /// Take part in it.
        #[prost(message, tag = "2")]
        JoinGame(JoinGame),
        /// End the program.
        #[prost(message, tag = "8")]
        Quit(RequestQuit),
        /// What does not change in a game.
        #[prost(message, tag = "9")]
        GameInfo(RequestGameInfo),
        /// How the game stands.
        #[prost(message, tag = "10")]
        Observation(RequestObservation),
        /// Give orders.
        #[prost(message, tag = "11")]
        Action(RequestAction),
        /// Let time pass.
        #[prost(message, tag = "12")]
        Step(RequestStep),
        /// Statistics of the game.
        #[prost(message, tag = "13")]
        Data(RequestData),
        /// The game so far as a file.
        #[prost(message, tag = "15")]
        SaveReplay(RequestSaveReplay),
        /// Which version this is.
        #[prost(message, tag = "19")]
        Ping(RequestPing),
        /// Change the game.
        #[prost(message, tag = "20")]
        Debug(RequestDebug),
        /// Begin the game again.
        #[prost(message, tag = "3")]
        RestartGame(Unread),
        /// Show a replay.
        #[prost(message, tag = "4")]
        StartReplay(Unread),
        /// Leave the game.
        #[prost(message, tag = "5")]
        LeaveGame(Unread),
        /// Keep the state of the game.
        #[prost(message, tag = "6")]
        QuickSave(Unread),
        /// Go back to the state that was kept.
        #[prost(message, tag = "7")]
        QuickLoad(Unread),
        /// Paths, abilities and places for buildings.
        #[prost(message, tag = "14")]
        Query(Unread),
        /// What a replay file holds.
        #[prost(message, tag = "16")]
        ReplayInfo(Unread),
        /// Which maps there are.
        #[prost(message, tag = "17")]
        AvailableMaps(Unread),
        /// Keep a map file.
        #[prost(message, tag = "18")]
        SaveMap(Unread),
        /// Move the camera of an observer.
        #[prost(message, tag = "21")]
        ObserverAction(Unread),
        /// Start a trigger of the map.
        #[prost(message, tag = "22")]
        MapCommand(Unread),
    }

    impl Kind {
        /// What the question is called in the protocol.
        #[must_use]
        pub const fn name(&self) -> &'static str {
            match self {
                Self::CreateGame(_) => "create_game",
                Self::JoinGame(_) => "join_game",
                Self::Quit(_) => "quit",
                Self::GameInfo(_) => "game_info",
                Self::Observation(_) => "observation",
                Self::Action(_) => "action",
                Self::Step(_) => "step",
                Self::Data(_) => "data",
                Self::SaveReplay(_) => "save_replay",
                Self::Ping(_) => "ping",
                Self::Debug(_) => "debug",
                Self::RestartGame(_) => "restart_game",
                Self::StartReplay(_) => "start_replay",
                Self::LeaveGame(_) => "leave_game",
                Self::QuickSave(_) => "quick_save",
                Self::QuickLoad(_) => "quick_load",
                Self::Query(_) => "query",
                Self::ReplayInfo(_) => "replay_info",
                Self::AvailableMaps(_) => "available_maps",
                Self::SaveMap(_) => "save_map",
                Self::ObserverAction(_) => "obs_action",
                Self::MapCommand(_) => "map_command",
            }
        }
    }
}

/// A message that may be there, whose content is not read.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct Unread {}

/// Asks for a game.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct CreateGame {
    /// The map.
    #[prost(message, optional, tag = "1")]
    pub local_map: Option<LocalMap>,
    /// Everybody.
    #[prost(message, repeated, tag = "3")]
    pub player_setup: Vec<PlayerSetup>,
    /// Seed of the game's dice; its own choice if absent.
    #[prost(uint32, optional, tag = "5")]
    pub random_seed: Option<u32>,
    /// Whether time passes by itself.
    #[prost(bool, optional, tag = "6")]
    pub realtime: Option<bool>,
}

/// A map file.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct LocalMap {
    /// Its path below the folder of maps.
    #[prost(string, optional, tag = "1")]
    pub map_path: Option<String>,
    /// Its content.
    #[prost(bytes = "vec", optional, tag = "7")]
    pub map_data: Option<Vec<u8>>,
}

/// One player of a game.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct PlayerSetup {
    /// Who it is.
    #[prost(enumeration = "super::PlayerType", optional, tag = "1")]
    pub r#type: Option<i32>,
    /// Its people.
    #[prost(enumeration = "super::Race", optional, tag = "2")]
    pub race: Option<i32>,
    /// How well the computer plays.
    #[prost(int32, optional, tag = "3")]
    pub difficulty: Option<i32>,
}

/// Asks to take part.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct JoinGame {
    /// With which people.
    #[prost(enumeration = "super::Race", optional, tag = "1")]
    pub race: Option<i32>,
    /// What to be shown.
    #[prost(message, optional, tag = "3")]
    pub options: Option<InterfaceOptions>,
}

/// What observations hold.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct InterfaceOptions {
    /// Units.
    #[prost(bool, optional, tag = "1")]
    pub raw: Option<bool>,
    /// The score.
    #[prost(bool, optional, tag = "2")]
    pub score: Option<bool>,
    /// Layers of features, as images.
    #[prost(message, optional, tag = "3")]
    pub feature_layer: Option<Unread>,
    /// Rendered images.
    #[prost(message, optional, tag = "4")]
    pub render: Option<Unread>,
}

/// Asks for what does not change.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct RequestGameInfo {}

/// Asks how the game stands.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct RequestObservation {
    /// Whether to show what fog hides.
    #[prost(bool, optional, tag = "1")]
    pub disable_fog: Option<bool>,
    /// Wait for this loop, in games that pass by themselves.
    #[prost(uint32, optional, tag = "2")]
    pub game_loop: Option<u32>,
}

/// Gives orders.
#[derive(Clone, PartialEq, prost::Message)]
pub struct RequestAction {
    /// One after the other.
    #[prost(message, repeated, tag = "1")]
    pub actions: Vec<Action>,
}

/// One order, or a line of chat.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Action {
    /// An order.
    #[prost(message, optional, tag = "1")]
    pub action_raw: Option<ActionRaw>,
    /// A line of chat.
    #[prost(message, optional, tag = "6")]
    pub action_chat: Option<ActionChat>,
}

/// An order, without a camera.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ActionRaw {
    /// To units.
    #[prost(message, optional, tag = "1")]
    pub unit_command: Option<UnitCommand>,
}

/// An order to units.
#[derive(Clone, PartialEq, prost::Message)]
pub struct UnitCommand {
    /// What to do, one of [`super::ability`].
    #[prost(int32, optional, tag = "1")]
    pub ability_id: Option<i32>,
    /// To whom or where.
    #[prost(oneof = "unit_command::Target", tags = "2, 3")]
    pub target: Option<unit_command::Target>,
    /// Who is to do it.
    #[prost(uint64, repeated, packed = "false", tag = "4")]
    pub unit_tags: Vec<u64>,
    /// Whether to finish first what is being done.
    #[prost(bool, optional, tag = "5")]
    pub queue_command: Option<bool>,
}

/// Parts of [`UnitCommand`].
pub mod unit_command {
    use super::Point2D;

    /// To whom or where.
    #[derive(Clone, Copy, PartialEq, prost::Oneof)]
    pub enum Target {
        /// A place.
        #[prost(message, tag = "2")]
        WorldSpacePos(Point2D),
        /// A unit.
        #[prost(uint64, tag = "3")]
        UnitTag(u64),
    }
}

/// A line of chat.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct ActionChat {
    /// 1: to everybody; 2: to the team.
    #[prost(int32, optional, tag = "1")]
    pub channel: Option<i32>,
    /// What is said.
    #[prost(string, optional, tag = "2")]
    pub message: Option<String>,
}

/// Lets time pass.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct RequestStep {
    /// Loops; 1 if absent.
    #[prost(uint32, optional, tag = "1")]
    pub count: Option<u32>,
}

/// Asks for statistics.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct RequestData {
    /// Of unit types.
    #[prost(bool, optional, tag = "2")]
    pub unit_type_id: Option<bool>,
}

/// Asks for a replay.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct RequestSaveReplay {}

/// Asks for the version.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct RequestPing {}

/// Ends the program.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct RequestQuit {}

/// Changes the game.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct RequestDebug {
    /// One after the other.
    #[prost(message, repeated, tag = "1")]
    pub debug: Vec<DebugCommand>,
}

/// One change.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct DebugCommand {
    /// The change.
    #[prost(oneof = "debug_command::Kind", tags = "4")]
    pub kind: Option<debug_command::Kind>,
}

/// Parts of [`DebugCommand`].
pub mod debug_command {
    use super::DebugKillUnit;

    /// Changes.
    #[derive(Clone, PartialEq, Eq, prost::Oneof)]
    pub enum Kind {
        /// Kill units.
        #[prost(message, tag = "4")]
        KillUnit(DebugKillUnit),
    }
}

/// Kills units.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct DebugKillUnit {
    /// Which.
    #[prost(uint64, repeated, packed = "false", tag = "1")]
    pub tag: Vec<u64>,
}
