//! Units as a game shows them.

use super::Point;

/// A living unit.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub struct Unit {
    /// 1: seen now.
    #[prost(int32, optional, tag = "1")]
    pub display_type: Option<i32>,
    /// 1: the client's own, 4: an enemy.
    #[prost(int32, optional, tag = "2")]
    pub alliance: Option<i32>,
    /// Its name for as long as it lives.
    #[prost(uint64, optional, tag = "3")]
    pub tag: Option<u64>,
    /// Its type.
    #[prost(uint32, optional, tag = "4")]
    pub unit_type: Option<u32>,
    /// Its player.
    #[prost(int32, optional, tag = "5")]
    pub owner: Option<i32>,
    /// Where it is.
    #[prost(message, optional, tag = "6")]
    pub pos: Option<Point>,
    /// Where it looks, in radians.
    #[prost(float, optional, tag = "7")]
    pub facing: Option<f32>,
    /// How large it is.
    #[prost(float, optional, tag = "8")]
    pub radius: Option<f32>,
    /// 1: finished.
    #[prost(float, optional, tag = "9")]
    pub build_progress: Option<f32>,
    /// Hit points.
    #[prost(float, optional, tag = "14")]
    pub health: Option<f32>,
    /// Full hit points.
    #[prost(float, optional, tag = "15")]
    pub health_max: Option<f32>,
    /// Shield points.
    #[prost(float, optional, tag = "16")]
    pub shield: Option<f32>,
    /// Energy.
    #[prost(float, optional, tag = "17")]
    pub energy: Option<f32>,
    /// Whether it is in the air.
    #[prost(bool, optional, tag = "20")]
    pub is_flying: Option<bool>,
    /// Loops until its weapon is ready.
    #[prost(float, optional, tag = "30")]
    pub weapon_cooldown: Option<f32>,
    /// Full shield points.
    #[prost(float, optional, tag = "36")]
    pub shield_max: Option<f32>,
    /// Full energy.
    #[prost(float, optional, tag = "37")]
    pub energy_max: Option<f32>,
}
