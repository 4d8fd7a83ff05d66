//! What a game answers.

use super::{ImageData, InterfaceOptions, RectangleI, Size2DI, Unit};

/// One answer.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Response {
    /// The answer; absent if the question could not be answered.
    #[prost(
        oneof = "response::Kind",
        tags = "1, 2, 8, 9, 10, 11, 12, 13, 15, 19, 20"
    )]
    pub kind: Option<response::Kind>,
    /// The question's number.
    #[prost(uint32, optional, tag = "97")]
    pub id: Option<u32>,
    /// What was wrong with the question.
    #[prost(string, repeated, tag = "98")]
    pub error: Vec<String>,
    /// How far the program is now.
    #[prost(enumeration = "super::Status", optional, tag = "99")]
    pub status: Option<i32>,
}

/// Parts of [`Response`].
pub mod response {
    use super::{
        ResponseAction, ResponseCreateGame, ResponseData, ResponseDebug, ResponseGameInfo,
        ResponseJoinGame, ResponseObservation, ResponsePing, ResponseQuit, ResponseSaveReplay,
        ResponseStep,
    };

    /// The answers.
    #[derive(Clone, PartialEq, prost::Oneof)]
    pub enum Kind {
        /// A game is made, or not.
        #[prost(message, tag = "1")]
        CreateGame(ResponseCreateGame),
        /// The client takes part, or not.
        #[prost(message, tag = "2")]
        JoinGame(ResponseJoinGame),
        /// The program ends.
        #[prost(message, tag = "8")]
        Quit(ResponseQuit),
        /// What does not change.
        #[prost(message, tag = "9")]
        GameInfo(ResponseGameInfo),
        /// How the game stands.
        #[prost(message, tag = "10")]
        Observation(ResponseObservation),
        /// The orders are given.
        #[prost(message, tag = "11")]
        Action(ResponseAction),
        /// Time has passed.
        #[prost(message, tag = "12")]
        Step(ResponseStep),
        /// Statistics.
        #[prost(message, tag = "13")]
        Data(ResponseData),
        /// The game as a file.
        #[prost(message, tag = "15")]
        SaveReplay(ResponseSaveReplay),
        /// The version.
        #[prost(message, tag = "19")]
        Ping(ResponsePing),
        /// The game is changed.
        #[prost(message, tag = "20")]
        Debug(ResponseDebug),
    }
}

/// Whether a game was made.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct ResponseCreateGame {
    /// Why not.
    #[prost(int32, optional, tag = "1")]
    pub error: Option<i32>,
    /// Why not, in words.
    #[prost(string, optional, tag = "2")]
    pub error_details: Option<String>,
}

/// Whether the client takes part.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct ResponseJoinGame {
    /// As which player.
    #[prost(uint32, optional, tag = "1")]
    pub player_id: Option<u32>,
    /// Why not.
    #[prost(int32, optional, tag = "2")]
    pub error: Option<i32>,
    /// Why not, in words.
    #[prost(string, optional, tag = "3")]
    pub error_details: Option<String>,
}

/// What does not change in a game.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct ResponseGameInfo {
    /// The map's name.
    #[prost(string, optional, tag = "1")]
    pub map_name: Option<String>,
    /// The map's path.
    #[prost(string, optional, tag = "2")]
    pub local_map_path: Option<String>,
    /// Everybody.
    #[prost(message, repeated, tag = "3")]
    pub player_info: Vec<PlayerInfo>,
    /// The ground.
    #[prost(message, optional, tag = "4")]
    pub start_raw: Option<StartRaw>,
    /// What observations hold.
    #[prost(message, optional, tag = "5")]
    pub options: Option<InterfaceOptions>,
}

/// One player.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct PlayerInfo {
    /// Its number.
    #[prost(uint32, optional, tag = "1")]
    pub player_id: Option<u32>,
    /// Who it is.
    #[prost(enumeration = "super::PlayerType", optional, tag = "2")]
    pub r#type: Option<i32>,
    /// The people that it asked for.
    #[prost(enumeration = "super::Race", optional, tag = "3")]
    pub race_requested: Option<i32>,
    /// How well it plays, if the game itself plays it.
    #[prost(int32, optional, tag = "5")]
    pub difficulty: Option<i32>,
}

/// The ground.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct StartRaw {
    /// Cells.
    #[prost(message, optional, tag = "1")]
    pub map_size: Option<Size2DI>,
    /// Where one can walk.
    #[prost(message, optional, tag = "2")]
    pub pathing_grid: Option<ImageData>,
    /// How high it is.
    #[prost(message, optional, tag = "3")]
    pub terrain_height: Option<ImageData>,
    /// The part of the map that is used.
    #[prost(message, optional, tag = "5")]
    pub playable_area: Option<RectangleI>,
}

/// How the game stands.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ResponseObservation {
    /// What is to be seen.
    #[prost(message, optional, tag = "3")]
    pub observation: Option<Observation>,
}

/// What is to be seen.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Observation {
    /// Who looks.
    #[prost(message, optional, tag = "1")]
    pub player_common: Option<PlayerCommon>,
    /// Units.
    #[prost(message, optional, tag = "5")]
    pub raw_data: Option<ObservationRaw>,
    /// Loops since the game began.
    #[prost(uint32, optional, tag = "9")]
    pub game_loop: Option<u32>,
}

/// The player who looks.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct PlayerCommon {
    /// Its number.
    #[prost(uint32, optional, tag = "1")]
    pub player_id: Option<u32>,
}

/// Units.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ObservationRaw {
    /// Those that live.
    #[prost(message, repeated, tag = "2")]
    pub units: Vec<Unit>,
}

/// What came of each order.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct ResponseAction {
    /// 1: success; others by the game's numbers.
    #[prost(int32, repeated, packed = "false", tag = "1")]
    pub result: Vec<i32>,
}

/// Time has passed.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct ResponseStep {
    /// The loop that has been reached.
    #[prost(uint32, optional, tag = "1")]
    pub simulation_loop: Option<u32>,
}

/// Statistics.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ResponseData {
    /// Of unit types, by their numbers.
    #[prost(message, repeated, tag = "2")]
    pub units: Vec<UnitTypeData>,
}

/// One unit type.
#[derive(Clone, PartialEq, prost::Message)]
pub struct UnitTypeData {
    /// Its number.
    #[prost(uint32, optional, tag = "1")]
    pub unit_id: Option<u32>,
    /// Its name.
    #[prost(string, optional, tag = "2")]
    pub name: Option<String>,
    /// Map units that it goes in a second.
    #[prost(float, optional, tag = "9")]
    pub movement_speed: Option<f32>,
}

/// The game as a file.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct ResponseSaveReplay {
    /// Its content.
    #[prost(bytes = "vec", optional, tag = "1")]
    pub data: Option<Vec<u8>>,
}

/// The version.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct ResponsePing {
    /// As people write it.
    #[prost(string, optional, tag = "1")]
    pub game_version: Option<String>,
    /// A hash of the game's data.
    #[prost(string, optional, tag = "2")]
    pub data_version: Option<String>,
    /// Number of the data.
    #[prost(uint32, optional, tag = "3")]
    pub data_build: Option<u32>,
    /// Number of the program.
    #[prost(uint32, optional, tag = "4")]
    pub base_build: Option<u32>,
}

/// The game is changed.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct ResponseDebug {}

/// The program ends.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct ResponseQuit {}
