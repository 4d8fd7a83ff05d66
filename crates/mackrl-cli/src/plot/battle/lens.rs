//! What a group knows, drawn over the battle: fields of view as circles, and rings about what is known.

use super::{
    Lens, Side,
    drawing::Drawing,
    marks::{circle, closed, filled},
};
use crate::plot::{
    chart::Colour,
    scene::{Shape, Stroke},
};

/// Of what is common knowledge.
pub(super) const COMMON: Colour = Colour::GREEN;
/// Of what all members see without its being common knowledge.
pub(super) const MUTUAL: Colour = Colour::ORANGE;
/// Of what some members see and others do not.
pub(super) const PRIVATE: Colour = Colour(0xA8, 0x55, 0x7F);
/// Of the fields of view of agents that are not in the group.
pub(super) const APART: Colour = Colour(0x8A, 0x86, 0x7C);
/// Pixels by which the widest ring stands off a body.
pub(super) const STANDS_OFF: f64 = 9.0;

/// The fields of view, lightly filled: full edges for the group, dashed for others.
pub(super) fn fields(drawing: &Drawing<'_>, lens: &Lens) -> Vec<Shape> {
    let picture = drawing.picture;
    let mut shapes = Vec::new();
    for &index in &lens.fields {
        let figure = &picture.figures[index];
        let field = circle(
            drawing.place(figure.at),
            picture.sight * drawing.stage.unit,
            128,
        );
        let (colour, opacity, width, stroke) = if lens.members.contains(&index) {
            (Side::Ally.colour(), 0.09, 1.6, Stroke::Solid)
        } else {
            (APART, 0.06, 1.4, Stroke::Dashed)
        };
        shapes.push(filled(&field, colour, opacity));
        shapes.push(closed(&field, colour, width, stroke));
    }
    shapes
}

/// A double ring about what is common knowledge, a dashed one about what all see, a dotted one about what some see.
pub(super) fn rings(drawing: &Drawing<'_>, lens: &Lens) -> Vec<Shape> {
    let around = |index: usize, distance: f64| {
        let figure = &drawing.picture.figures[index];
        let radius = figure.reach() * drawing.stage.unit;
        circle(drawing.place(figure.at), radius + distance, 48)
    };
    let common = lens.common.iter().flat_map(|&index| {
        let halo = around(index, STANDS_OFF);
        [
            filled(&halo, COMMON, 0.28),
            closed(&halo, COMMON, 2.4, Stroke::Solid),
            closed(&around(index, 4.5), COMMON, 1.2, Stroke::Solid),
        ]
    });
    let ring = |index: &usize, colour, stroke| closed(&around(*index, 6.0), colour, 2.4, stroke);
    let mutual = lens.mutual.iter();
    let mutual = mutual.map(|index| ring(index, MUTUAL, Stroke::Dashed));
    let private = lens.private.iter();
    let private = private.map(|index| ring(index, PRIVATE, Stroke::Dotted));
    common.chain(mutual).chain(private).collect()
}
