//! A picture of a battle: terrain, units with life and shields, who aims at whom, and who knows what.
//!
//! Sides differ in colour and in shape (allies are discs, enemies diamonds), so that the picture can be read in grey. Bodies
//! have their true size; a letter names the type, and the legend explains it. A [`Lens`] looks at one group: the fields of view
//! of some agents, and a ring about everything that the group commonly knows.

mod drawing;
mod ground;
mod legend;
mod lens;
mod marks;

use mackrl_run::replay::Shot;

use super::{chart::Colour, svg};
use drawing::Drawing;

const INK: Colour = Colour(0x2B, 0x2B, 0x2B);
const FAINT: Colour = Colour(0x70, 0x70, 0x70);
const PAPER: Colour = Colour(0xFF, 0xFF, 0xFF);

/// One moment of a battle, in map units, y to the north.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BattlePicture {
    /// What is shown, in a few words.
    pub(crate) title: String,
    /// How the battle stands.
    pub(crate) subtitle: String,
    /// Whether a cell can be walked on, index `y * edge + x`.
    pub(crate) walkable: Vec<bool>,
    /// Cells along an edge of the map.
    pub(crate) edge: usize,
    /// All units, the dead ones too.
    pub(crate) figures: Vec<Figure>,
    /// Who aims at whom.
    pub(crate) shots: Vec<Shot>,
    /// Missiles in flight.
    pub(crate) missiles: Vec<[f64; 2]>,
    /// How far allies see.
    pub(crate) sight: f64,
    /// The pairs of the partition in force.
    pub(crate) links: Vec<Link>,
    /// Whose knowledge is shown, if anybody's.
    pub(crate) lens: Option<Lens>,
}

/// A pair of the partition in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Link {
    /// Indices of the two among the figures.
    pub(crate) members: [usize; 2],
    /// Whether the two acted jointly; otherwise they delegated.
    pub(crate) is_joint: bool,
}

/// What a group knows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Lens {
    /// Indices of the group among the figures.
    pub(crate) members: Vec<usize>,
    /// Indices of those whose fields of view are drawn, the group among them.
    pub(crate) fields: Vec<usize>,
    /// Indices of the figures that the group commonly knows.
    pub(crate) common: Vec<usize>,
    /// Those that some member sees and that are not common.
    pub(crate) other: Vec<usize>,
}

/// The two sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Side {
    Ally,
    Enemy,
}

/// One unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Figure {
    pub(crate) side: Side,
    /// Name of its type.
    pub(crate) kind: String,
    /// What it is called: A, B, … or e0, e1, …
    pub(crate) name: String,
    /// Where it is, or fell.
    pub(crate) at: [f64; 2],
    /// Where it was a step before.
    pub(crate) from: [f64; 2],
    pub(crate) radius: f64,
    pub(crate) is_alive: bool,
    /// Share of its life, in [0, 1].
    pub(crate) life: f64,
    /// Share of its shields, if its type has any.
    pub(crate) shield: Option<f64>,
}

impl Side {
    const fn colour(self) -> Colour {
        match self {
            Self::Ally => Colour::BLUE,
            Self::Enemy => Colour::VERMILLION,
        }
    }
}

impl BattlePicture {
    /// The picture as an SVG document.
    #[must_use]
    pub(crate) fn to_svg(&self) -> String {
        svg::write(&Drawing::new(self).scene(), &self.title)
    }
}

#[cfg(test)]
mod tests;
