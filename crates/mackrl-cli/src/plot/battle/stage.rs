//! What the pictures of one film share: the ground that is shown, the scale, the legend, and where they stand.

use super::{BattlePicture, ground::Window, legend};
use crate::plot::{
    legend::{Legend, flow},
    scene::Rectangle,
};

/// Most pixels of the arena along x and along y.
const ROOM: [f64; 2] = [840.0, 600.0];
/// Least pixels of the arena, so that titles and legend find room.
const LEAST: [f64; 2] = [560.0, 280.0];
/// Most pixels of a map unit.
const UNIT_MOST: f64 = 60.0;
/// Pixels between the arena and the edge of the picture.
const MARGIN: f64 = 16.0;
/// Pixels above the arena, for title and subtitle.
const HEAD: f64 = 58.0;
/// Pixels that a caption takes besides.
const CAPTION: f64 = 26.0;
/// Pixels between the arena and the legend.
const GAP: f64 = 10.0;

/// Where everything stands.
pub(super) struct Stage {
    pub(super) window: Window,
    /// Pixels of a map unit.
    pub(super) unit: f64,
    /// The arena in pixels.
    pub(super) area: Rectangle,
    /// Width and height of the picture.
    pub(super) size: [f64; 2],
    pub(super) legend: Legend,
}

impl Stage {
    /// Of pictures that are shown in one place.
    pub(super) fn of(pictures: &[BattlePicture]) -> Self {
        let close = Window::around(pictures);
        let [across, down] = close.size();
        let unit = (ROOM[0] / across).min(ROOM[1] / down).min(UNIT_MOST);
        let edge = pictures.first().map_or(0, |picture| picture.edge);
        let window = close.widened(LEAST.map(|pixels| pixels / unit), edge as f64);
        let [across, down] = window.size();
        let is_told = pictures.iter().any(|picture| !picture.caption.is_empty());
        let top = HEAD + if is_told { CAPTION } else { 0.0 };
        let area = Rectangle {
            left: MARGIN,
            top,
            right: MARGIN + across * unit,
            bottom: top + down * unit,
        };
        let ends = [area.left, area.right];
        let legend = flow(legend::entries(pictures), ends, area.bottom + GAP);
        Self {
            window,
            unit,
            area,
            size: [area.right + MARGIN, area.bottom + GAP + legend.height + 8.0],
            legend,
        }
    }

    /// From map units to pixels.
    pub(super) fn place(&self, at: [f64; 2]) -> [f64; 2] {
        let [east, south] = self.window.offset(at);
        [
            self.area.left + east * self.unit,
            self.area.top + south * self.unit,
        ]
    }
}
