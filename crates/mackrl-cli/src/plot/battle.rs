//! A picture of a battle: terrain, units with life and shields, who aims at whom.
//!
//! Sides differ in colour and in shape (allies are discs, enemies diamonds), so that the picture can be read in grey. Bodies
//! have their true size; a letter names the type, and the legend explains it.

use std::collections::BTreeMap;

use super::{
    chart::Colour,
    scene::{Anchor, Direction, Rectangle, Scene, Shape, Weight, Words},
    svg, text,
};

/// Width in pixels that the arena is fitted to.
const WIDTH: f64 = 840.0;
/// Least and greatest pixels of a map unit.
const UNIT: [f64; 2] = [24.0, 52.0];
/// Pixels between the arena and the edge of the picture.
const MARGIN: f64 = 16.0;
/// Pixels above the arena, for the title.
const HEAD: f64 = 58.0;
/// Pixels of a row of the legend.
const LEGEND_ROW: f64 = 22.0;
/// Cells around the units that are shown too.
const SURROUNDINGS: f64 = 3.0;
/// Least cells shown along x and along y.
const WINDOW_MIN: [usize; 2] = [18, 12];
/// Opacity where all allies see.
const SIGHT_OPACITY: f64 = 0.22;

const GROUND: Colour = Colour(0xF4, 0xF1, 0xEA);
const GRID: Colour = Colour(0xE6, 0xE1, 0xD6);
const WALL: Colour = Colour(0xC9, 0xC4, 0xB8);
const INK: Colour = Colour(0x2B, 0x2B, 0x2B);
const FAINT: Colour = Colour(0x70, 0x70, 0x70);
const PAPER: Colour = Colour(0xFF, 0xFF, 0xFF);
const EMPTY_BAR: Colour = Colour(0xD8, 0xD8, 0xD8);

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
    /// Its number within its side.
    pub(crate) number: usize,
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

/// A unit that aims at another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shot {
    /// Index of the attacker among the figures.
    pub(crate) from: usize,
    /// Index of the target.
    pub(crate) to: usize,
    /// Whether it attacked in this step; otherwise it only aims.
    pub(crate) has_fired: bool,
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

    /// The picture as a PNG image.
    ///
    /// # Errors
    /// If the image cannot be encoded.
    pub(crate) fn to_png(&self) -> anyhow::Result<Vec<u8>> {
        super::png::write(&Drawing::new(self).scene())
    }
}

/// A picture on its way to a scene.
struct Drawing<'a> {
    picture: &'a BattlePicture,
    /// First and last cell shown along x, and along y.
    window: [[usize; 2]; 2],
    /// Pixels of a map unit.
    unit: f64,
}

impl<'a> Drawing<'a> {
    fn new(picture: &'a BattlePicture) -> Self {
        let window = [0, 1].map(|axis| {
            let places = || picture.figures.iter().map(|figure| figure.at[axis]);
            let first = places().fold(f64::INFINITY, f64::min) - SURROUNDINGS;
            let last = places().fold(f64::NEG_INFINITY, f64::max) + SURROUNDINGS;
            cells([first, last], WINDOW_MIN[axis], picture.edge)
        });
        let columns = (window[0][1] + 1 - window[0][0]) as f64;
        let unit = (WIDTH / columns).clamp(UNIT[0], UNIT[1]);
        Self {
            picture,
            window,
            unit,
        }
    }

    fn scene(&self) -> Scene {
        let [columns, rows] = self.window.map(|[first, last]| (last + 1 - first) as f64);
        let area = Rectangle {
            left: MARGIN,
            top: HEAD,
            right: MARGIN + columns * self.unit,
            bottom: HEAD + rows * self.unit,
        };
        let legend = self.legend(area);
        let rows = legend
            .iter()
            .map(|(row, _)| row + 1)
            .max()
            .unwrap_or_default();
        let mut foreground = vec![
            words(
                &self.picture.title,
                [area.left, 26.0],
                17.0,
                Weight::Medium,
                INK,
            ),
            words(
                &self.picture.subtitle,
                [area.left, 46.0],
                12.5,
                Weight::Regular,
                FAINT,
            ),
            closed(&area.corners(), WALL, 1.0),
        ];
        foreground.extend(legend.into_iter().flat_map(|(_, shapes)| shapes));
        let height = area.bottom + 14.0 + rows as f64 * LEGEND_ROW + 8.0;
        Scene {
            width: pixels(area.right + MARGIN),
            height: pixels(height),
            plot_area: area,
            background: self.ground(area),
            data: self.battle(),
            foreground,
        }
    }

