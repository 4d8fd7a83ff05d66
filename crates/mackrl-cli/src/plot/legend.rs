//! Legends: marks with what they mean, in rows outside of what they explain.

use super::{
    layout::{INK, MIDDLE, words},
    scene::{Shape, Weight},
    text,
};

/// Height of an em.
const SIZE: f64 = 12.5;
/// From row to row.
const ROW: f64 = 21.0;
/// Between a mark and its meaning.
const BESIDE: f64 = 7.0;
/// Between a meaning and the next mark.
const BETWEEN: f64 = 24.0;

/// A mark with what it means.
pub(super) struct Entry {
    width: f64,
    meaning: String,
    mark: Vec<Shape>,
}

/// A legend that was laid out.
pub(super) struct Legend {
    pub(super) shapes: Vec<Shape>,
    /// Of all rows; 0 without entries.
    pub(super) height: f64,
}

impl Entry {
    /// `mark` is `width` wide, begins at x = 0 and has its middle at y = 0.
    pub(super) fn new(width: f64, meaning: impl Into<String>, mark: Vec<Shape>) -> Self {
        Self {
            width,
            meaning: meaning.into(),
            mark,
        }
    }
}

/// Sets entries one after the other into rows between `left` and `right`, from `top` downwards.
pub(super) fn flow(entries: Vec<Entry>, [left, right]: [f64; 2], top: f64) -> Legend {
    let (mut start, mut bottom) = (left, top);
    let mut shapes = Vec::new();
    for entry in entries {
        let width = entry.width + BESIDE + text::width(&entry.meaning, SIZE, Weight::Regular);
        let is_full = start > left && start + width > right;
        if bottom == top || is_full {
            (start, bottom) = (left, bottom + ROW);
        }
        let middle = bottom - 0.5 * ROW;
        let mark = entry.mark.into_iter();
        shapes.extend(mark.map(|shape| shape.moved([start, middle])));
        let at = [start + entry.width + BESIDE, middle + MIDDLE * SIZE];
        shapes.push(Shape::Words(words(entry.meaning, at, SIZE, INK)));
        start += width + BETWEEN;
    }
    Legend {
        shapes,
        height: bottom - top,
    }
}
