//! From a picture to the shapes that are drawn.

use mackrl_run::replay::Shot;

use super::{
    BattlePicture, FAINT, Figure, INK, Link, Side, distance,
    ground::WALL,
    lens,
    marks::{bars, body, circle, closed, cross, filled, link, missile, open, words},
    names::{self, Body, Tag},
    stage::Stage,
};
use crate::plot::{
    chart::Colour,
    scene::{Panel, Scene, Shape, Stroke, Weight, pixels},
};

/// Opacity where all allies see.
const SIGHT_OPACITY: f64 = 0.22;
/// Opacity of units that no member of the lens's group sees.
pub(super) const PALE: f64 = 0.35;
/// Of a shot that heals.
pub(super) const HEAL: Colour = Colour::GREEN;
/// Least pixels of a band between two bodies; where these leave less room, it lies on them.
const BAND_LEAST: f64 = 14.0;

/// A picture on its way to a scene.
pub(super) struct Drawing<'a> {
    pub(super) picture: &'a BattlePicture,
    pub(super) stage: &'a Stage,
    tags: Vec<Option<Tag>>,
}

impl<'a> Drawing<'a> {
    /// `spots` are those of the picture before, so that names stay where they were.
    pub(super) fn new(
        picture: &'a BattlePicture,
        stage: &'a Stage,
        spots: &[Option<usize>],
    ) -> Self {
        let bodies = bodies(picture, stage);
        let living: Vec<Option<usize>> = (picture.figures.iter().zip(spots))
            .filter(|(figure, _)| figure.is_alive)
            .map(|(_, spot)| *spot)
            .collect();
        Self {
            picture,
            stage,
            tags: names::place(&bodies, stage.area, &living),
        }
    }

    /// Where the name of each figure stands about it, if it has one.
    pub(super) fn spots(&self) -> Vec<Option<usize>> {
        let mut tags = self.tags.iter();
        let figures = self.picture.figures.iter();
        figures
            .map(|figure| {
                let tag = figure.is_alive.then(|| tags.next())?;
                tag?.as_ref().map(|tag| tag.spot)
            })
            .collect()
    }

    pub(super) fn scene(&self) -> Scene {
        let (area, picture) = (self.stage.area, self.picture);
        let line = |text: &str, down, size, weight, colour| {
            words(text, [area.left, down], size, weight, colour)
        };
        let mut foreground = vec![
            line(&picture.title, 26.0, 17.0, Weight::Medium, INK),
            line(&picture.subtitle, 46.0, 12.5, Weight::Regular, FAINT),
            line(&picture.caption, 72.0, 16.0, Weight::Medium, INK),
            closed(&area.corners(), WALL, 1.0, Stroke::Solid),
        ];
        foreground.extend(self.stage.legend.shapes.iter().cloned());
        let place = |at| self.place(at);
        let mut data = self.stage.window.ground(picture, area, place);
        data.extend(self.battle());
        Scene {
            width: pixels(self.stage.size[0]),
            height: pixels(self.stage.size[1]),
            panels: vec![Panel {
                area,
                background: Vec::new(),
                data,
                foreground,
            }],
        }
    }

    /// From map units to pixels.
    pub(super) fn place(&self, at: [f64; 2]) -> [f64; 2] {
        self.stage.place(at)
    }

    /// What happens on the ground, the least important first.
    fn battle(&self) -> Vec<Shape> {
        let (picture, unit) = (self.picture, self.stage.unit);
        let mut shapes = self.sight();
        for dead in picture.figures.iter().filter(|figure| !figure.is_alive) {
            shapes.extend(cross(self.place(dead.at), 0.28 * unit));
        }
        if let Some(lens) = &picture.lens {
            shapes.extend(lens::rings(self, lens));
        }
        shapes.extend(picture.living().filter_map(|figure| self.trail(figure)));
        let (bands, clasps): (Vec<_>, Vec<_>) = (picture.links.iter())
            .map(|pair| self.link(*pair))
            .partition(|(_, is_apart)| *is_apart);
        shapes.extend(bands.into_iter().flat_map(|(band, _)| band));
        shapes.extend((picture.shots_apart()).flat_map(|(shot, figures)| self.shot(shot, figures)));
        for (index, figure) in picture.figures.iter().enumerate() {
            if figure.is_alive {
                let (at, radius) = (self.place(figure.at), figure.radius * unit);
                shapes.extend(body(at, figure, radius, picture.opacity(index)));
                shapes.extend(bars(at, figure, radius));
            }
        }
        shapes.extend(clasps.into_iter().flat_map(|(band, _)| band));
        let missiles = picture.missiles.iter();
        shapes.extend(missiles.flat_map(|at| missile(self.place(*at))));
        shapes.extend(self.tags.iter().flatten().flat_map(Tag::shapes));
        shapes
    }