    /// From map units to pixels.
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [[first_x, _], [_, last_y]] = self.window;
        [
            MARGIN + (x - first_x as f64) * self.unit,
            HEAD + (last_y as f64 + 1.0 - y) * self.unit,
        ]
    }

    /// Walls, ground and a fine grid on it. Cells side by side are one shape.
    fn ground(&self, area: Rectangle) -> Vec<Shape> {
        let mut shapes = vec![filled(&area.corners(), WALL, 1.0)];
        let [[first_x, last_x], [first_y, last_y]] = self.window;
        let is_ground = |x: usize, y: usize| self.picture.walkable[y * self.picture.edge + x];
        for y in first_y..=last_y {
            let mut x = first_x;
            while x <= last_x {
                let start = x;
                while x <= last_x && is_ground(x, y) {
                    x += 1;
                }
                if x > start {
                    let [left, bottom] = self.place([start as f64, y as f64]);
                    let [right, top] = self.place([x as f64, y as f64 + 1.0]);
                    // A hair of overlap, so that no seam shows between rows.
                    let bottom = (bottom + 0.4).min(area.bottom);
                    let row = Rectangle {
                        left,
                        top,
                        right,
                        bottom,
                    };
                    shapes.push(filled(&row.corners(), GROUND, 1.0));
                }
                x += 1;
            }
        }
        let even = |first: usize, last: usize| (first..=last + 1).filter(|line| line % 4 == 0);
        for x in even(first_x, last_x) {
            let ends = [[x, first_y], [x, last_y + 1]];
            let ends = ends.map(|end| self.place(end.map(|c| c as f64)));
            shapes.push(open(&ends, GRID, 1.0, false));
        }
        for y in even(first_y, last_y) {
            let ends = [[first_x, y], [last_x + 1, y]];
            let ends = ends.map(|end| self.place(end.map(|c| c as f64)));
            shapes.push(open(&ends, GRID, 1.0, false));
        }
        shapes
    }

    /// What happens on the ground, the least important first.
    fn battle(&self) -> Vec<Shape> {
        let figures = &self.picture.figures;
        let mut shapes = Vec::new();
        let living = || figures.iter().filter(|figure| figure.is_alive);
        let allies = living().filter(|figure| figure.side == Side::Ally).count();
        let sight = (SIGHT_OPACITY / allies.max(1) as f64).min(0.05);
        for ally in living().filter(|figure| figure.side == Side::Ally) {
            let circle = circle(self.place(ally.at), self.picture.sight * self.unit, 96);
            shapes.push(filled(&circle, Side::Ally.colour(), sight));
        }
        for dead in figures.iter().filter(|figure| !figure.is_alive) {
            shapes.extend(cross(self.place(dead.at), 0.28 * self.unit));
        }
        for figure in living() {
            shapes.extend(self.trail(figure));
        }
        for shot in &self.picture.shots {
            shapes.extend(self.shot(*shot));
        }
        for figure in living() {
            shapes.extend(body(
                self.place(figure.at),
                figure,
                figure.radius * self.unit,
            ));
        }
        for missile in &self.picture.missiles {
            shapes.push(filled(&circle(self.place(*missile), 3.6, 16), PAPER, 1.0));
            shapes.push(filled(&circle(self.place(*missile), 2.6, 16), INK, 1.0));
        }
        for figure in living() {
            shapes.extend(bars(
                self.place(figure.at),
                figure,
                figure.radius * self.unit,
            ));
        }
        shapes
    }

    /// Where a unit came from in this step.
    fn trail(&self, figure: &Figure) -> Option<Shape> {
        let [from, to] = [figure.from, figure.at].map(|at| self.place(at));
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let width = 0.55 * figure.radius * self.unit;
        if length < 3.0 {
            return None;
        }
        let side = [-(to[1] - from[1]), to[0] - from[0]].map(|part| part / length * width);
        let wedge = [
            from,
            [to[0] + side[0], to[1] + side[1]],
            [to[0] - side[0], to[1] - side[1]],
        ];
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
            let side = [-(to[1] - from[1]), to[0] - from[0]].map(|part| part / length * 3.4);
            let head = [
                tip,
                [back[0] + side[0], back[1] + side[1]],
                [back[0] - side[0], back[1] - side[1]],
            ];
            shapes.push(filled(&head, colour, 1.0));
        }
        shapes
    }

    /// What letters, bars and lines mean; each entry with the row that it stands in.
    fn legend(&self, area: Rectangle) -> Vec<(usize, Vec<Shape>)> {
        let mut kinds: BTreeMap<(Side, &str), &Figure> = BTreeMap::new();
        for figure in &self.picture.figures {
            kinds.entry((figure.side, &figure.kind)).or_insert(figure);
        }
        let mut entries: Vec<(f64, String, Vec<Shape>)> = Vec::new();
        for ((side, kind), figure) in kinds {
            let owner = match side {
                Side::Ally => "ally",
                Side::Enemy => "enemy",
            };
            entries.push((
                18.0,
                format!("{kind} ({owner})"),
                body([9.0, 0.0], figure, 9.0),
            ));
        }
        let line = |dashed: bool| {
            let width = if dashed { 1.0 } else { 1.8 };
            vec![open(&[[0.0, 0.0], [22.0, 0.0]], INK, width, dashed)]
        };
        entries.push((22.0, "attacked in this step".to_owned(), line(false)));
        entries.push((22.0, "aims".to_owned(), line(true)));
        entries.push((
            20.0,
            "life".to_owned(),
            vec![bar([0.0, -2.5], [20.0, 4.0], INK, 1.0)],
        ));
        if self
            .picture
            .figures
            .iter()
            .any(|figure| figure.shield.is_some())
        {
            let shield = vec![bar([0.0, -2.5], [20.0, 4.0], Colour::SKY, 1.0)];
            entries.push((20.0, "shields".to_owned(), shield));
        }
        entries.push((14.0, "fell here".to_owned(), cross([7.0, 0.0], 5.0)));
        let seen = filled(&circle([8.0, 0.0], 8.0, 40), Side::Ally.colour(), 0.2);
        entries.push((
            16.0,
            "seen by an ally, darker by more".to_owned(),
            vec![seen],
        ));
        flow(entries, area)
    }
}

