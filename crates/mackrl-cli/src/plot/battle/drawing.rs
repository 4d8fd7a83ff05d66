//! From a picture to the shapes that are drawn.

use mackrl_run::replay::Shot;

use super::{
    BattlePicture, FAINT, Figure, INK, Link, PAPER, Side,
    ground::{WALL, Window},
    legend, lens,
    marks::{bars, body, circle, closed, cross, filled, link, name_tag, open, words},
};
use crate::plot::scene::{Panel, Rectangle, Scene, Shape, Weight, pixels};

/// Width in pixels that the arena is fitted to.
const WIDTH: f64 = 840.0;
/// Least and greatest pixels of a map unit.
const UNIT: [f64; 2] = [24.0, 52.0];
/// Pixels between the arena and the edge of the picture.
const MARGIN: f64 = 16.0;
/// Pixels above the arena, for the title.
const HEAD: f64 = 58.0;
/// Opacity where all allies see.
const SIGHT_OPACITY: f64 = 0.22;
/// Least pixels of a map unit at which names find room.
const NAMES_FROM: f64 = 28.0;

/// A picture on its way to a scene.
pub(super) struct Drawing<'a> {
    pub(super) picture: &'a BattlePicture,
    pub(super) window: Window,
    /// Pixels of a map unit.
    pub(super) unit: f64,
}

impl<'a> Drawing<'a> {
    pub(super) fn new(picture: &'a BattlePicture) -> Self {
        let window = Window::around(picture);
        let [columns, _] = window.size();
        Self {
            picture,
            window,
            unit: (WIDTH / columns).clamp(UNIT[0], UNIT[1]),
        }
    }

    pub(super) fn scene(&self) -> Scene {
        let [columns, rows] = self.window.size();
        let area = Rectangle {
            left: MARGIN,
            top: HEAD,
            right: MARGIN + columns * self.unit,
            bottom: HEAD + rows * self.unit,
        };
        let legend = legend::of(self.picture, area);
        let title = [area.left, 26.0];
        let subtitle = [area.left, 46.0];
        let mut foreground = vec![
            words(&self.picture.title, title, 17.0, Weight::Medium, INK),
            words(
                &self.picture.subtitle,
                subtitle,
                12.5,
                Weight::Regular,
                FAINT,
            ),
            closed(&area.corners(), WALL, 1.0),
        ];
        foreground.extend(legend.shapes);
        let battle = Panel {
            area,
            background: self.window.ground(self.picture, area, |at| self.place(at)),
            data: self.battle(),
            foreground,
        };
        Scene {
            width: pixels(area.right + MARGIN),
            height: pixels(area.bottom + legend.height + 8.0),
            panels: vec![battle],
        }
    }

    /// From map units to pixels.
    pub(super) fn place(&self, at: [f64; 2]) -> [f64; 2] {
        let [east, south] = self.window.offset(at);
        [MARGIN + east * self.unit, HEAD + south * self.unit]
    }

