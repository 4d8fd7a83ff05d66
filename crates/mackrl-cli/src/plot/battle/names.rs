//! Where the names of units stand: beside their units, clear of all bodies and of each other.

use super::{
    INK, PAPER, Side,
    marks::{filled, open, words},
};
use crate::plot::{
    scene::{Rectangle, Shape, Stroke, Weight},
    text,
};

/// Height of an em.
const SIZE: f64 = 11.5;
/// Pixels between a body and its name, the nearest first.
const DISTANCES: [f64; 5] = [2.0, 8.0, 16.0, 26.0, 38.0];
/// Distance from which on a line leads from the body to the name.
const LED_FROM: f64 = 8.0;
/// Directions in sixteenths of a turn from the east towards the south, the best first.
const DIRECTIONS: [u8; 16] = [14, 10, 2, 6, 0, 8, 12, 4, 15, 13, 9, 11, 1, 3, 7, 5];

/// A unit that is drawn, in pixels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Body {
    pub(super) at: [f64; 2],
    pub(super) radius: f64,
    pub(super) side: Side,
    pub(super) name: String,
    /// Pixels about it that its own name leaves free.
    pub(super) free: f64,
}

/// A name in its place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tag {
    /// Which of the places about its unit it is.
    pub(super) spot: usize,
    pub(super) name: String,
    pub(super) plate: Rectangle,
    /// From the body to the name, where they are far apart.
    leader: Option<[[f64; 2]; 2]>,
}

/// Gives each name the first free place inside `area`, and before that the place that it had, `preferred`. A name that finds
/// none is left out.
pub(super) fn place(
    bodies: &[Body],
    area: Rectangle,
    preferred: &[Option<usize>],
) -> Vec<Option<Tag>> {
    let mut taken: Vec<Rectangle> = Vec::new();
    let tags = bodies.iter().enumerate().map(|(number, body)| {
        let spots = 0..DISTANCES.len() * DIRECTIONS.len();
        let kept = preferred.get(number).copied().flatten();
        let tags = kept.into_iter().chain(spots).map(|spot| body.tag(spot));
        let is_free = |tag: &Tag| {
            let [lower, _, upper, _] = tag.plate.corners();
            area.holds(lower)
                && area.holds(upper)
                && !bodies.iter().any(|other| other.touches(tag.plate))
                && !taken.iter().any(|plate| plate.overlaps(tag.plate))
        };
        let tag = tags.into_iter().find(is_free)?;
        taken.push(tag.plate);
        Some(tag)
    });
    tags.collect()
}

impl Body {
    fn tag(&self, spot: usize) -> Tag {
        let (far, direction) = (spot / DIRECTIONS.len(), spot % DIRECTIONS.len());
        let turn = f64::from(DIRECTIONS[direction]) / 16.0 * std::f64::consts::TAU;
        let along = [turn.cos(), turn.sin()];
        let edge = match self.side {
            Side::Ally => self.radius,
            Side::Enemy => self.tip() / (along[0].abs() + along[1].abs()),
        };
        let away = edge + self.free + DISTANCES[far];
        let half = [
            text::width(&self.name, SIZE, Weight::Medium) / 2.0 + 1.5,
            0.5 * SIZE,
        ];
        let [x, y] = [0, 1].map(|axis| {
            let side = (1.5 * along[axis]).clamp(-1.0, 1.0) * half[axis];
            self.at[axis] + along[axis] * away + side
        });
        let plate = Rectangle {
            left: x - half[0],
            top: y - half[1],
            right: x + half[0],
            bottom: y + half[1],
        };
        let is_led = DISTANCES[far] >= LED_FROM;
        Tag {
            spot,
            name: self.name.clone(),
            plate,
            leader: is_led.then(|| [edge, away].map(|l| [0, 1].map(|i| self.at[i] + along[i] * l))),
        }
    }

    /// From the centre to the corner of a diamond that is as large as the disc of its radius.
    fn tip(&self) -> f64 {
        1.2533 * self.radius
    }

    /// Whether a rectangle lies over some of it.
    pub(super) fn touches(&self, plate: Rectangle) -> bool {
        let [x, y] = self.at;
        let aside = (plate.left - x).max(x - plate.right).max(0.0);
        let above = (plate.top - y).max(y - plate.bottom).max(0.0);
        match self.side {
            Side::Ally => aside.hypot(above) < self.radius,
            Side::Enemy => aside + above < self.tip(),
        }
    }
}

impl Tag {
    pub(super) fn shapes(&self) -> Vec<Shape> {
        let at = [self.plate.left + 1.5, self.plate.bottom - 0.15 * SIZE];
        let leader = self.leader.map(|ends| open(&ends, INK, 0.8, Stroke::Solid));
        let name = [
            filled(&self.plate.corners(), PAPER, 0.75),
            words(&self.name, at, SIZE, Weight::Medium, INK),
        ];
        leader.into_iter().chain(name).collect()
    }
}
