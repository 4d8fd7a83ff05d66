//! Draws a scene as a PNG image, with smooth edges, at twice the SVG's size.

use anyhow::Context as _;
use tiny_skia::{
    FillRule, LineCap, LineJoin, Mask, Paint, Path, PathBuilder, Pixmap, StrokeDash, Transform,
};
use ttf_parser::OutlineBuilder;

use super::{
    chart::Colour,
    scene::{Anchor, Direction, Scene, Shape, Stroke, Words},
    text,
};

/// Image pixels per unit of the scene.
const SCALE: u16 = 2;

/// The encoded image.
pub(super) fn write(scene: &Scene) -> anyhow::Result<Vec<u8>> {
    draw(scene, SCALE)?
        .encode_png()
        .context("encoding the chart as PNG")
}

/// The image, with `scale` pixels per unit of the scene.
pub(super) fn draw(scene: &Scene, scale: u16) -> anyhow::Result<Pixmap> {
    let [width, height] = [scene.width, scene.height].map(|size| u32::from(size * scale));
    let mut canvas = Canvas {
        pixmap: Pixmap::new(width, height).context("the chart has no area")?,
        transform: Transform::from_scale(f32::from(scale), f32::from(scale)),
        mask: None,
    };
    canvas.pixmap.fill(tiny_skia::Color::WHITE);
    for panel in &scene.panels {
        panel.background.iter().for_each(|shape| canvas.draw(shape));
        let mut mask = Mask::new(width, height).context("the chart has no area")?;
        if let Some(area) = polygon(&panel.area.corners()) {
            mask.fill_path(&area, FillRule::Winding, true, canvas.transform);
        }
        canvas.mask = Some(mask);
        panel.data.iter().for_each(|shape| canvas.draw(shape));
        canvas.mask = None;
        panel.foreground.iter().for_each(|shape| canvas.draw(shape));
    }
    Ok(canvas.pixmap)
}

struct Canvas {
    pixmap: Pixmap,
    transform: Transform,
    mask: Option<Mask>,
}

impl Canvas {
    fn draw(&mut self, shape: &Shape) {
        match shape {
            Shape::Polygon {
                points,
                colour,
                opacity,
            } => self.fill(polygon(points), *colour, *opacity),
            Shape::Line {
                points,
                colour,
                width,
                stroke,
            } => self.stroke(line(points), *colour, *width, *stroke),
            Shape::Ring {
                centre: [x, y],
                radius,
                colour,
                width,
            } => {
                let circle = PathBuilder::from_circle(single(*x), single(*y), single(*radius));
                self.fill(circle.clone(), Colour(0xFF, 0xFF, 0xFF), 1.0);
                self.stroke(circle, *colour, *width, Stroke::Solid);
            }
            Shape::Words(words) => self.fill(outline(words), words.colour, 1.0),
        }
    }

    /// Fills `path`; `None` is a path without area, of which nothing can be seen.
    fn fill(&mut self, path: Option<Path>, colour: Colour, opacity: f64) {
        if let Some(path) = path {
            let (paint, mask) = (paint(colour, opacity), self.mask.as_ref());
            self.pixmap
                .fill_path(&path, &paint, FillRule::Winding, self.transform, mask);
        }
    }

    fn stroke(&mut self, path: Option<Path>, colour: Colour, width: f64, stroke: Stroke) {
        let pattern = stroke.pattern();
        let stroke = tiny_skia::Stroke {
            width: single(width),
            line_cap: LineCap::Butt,
            line_join: LineJoin::Round,
            dash: pattern.and_then(|pattern| StrokeDash::new(pattern.to_vec(), 0.0)),
            ..tiny_skia::Stroke::default()
        };
        if let Some(path) = path {
            let (paint, mask) = (paint(colour, 1.0), self.mask.as_ref());
            self.pixmap
                .stroke_path(&path, &paint, &stroke, self.transform, mask);
        }
    }
}

fn paint(Colour(red, green, blue): Colour, opacity: f64) -> Paint<'static> {
    let mut colour = tiny_skia::Color::from_rgba8(red, green, blue, u8::MAX);
    colour.set_alpha(single(opacity));
    let mut paint = Paint {
        anti_alias: true,
        ..Paint::default()
    };
    paint.set_color(colour);
    paint
}

fn line(points: &[[f64; 2]]) -> Option<Path> {
    let mut builder = PathBuilder::new();
    add_line(&mut builder, points);
    builder.finish()
}

fn polygon(points: &[[f64; 2]]) -> Option<Path> {
    let mut builder = PathBuilder::new();
    add_line(&mut builder, points);
    builder.close();
    builder.finish()
}

fn add_line(builder: &mut PathBuilder, points: &[[f64; 2]]) {
    for (index, [x, y]) in points.iter().enumerate() {
        if index == 0 {
            builder.move_to(single(*x), single(*y));
        } else {
            builder.line_to(single(*x), single(*y));
        }
    }
}

/// The outline of words, in the scene's coordinates.
fn outline(words: &Words) -> Option<Path> {
    let width = text::width(&words.text, words.size, words.weight);
    let before = match words.anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => width / 2.0,
        Anchor::End => width,
    };
    let mut pen = Pen {
        path: PathBuilder::new(),
        start: 0.0,
    };
    text::outline(&words.text, words.weight, &mut pen, |pen, start| {
        pen.start = single(start);
    });
    let scale = single(words.size) / f32::from(text::font(words.weight).units_per_em());
    let turned = match words.direction {
        Direction::Rightwards => Transform::identity(),
        Direction::Upwards => Transform::from_rotate(-90.0),
    };
    let [x, y] = words.at;
    let placed = Transform::from_scale(scale, -scale)
        .post_translate(-single(before), 0.0)
        .post_concat(turned)
        .post_translate(single(x), single(y));
    pen.path.finish()?.transform(placed)
}

/// Collects glyphs, each moved to where it starts.
struct Pen {
    path: PathBuilder,
    start: f32,
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.path.move_to(self.start + x, y);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        self.path.line_to(self.start + x, y);
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.path.quad_to(self.start + x1, y1, self.start + x, y);
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let start = self.start;
        self.path
            .cubic_to(start + x1, y1, start + x2, y2, start + x, y);
    }
    fn close(&mut self) {
        self.path.close();
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "a picture is far smaller than what f32 resolves"
)]
const fn single(value: f64) -> f32 {
    value as f32
}