/// Sets entries one after the other into rows below `area`.
fn flow(entries: Vec<(f64, String, Vec<Shape>)>, area: Rectangle) -> Vec<(usize, Vec<Shape>)> {
    const SIZE: f64 = 12.5;
    let (mut left, mut row) = (area.left, 0);
    let mut placed = Vec::new();
    for (symbol, name, shapes) in entries {
        let width = symbol + 7.0 + text::width(&name, SIZE, Weight::Regular) + 20.0;
        if left + width > area.right + 20.0 && left > area.left {
            (left, row) = (area.left, row + 1);
        }
        let middle = area.bottom + 14.0 + (row as f64 + 0.5) * LEGEND_ROW;
        let mut shapes: Vec<Shape> = shapes
            .into_iter()
            .map(|shape| moved(shape, [left, middle]))
            .collect();
        let at = [left + symbol + 7.0, middle + 0.36 * SIZE];
        shapes.push(words(&name, at, SIZE, Weight::Regular, INK));
        placed.push((row, shapes));
        left += width;
    }
    placed
}

/// A disc or a diamond with the letter of its type.
fn body(at: [f64; 2], figure: &Figure, radius: f64) -> Vec<Shape> {
    let outline = |radius: f64| match figure.side {
        Side::Ally => circle(at, radius, 40),
        // As large as the disc of the same radius.
        Side::Enemy => circle(at, 1.2533 * radius, 4),
    };
    let mut shapes = vec![
        filled(&outline(radius + 1.4), PAPER, 1.0),
        filled(&outline(radius), figure.side.colour(), 1.0),
    ];
    let size = (1.05 * radius).clamp(6.0, 22.0);
    let letters = figure.kind.chars().take(1);
    let letter: String = letters.flat_map(char::to_uppercase).collect();
    // In the upper part, because bars stand in the lower.
    let at = [at[0], at[1] + 0.36 * size - 0.28 * radius];
    shapes.push(Shape::Words(Words {
        anchor: Anchor::Middle,
        ..label(&letter, at, size, Weight::Medium, PAPER)
    }));
    shapes
}

/// Life and below it shields, on the body: bars beside it would lie on its neighbours.
fn bars(at: [f64; 2], figure: &Figure, radius: f64) -> Vec<Shape> {
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

/// The `length` cells or more between two places, as far as there are so many, as first and last.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the map"
)]
fn cells([first, last]: [f64; 2], length_min: usize, edge: usize) -> [usize; 2] {
    let greatest = edge.saturating_sub(1);
    let cell = |place: f64| place.floor().clamp(0.0, greatest as f64) as usize;
    let (mut first, mut last) = (cell(first), cell(last));
    while last + 1 - first < length_min.min(edge) {
        first = first.saturating_sub(1);
        last = (last + 1).min(greatest);
    }
    [first, last]
}

/// A bar of which `share` is filled.
fn bar([left, top]: [f64; 2], [width, height]: [f64; 2], colour: Colour, share: f64) -> Shape {
    let rectangle = Rectangle {
        left,
        top,
        right: left + width * share,
        bottom: top + height,
    };
    filled(&rectangle.corners(), colour, 1.0)
}

