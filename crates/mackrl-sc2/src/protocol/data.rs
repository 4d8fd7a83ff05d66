//! Points, sizes and grids.

/// A point in the world.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub struct Point {
    /// East.
    #[prost(float, optional, tag = "1")]
    pub x: Option<f32>,
    /// North.
    #[prost(float, optional, tag = "2")]
    pub y: Option<f32>,
    /// Up.
    #[prost(float, optional, tag = "3")]
    pub z: Option<f32>,
}

/// A point on the ground.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub struct Point2D {
    /// East.
    #[prost(float, optional, tag = "1")]
    pub x: Option<f32>,
    /// North.
    #[prost(float, optional, tag = "2")]
    pub y: Option<f32>,
}

/// A cell.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct PointI {
    /// East.
    #[prost(int32, optional, tag = "1")]
    pub x: Option<i32>,
    /// North.
    #[prost(int32, optional, tag = "2")]
    pub y: Option<i32>,
}

/// A rectangle of cells.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct RectangleI {
    /// Its south-western corner.
    #[prost(message, optional, tag = "1")]
    pub p0: Option<PointI>,
    /// Its north-eastern corner.
    #[prost(message, optional, tag = "2")]
    pub p1: Option<PointI>,
}

/// Width and height in cells.
#[derive(Clone, Copy, PartialEq, Eq, prost::Message)]
pub struct Size2DI {
    /// Width.
    #[prost(int32, optional, tag = "1")]
    pub x: Option<i32>,
    /// Height.
    #[prost(int32, optional, tag = "2")]
    pub y: Option<i32>,
}

/// A grid of numbers.
#[derive(Clone, PartialEq, Eq, prost::Message)]
pub struct ImageData {
    /// Bits of a cell: 1, 8, 16 or 32.
    #[prost(int32, optional, tag = "1")]
    pub bits_per_pixel: Option<i32>,
    /// Width and height.
    #[prost(message, optional, tag = "2")]
    pub size: Option<Size2DI>,
    /// Row after row; bits from the highest of a byte on.
    #[prost(bytes = "vec", optional, tag = "3")]
    pub data: Option<Vec<u8>>,
}