    fn living(&self) -> impl Iterator<Item = &'a Figure> {
        self.picture.figures.iter().filter(|figure| figure.is_alive)
    }

    /// What happens on the ground, the least important first.
    fn battle(&self) -> Vec<Shape> {
        let mut shapes = self.sight();
        for dead in self
            .picture
            .figures
            .iter()
            .filter(|figure| !figure.is_alive)
        {
            shapes.extend(cross(self.place(dead.at), 0.28 * self.unit));
        }
        shapes.extend(self.living().filter_map(|figure| self.trail(figure)));
        if let Some(lens) = &self.picture.lens {
            shapes.extend(lens::rings(self, lens));
        }
        shapes.extend(self.picture.shots.iter().flat_map(|shot| self.shot(*shot)));
        for figure in self.living() {
            let radius = figure.radius * self.unit;
            shapes.extend(body(self.place(figure.at), figure, radius));
        }
        // Over the bodies, so that a melee hides none.
        shapes.extend(self.picture.links.iter().flat_map(|pair| self.link(*pair)));
        for missile in &self.picture.missiles {
            shapes.push(filled(&circle(self.place(*missile), 3.6, 16), PAPER, 1.0));
            shapes.push(filled(&circle(self.place(*missile), 2.6, 16), INK, 1.0));
        }
        for figure in self.living() {
            let (at, radius) = (self.place(figure.at), figure.radius * self.unit);
            shapes.extend(bars(at, figure, radius));
            if self.unit >= NAMES_FROM {
                shapes.extend(name_tag(at, figure, radius));
            }
        }
        shapes
    }

    /// What is seen: by any ally, or by the agents that the lens names.
    fn sight(&self) -> Vec<Shape> {
        if let Some(lens) = &self.picture.lens {
            return lens::fields(self, lens);
        }
        let allies = || self.living().filter(|figure| figure.side == Side::Ally);
        let opacity = (SIGHT_OPACITY / allies().count().max(1) as f64).min(0.05);
        let field = |ally: &Figure| circle(self.place(ally.at), self.picture.sight * self.unit, 96);
        allies()
            .map(|ally| filled(&field(ally), Side::Ally.colour(), opacity))
            .collect()
    }

    /// The band between two agents that were paired, from body to body.
    fn link(&self, pair: Link) -> Vec<Shape> {
        let members = pair.members.map(|index| &self.picture.figures[index]);
        let [from, to] = members.map(|figure| self.place(figure.at));
        let length = (to[0] - from[0]).hypot(to[1] - from[1]).max(1.0);
        let along = |part: f64| [0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis]));
        let [first, last] =
            members.map(|figure| (0.62 * figure.radius * self.unit / length).min(0.4));
        link([along(first), along(1.0 - last)], pair.is_joint)
    }

    /// Where a unit came from in this step.
    fn trail(&self, figure: &Figure) -> Option<Shape> {
        let ends = [figure.from, figure.at].map(|at| self.place(at));
        let wedge = wedge(ends, 0.55 * figure.radius * self.unit)?;
        Some(filled(&wedge, figure.side.colour(), 0.3))
    }

    /// A line from the attacker's edge to the target's: full if it attacked, dashed if it aims.
    fn shot(&self, shot: Shot) -> Vec<Shape> {
        let figures = &self.picture.figures;
        let (attacker, target) = (&figures[shot.from], &figures[shot.to]);
        let [from, to] = [attacker, target].map(|figure| self.place(figure.at));
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let near = (attacker.radius + target.radius) * self.unit;
        if length <= near + 1.0 {
            return Vec::new();
        }
        let along = |distance: f64| {
            [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * distance / length)
        };
        let tip = along(length - target.radius * self.unit - 1.0);
        let colour = attacker.side.colour();
        let width = if shot.has_fired { 1.8 } else { 1.0 };
        let tail = along(attacker.radius * self.unit);
        let mut shapes = vec![open(&[tail, tip], colour, width, !shot.has_fired)];
        if shot.has_fired {
            let back = along(length - target.radius * self.unit - 8.0);
            let head = wedge([tip, back], 3.4);
            shapes.extend(head.map(|head| filled(&head, colour, 1.0)));
        }
        shapes
    }
}

/// A triangle with its point at the first end and `half_width` to either side of the other; `None` if it is too short to see.
pub(super) fn wedge([point, base]: [[f64; 2]; 2], half_width: f64) -> Option<[[f64; 2]; 3]> {
    let along = [0, 1].map(|axis| base[axis] - point[axis]);
    let length = along[0].hypot(along[1]);
    let side = [-along[1], along[0]].map(|part| part / length * half_width);
    (length >= 3.0).then_some([
        point,
        [base[0] + side[0], base[1] + side[1]],
        [base[0] - side[0], base[1] - side[1]],
    ])
}
