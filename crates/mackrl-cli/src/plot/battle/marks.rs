//! The marks of a battle: bodies, bars, crosses, rings, and the shapes that they are made of.

use super::{Figure, INK, PAPER, Side};
use crate::plot::{
    chart::Colour,
    scene::{Anchor, Direction, Rectangle, Shape, Stroke, Weight, Words},
};

const EMPTY_BAR: Colour = Colour(0xD8, 0xD8, 0xD8);

/// A disc or a diamond with the letters of its type.
pub(super) fn body(at: [f64; 2], figure: &Figure, radius: f64, opacity: f64) -> Vec<Shape> {
    let outline = |radius: f64| match figure.side {
        Side::Ally => circle(at, radius, 40),
        // As large as the disc of the same radius.
        Side::Enemy => circle(at, 1.2533 * radius, 4),
    };
    let mut shapes = vec![
        filled(&outline(radius + 1.4), PAPER, 1.0),
        filled(&outline(radius), figure.side.colour(), opacity),
    ];
    let size = (1.05 * radius).clamp(6.0, 22.0);
    // Two letters have to find room too.
    let size = if figure.letters.chars().count() > 1 {
        0.8 * size
    } else {
        size
    };
    // In the upper part, because bars stand in the lower.
    let at = [at[0], at[1] + 0.36 * size - 0.28 * radius];
    shapes.push(Shape::Words(Words {
        anchor: Anchor::Middle,
        ..label(&figure.letters, at, size, Weight::Medium, PAPER)
    }));
    shapes
}

/// Life and below it shields, on the body: bars beside it would lie on its neighbours.
pub(super) fn bars(at: [f64; 2], figure: &Figure, radius: f64) -> Vec<Shape> {
    let (width, height) = (1.5 * radius, (0.2 * radius).max(2.0));
    let left = at[0] - width / 2.0;
    let mut top = at[1] + 0.2 * radius;
    let mut shapes = Vec::new();
    let life = std::iter::once((figure.life, INK));
    for (share, colour) in life.chain(figure.shield.map(|share| (share, Colour::SKY))) {
        shapes.push(bar(
            [left - 1.0, top - 1.0],
            [width + 2.0, height + 2.0],
            PAPER,
            1.0,
        ));
        shapes.push(bar([left, top], [width, height], EMPTY_BAR, 1.0));
        if share > 0.0 {
            shapes.push(bar([left, top], [width, height], colour, share.min(1.0)));
        }
        top += height + 1.0;
    }
    shapes
}

/// A bar of which `share` is filled.
pub(super) fn bar(
    [left, top]: [f64; 2],
    [width, height]: [f64; 2],
    colour: Colour,
    share: f64,
) -> Shape {
    let rectangle = Rectangle {
        left,
        top,
        right: left + width * share,
        bottom: top + height,
    };
    filled(&rectangle.corners(), colour, 1.0)
}

/// Where a unit fell.
pub(super) fn cross([x, y]: [f64; 2], arm: f64) -> Vec<Shape> {
    let line = |ends: [[f64; 2]; 2]| open(&ends, Colour(0x9A, 0x95, 0x8A), 2.2, Stroke::Solid);
    vec![
        line([[x - arm, y - arm], [x + arm, y + arm]]),
        line([[x - arm, y + arm], [x + arm, y - arm]]),
    ]
}

/// A regular polygon, which with many corners is a circle; the first corner is to the east.
pub(super) fn circle([x, y]: [f64; 2], radius: f64, corners: u16) -> Vec<[f64; 2]> {
    let turn = std::f64::consts::TAU / f64::from(corners);
    (0..corners)
        .map(|corner| {
            let (sine, cosine) = (turn * f64::from(corner)).sin_cos();
            [x + radius * cosine, y + radius * sine]
        })
        .collect()
}

pub(super) fn filled(points: &[[f64; 2]], colour: Colour, opacity: f64) -> Shape {
    Shape::Polygon {
        points: points.to_vec(),
        colour,
        opacity,
    }
}

pub(super) fn open(points: &[[f64; 2]], colour: Colour, width: f64, stroke: Stroke) -> Shape {
    Shape::Line {
        points: points.to_vec(),
        colour,
        width,
        stroke,
    }
}

pub(super) fn closed(points: &[[f64; 2]], colour: Colour, width: f64, stroke: Stroke) -> Shape {
    let points: Vec<[f64; 2]> = points.iter().chain(points.first()).copied().collect();
    open(&points, colour, width, stroke)
}

pub(super) fn words(text: &str, at: [f64; 2], size: f64, weight: Weight, colour: Colour) -> Shape {
    Shape::Words(label(text, at, size, weight, colour))
}

pub(super) fn label(text: &str, at: [f64; 2], size: f64, weight: Weight, colour: Colour) -> Words {
    Words {
        text: text.to_owned(),
        at,
        anchor: Anchor::Start,
        size,
        weight,
        colour,
        direction: Direction::Rightwards,
    }
}

/// A missile in flight.
pub(super) fn missile(at: [f64; 2]) -> Vec<Shape> {
    vec![
        filled(&circle(at, 3.6, 16), PAPER, 1.0),
        filled(&circle(at, 2.6, 16), INK, 1.0),
    ]
}

/// What binds two agents that are paired: a broad band if they act jointly, dashes if they delegate.
pub(super) fn link(ends: [[f64; 2]; 2], is_joint: bool) -> Vec<Shape> {
    let casing = open(&ends, PAPER, 9.0, Stroke::Solid);
    if is_joint {
        return vec![
            casing,
            open(&ends, Colour::GREEN, 7.0, Stroke::Solid),
            open(&ends, PAPER, 2.2, Stroke::Solid),
        ];
    }
    vec![casing, open(&ends, Colour::PURPLE, 4.0, Stroke::Dashed)]
}
