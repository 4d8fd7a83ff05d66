//! Writes a scene as SVG. Words stay words, so that they can be searched, copied and restyled.

use std::fmt::Write;

use super::{
    chart::Colour,
    scene::{Anchor, Direction, Scene, Shape, Weight, Words},
};

/// The document; `title` is what screen readers say.
pub(super) fn write(scene: &Scene, title: &str) -> String {
    let (width, height) = (scene.width, scene.height);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\" \
         font-family=\"Roboto, 'Helvetica Neue', Arial, sans-serif\">\n\
         <title>{}</title>\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n",
        escape(title),
    );
    for (number, panel) in scene.panels.iter().enumerate() {
        let area = panel.area;
        let (left, top) = (area.left, area.top);
        let (across, down) = (area.right - left, area.bottom - top);
        out += &format!(
            "<clipPath id=\"panel-{number}\"><rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{across:.2}\" \
             height=\"{down:.2}\"/></clipPath>\n"
        );
        let clipped = format!("<g clip-path=\"url(#panel-{number})\">");
        for (group, shapes) in [
            ("<g>", &panel.background),
            (&*clipped, &panel.data),
            ("<g>", &panel.foreground),
        ] {
            out += group;
            out.push('\n');
            shapes.iter().for_each(|shape| out += &element(shape));
            out += "</g>\n";
        }
    }
    out.push_str("</svg>\n");
    out
}

fn element(shape: &Shape) -> String {
    match shape {
        Shape::Polygon {
            points,
            colour,
            opacity,
        } => format!(
            "<polygon points=\"{}\" fill=\"{}\" fill-opacity=\"{opacity}\"/>\n",
            coordinates(points),
            hexadecimal(*colour),
        ),
        Shape::Line {
            points,
            colour,
            width,
            stroke,
        } => {
            let dashes = stroke.pattern().map_or_else(String::new, |[dash, gap]| {
                format!(" stroke-dasharray=\"{dash} {gap}\"")
            });
            format!(
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" \
                 stroke-linejoin=\"round\"{dashes}/>\n",
                coordinates(points),
                hexadecimal(*colour),
            )
        }
        Shape::Ring {
            centre: [x, y],
            radius,
            colour,
            width,
        } => format!(
            "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius}\" fill=\"#ffffff\" stroke=\"{}\" \
             stroke-width=\"{width}\"/>\n",
            hexadecimal(*colour),
        ),
        Shape::Words(words) => text(words),
    }
}

fn text(words: &Words) -> String {
    let [x, y] = words.at;
    let anchor = match words.anchor {
        Anchor::Start => "",
        Anchor::Middle => " text-anchor=\"middle\"",
        Anchor::End => " text-anchor=\"end\"",
    };
    let weight = match words.weight {
        Weight::Regular => "",
        Weight::Medium => " font-weight=\"500\"",
    };
    let turn = match words.direction {
        Direction::Rightwards => String::new(),
        Direction::Upwards => format!(" transform=\"rotate(-90 {x:.2} {y:.2})\""),
    };
    format!(
        "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{}\" fill=\"{}\"{anchor}{weight}{turn}>{}</text>\n",
        words.size,
        hexadecimal(words.colour),
        escape(&words.text),
    )
}

fn coordinates(points: &[[f64; 2]]) -> String {
    let mut out = String::new();
    for (index, [x, y]) in points.iter().enumerate() {
        let space = if index == 0 { "" } else { " " };
        write!(out, "{space}{x:.2},{y:.2}").expect("writing to a string cannot fail");
    }
    out
}

fn hexadecimal(Colour(red, green, blue): Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn escape(text: &str) -> String {
    (text.replace('&', "&amp;").replace('<', "&lt;")).replace('>', "&gt;")
}
