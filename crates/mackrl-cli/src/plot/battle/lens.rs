//! What a group knows, drawn over the battle: fields of view as circles, and rings about what is known.

use super::{
    Lens, Side,
    drawing::Drawing,
    marks::{circle, closed, closed_dashed, filled},
};
use crate::plot::{chart::Colour, scene::Shape};

/// Of what is common knowledge.
pub(super) const COMMON: Colour = Colour::GREEN;
/// Of what only some see.
pub(super) const OTHER: Colour = Colour::ORANGE;
/// Of the fields of view of agents that are not in the group.
const APART: Colour = Colour(0x8A, 0x86, 0x7C);

/// The fields of view, lightly filled: full edges for the group, dashed for others.
pub(super) fn fields(drawing: &Drawing<'_>, lens: &Lens) -> Vec<Shape> {
    let picture = drawing.picture;
    let mut shapes = Vec::new();
    for &index in &lens.fields {
        let figure = &picture.figures[index];
        let field = circle(drawing.place(figure.at), picture.sight * drawing.unit, 128);
        if lens.members.contains(&index) {
            shapes.push(filled(&field, Side::Ally.colour(), 0.09));
            shapes.push(closed(&field, Side::Ally.colour(), 1.6));
        } else {
            shapes.push(filled(&field, APART, 0.06));
            shapes.push(closed_dashed(&field, APART, 1.4));
        }
    }
    shapes
}

/// A double ring about everything that is common knowledge, a dashed one about what some member sees besides.
pub(super) fn rings(drawing: &Drawing<'_>, lens: &Lens) -> Vec<Shape> {
    let around = |index: usize, distance: f64| {
        let figure = &drawing.picture.figures[index];
        let radius = figure.radius * drawing.unit;
        // A diamond reaches farther than the disc of its radius.
        let reach = if figure.side == Side::Enemy {
            1.25
        } else {
            1.0
        };
        circle(drawing.place(figure.at), reach * radius + distance, 48)
    };
    let common = lens.common.iter().flat_map(|&index| {
        let halo = around(index, 9.0);
        [
            filled(&halo, COMMON, 0.28),
            closed(&halo, COMMON, 2.4),
            closed(&around(index, 4.5), COMMON, 1.2),
        ]
    });
    let other = (lens.other.iter()).map(|&index| closed_dashed(&around(index, 6.0), OTHER, 2.2));
    common.chain(other).collect()
}
