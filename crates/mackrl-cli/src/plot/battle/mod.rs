//! Pictures of a battle: terrain, units with life and shields, what they do next, and who knows what.
//!
//! A picture shows one decision: where the units stand when it is made, the pairs that are formed, and what follows from it, so
//! that moves, shots and bands belong together. Sides differ in colour and in shape (allies are discs, enemies diamonds), so that
//! the picture can be read in grey. Bodies have their true size; letters name the type, and the legend explains it. A [`Lens`]
//! looks at one group: the fields of view of some agents, and rings about what the group knows.
//!
//! Pictures of one film share their ground, their scale and their legend, so that nothing jumps.

mod drawing;
mod ground;
mod legend;
mod lens;
mod marks;
mod names;
mod stage;

use mackrl_run::replay::Shot;
use tiny_skia::Pixmap;

use super::{chart::Colour, png, svg};
use drawing::Drawing;
use stage::Stage;

const INK: Colour = Colour(0x2B, 0x2B, 0x2B);
const FAINT: Colour = Colour(0x70, 0x70, 0x70);
const PAPER: Colour = Colour(0xFF, 0xFF, 0xFF);
/// Map units that a unit has to move for that to be drawn, and two bodies to be apart for a shot between them to be.
const SEEN_FROM: f64 = 0.1;

/// One decision of a battle, in map units, y to the north.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BattlePicture {
    /// What is shown, in a few words.
    pub(crate) title: String,
    /// How the battle stands.
    pub(crate) subtitle: String,
    /// What the lens shows, in one line; empty if there is none.
    pub(crate) caption: String,
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
    /// The pairs of living agents in the partition in force.
    pub(crate) links: Vec<Link>,
    /// Whose knowledge is shown, if a group was chosen.
    pub(crate) lens: Option<Lens>,
}

/// A pair of the partition in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Link {
    /// Indices of the two among the figures.
    pub(crate) members: [usize; 2],
    /// Whether the two act jointly; otherwise they delegate.
    pub(crate) is_joint: bool,
}

/// What a group knows: indices among the figures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Lens {
    /// The group.
    pub(crate) members: Vec<usize>,
    /// Those whose fields of view are drawn, the group among them.
    pub(crate) fields: Vec<usize>,
    /// What the group commonly knows.
    pub(crate) common: Vec<usize>,
    /// What every member sees without its being common knowledge.
    pub(crate) mutual: Vec<usize>,
    /// What some members see and others do not.
    pub(crate) private: Vec<usize>,
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
    /// What stands for its type.
    pub(crate) letters: String,
    /// What it is called: A, B, … or e0, e1, …
    pub(crate) name: String,
    /// Where it is, or fell.
    pub(crate) at: [f64; 2],
    /// Where it is after the step.
    pub(crate) to: [f64; 2],
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

impl Figure {
    /// Whether it lives and moves far enough to be seen moving.
    fn is_moving(&self) -> bool {
        self.is_alive && distance(self.at, self.to) > SEEN_FROM
    }
}

impl Lens {
    /// Whether some member sees the figure with this index.
    fn sees(&self, index: usize) -> bool {
        [&self.common, &self.mutual, &self.private]
            .into_iter()
            .any(|seen| seen.contains(&index))
    }
}

impl BattlePicture {
    /// The picture as an SVG document.
    #[must_use]
    pub(crate) fn to_svg(&self) -> String {
        let stage = Stage::of(std::slice::from_ref(self));
        svg::write(&Drawing::new(self, &stage, &[]).scene(), &self.title)
    }

    fn living(&self) -> impl Iterator<Item = &Figure> {
        self.figures.iter().filter(|figure| figure.is_alive)
    }

    /// The shots that have room between the bodies, with the two.
    fn shots_apart(&self) -> impl Iterator<Item = (Shot, [&Figure; 2])> {
        let shots = self.shots.iter();
        let shots = shots.map(|shot| (*shot, [shot.from, shot.to].map(|at| &self.figures[at])));
        shots.filter(|(_, [from, to])| {
            distance(from.at, to.at) > from.radius + to.radius + SEEN_FROM
        })
    }
}

/// The pictures of a film one after the other, as images of one size.
///
/// # Errors
/// If an image has no area.
pub(crate) fn film(pictures: &[BattlePicture]) -> impl Iterator<Item = anyhow::Result<Pixmap>> {
    let stage = Stage::of(pictures);
    let mut spots = Vec::new();
    pictures.iter().map(move |picture| {
        let drawing = Drawing::new(picture, &stage, &spots);
        let image = png::draw(&drawing.scene(), 1);
        spots = drawing.spots();
        image
    })
}

fn distance(from: [f64; 2], to: [f64; 2]) -> f64 {
    (to[0] - from[0]).hypot(to[1] - from[1])
}

#[cfg(test)]
mod tests;