    /// What is seen: by any ally, or by the agents that the lens names.
    fn sight(&self) -> Vec<Shape> {
        let picture = self.picture;
        if let Some(lens) = &picture.lens {
            return lens::fields(self, lens);
        }
        let opacity = (SIGHT_OPACITY / picture.allies().count().max(1) as f64).min(0.05);
        let reach = picture.sight * self.stage.unit;
        let field = |ally: &Figure| circle(self.place(ally.at), reach, 96);
        picture
            .allies()
            .map(|ally| filled(&field(ally), Side::Ally.colour(), opacity))
            .collect()
    }

    /// The band between two agents that are paired, from body to body, and whether there is room for it between them.
    fn link(&self, pair: Link) -> (Vec<Shape>, bool) {
        let members = pair.members.map(|index| &self.picture.figures[index]);
        let [from, to] = members.map(|figure| self.place(figure.at));
        let length = distance(from, to).max(1.0);
        let [first, last] = members.map(|figure| figure.radius * self.stage.unit);
        let room = length - first - last;
        let middle = first + room / 2.0;
        let half = room.max(BAND_LEAST) / 2.0;
        let along = |part: f64| [0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis]));
        let ends = [middle - half, middle + half].map(|distance| along(distance / length));
        (link(ends, pair.is_joint), room >= BAND_LEAST)
    }

    /// Where a unit goes in this step.
    fn trail(&self, figure: &Figure) -> Option<Shape> {
        let ends = [figure.to, figure.at].map(|at| self.place(at));
        let wedge = wedge(ends, 0.55 * figure.radius * self.stage.unit)?;
        figure
            .is_moving()
            .then(|| filled(&wedge, figure.side.colour(), 0.4))
    }

    /// A line from the attacker's edge to the target's: full if it attacks, dashed if it aims.
    fn shot(&self, shot: Shot, figures: [&Figure; 2]) -> Vec<Shape> {
        let [from, to] = figures.map(|figure| self.place(figure.at));
        let [near, far] = figures.map(|figure| figure.radius * self.stage.unit);
        let length = distance(from, to);
        let along = |distance: f64| {
            [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * distance / length)
        };
        let tip = along(length - far - 1.0);
        let [attacker, target] = figures;
        let colour = if attacker.side == target.side {
            HEAL
        } else {
            attacker.side.colour()
        };
        let tail = along(near);
        if !shot.has_fired {
            return vec![open(&[tail, tip], colour, 1.0, Stroke::Dashed)];
        }
        let mut shapes = vec![open(&[tail, tip], colour, 1.8, Stroke::Solid)];
        let head = wedge([tip, along(length - far - 8.0)], 3.4);
        shapes.extend(head.map(|head| filled(&head, colour, 1.0)));
        shapes
    }

    /// The names that are shown.
    #[cfg(test)]
    pub(super) fn tags(&self) -> impl Iterator<Item = &Tag> {
        self.tags.iter().flatten()
    }
}

/// The living, as names see them.
pub(super) fn bodies(picture: &BattlePicture, stage: &Stage) -> Vec<Body> {
    let figures = picture.figures.iter().enumerate();
    let living = figures.filter(|(_, figure)| figure.is_alive);
    living
        .map(|(index, figure)| {
            let lens = picture.lens.as_ref();
            let is_ringed = lens.is_some_and(|lens| lens.sees(index));
            Body {
                at: stage.place(figure.at),
                radius: figure.radius * stage.unit,
                side: figure.side,
                name: figure.name.clone(),
                free: if is_ringed { lens::STANDS_OFF } else { 0.0 },
            }
        })
        .collect()
}

impl BattlePicture {
    pub(super) fn allies(&self) -> impl Iterator<Item = &Figure> {
        self.living().filter(|figure| figure.side == Side::Ally)
    }

    /// Opacity of a figure's body.
    fn opacity(&self, index: usize) -> f64 {
        match &self.lens {
            Some(lens) if !lens.sees(index) => PALE,
            _ => 1.0,
        }
    }

    /// A living unit that the lens's group does not see.
    pub(super) fn unseen(&self) -> Option<&Figure> {
        let lens = self.lens.as_ref()?;
        let figures = self.figures.iter().enumerate();
        let mut unseen = figures.filter(|(index, figure)| figure.is_alive && !lens.sees(*index));
        unseen.next().map(|(_, figure)| figure)
    }
}

impl Figure {
    /// From its centre to its farthest point, in map units: a diamond reaches farther than the disc of its radius.
    pub(super) fn reach(&self) -> f64 {
        match self.side {
            Side::Ally => self.radius,
            Side::Enemy => 1.25 * self.radius,
        }
    }
}

/// A triangle with its point at the first end and `half_width` to either side of the other; `None` if it is too short to see.
pub(super) fn wedge([point, base]: [[f64; 2]; 2], half_width: f64) -> Option<[[f64; 2]; 3]> {
    let along = [0, 1].map(|axis| base[axis] - point[axis]);
    let length = along[0].hypot(along[1]);
    let side = [-along[1], along[0]].map(|part| part / length * half_width);
    (length >= 1.0).then_some([
        point,
        [base[0] + side[0], base[1] + side[1]],
        [base[0] - side[0], base[1] - side[1]],
    ])
}
