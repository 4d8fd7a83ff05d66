//! Line charts with bands, and pictures of battles, as SVG and PNG.
//!
//! A chart is data: titles, axes and series of points. It knows nothing of learners, games or files, so a figure can be
//! redrawn from what a run has written. [`LineChart`] or [`SmallMultiples`] is laid out once into a scene of polygons, lines, discs and words, and
//! both writers draw that scene: the two files show the same picture. Words are drawn from fonts that the program carries,
//! because many servers have none.
//!
//! The colours are those of Okabe and Ito ("Color Universal Design", 2008), which people with any kind of colour vision can
//! tell apart; series that matter also differ in line style.

mod battle;
mod chart;
mod layout;
mod legend;
mod multiples;
mod png;
mod scale;
mod scene;
mod svg;
mod text;

pub(crate) use battle::{BattlePicture, Figure, Lens, Link, Side, film};
pub(crate) use chart::{Axis, Colour, LineChart, Mark, Point, Series};
pub(crate) use multiples::{Multiple, SmallMultiples};

#[cfg(test)]
mod tests;