/// Where somebody fell.
fn cross([x, y]: [f64; 2], arm: f64) -> Vec<Shape> {
    let line = |ends: [[f64; 2]; 2]| open(&ends, Colour(0x9A, 0x95, 0x8A), 2.2, false);
    vec![
        line([[x - arm, y - arm], [x + arm, y + arm]]),
        line([[x - arm, y + arm], [x + arm, y - arm]]),
    ]
}

/// A regular polygon, which with many corners is a circle; the first corner is to the east.
fn circle([x, y]: [f64; 2], radius: f64, corners: u16) -> Vec<[f64; 2]> {
    let turn = std::f64::consts::TAU / f64::from(corners);
    (0..corners)
        .map(|corner| {
            let (sine, cosine) = (turn * f64::from(corner)).sin_cos();
            [x + radius * cosine, y + radius * sine]
        })
        .collect()
}

fn filled(points: &[[f64; 2]], colour: Colour, opacity: f64) -> Shape {
    Shape::Polygon {
        points: points.to_vec(),
        colour,
        opacity,
    }
}

fn open(points: &[[f64; 2]], colour: Colour, width: f64, dashed: bool) -> Shape {
    Shape::Line {
        points: points.to_vec(),
        colour,
        width,
        dashed,
    }
}

fn closed(points: &[[f64; 2]], colour: Colour, width: f64) -> Shape {
    let points: Vec<[f64; 2]> = points.iter().chain(points.first()).copied().collect();
    open(&points, colour, width, false)
}

fn words(text: &str, at: [f64; 2], size: f64, weight: Weight, colour: Colour) -> Shape {
    Shape::Words(label(text, at, size, weight, colour))
}

fn label(text: &str, at: [f64; 2], size: f64, weight: Weight, colour: Colour) -> Words {
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

fn moved(mut shape: Shape, [dx, dy]: [f64; 2]) -> Shape {
    let by = |point: &mut [f64; 2]| *point = [point[0] + dx, point[1] + dy];
    match &mut shape {
        Shape::Polygon { points, .. } | Shape::Line { points, .. } => {
            points.iter_mut().for_each(by);
        }
        Shape::Ring { centre, .. } => by(centre),
        Shape::Words(words) => by(&mut words.at),
    }
    shape
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a picture has fewer than 65 536 pixels along an edge"
)]
fn pixels(length: f64) -> u16 {
    length.ceil() as u16
}

#[cfg(test)]
mod tests {
    use tiny_skia::Pixmap;

    use super::*;

    fn figure(side: Side, x: f64, life: f64) -> Figure {
        Figure {
            side,
            kind: "marine".to_owned(),
            number: 0,
            at: [x, 4.5],
            from: [x, 4.5],
            radius: 0.375,
            is_alive: life > 0.0,
            life,
            shield: None,
        }
    }

    fn picture(life: f64) -> BattlePicture {
        BattlePicture {
            title: "test".to_owned(),
            subtitle: "seed 1".to_owned(),
            walkable: (0..64).map(|cell| cell / 8 >= 3).collect(),
            edge: 8,
            figures: vec![figure(Side::Ally, 2.0, 1.0), figure(Side::Enemy, 6.0, life)],
            shots: vec![Shot {
                from: 0,
                to: 1,
                has_fired: true,
            }],
            missiles: Vec::new(),
            sight: 3.0,
        }
    }

    fn count(picture: &BattlePicture, Colour(red, green, blue): Colour) -> usize {
        let image = Pixmap::decode_png(&picture.to_png().unwrap()).unwrap();
        let same = |p: &&tiny_skia::PremultipliedColorU8| {
            [p.red(), p.green(), p.blue()] == [red, green, blue]
        };
        image.pixels().iter().filter(same).count()
    }

    #[test]
    fn the_dead_leave_the_field_and_only_their_legend_stays() {
        let enemy = Side::Enemy.colour();
        let (living, dead) = (count(&picture(1.0), enemy), count(&picture(0.0), enemy));
        assert!(living > dead + 100, "{living} pixels living, {dead} dead");
    }

    #[test]
    fn less_life_is_a_shorter_bar() {
        let (full, half) = (count(&picture(1.0), INK), count(&picture(0.5), INK));
        assert!(full > half + 20, "{full} pixels full, {half} half");
    }

    #[test]
    fn the_window_is_as_large_as_asked_and_inside_the_map() {
        let scene = Drawing::new(&picture(1.0)).scene();
        let area = scene.plot_area;
        let unit = UNIT[1];
        assert_eq!(
            area.right - area.left,
            8.0 * unit,
            "the map is 8 cells wide"
        );
        assert_eq!(cells([10.5, 12.5], 8, 32), [7, 15]);
        assert_eq!(cells([-1.0, 2.0], 8, 32), [0, 7]);
    }
}
