//! What letters, bars and lines of a picture mean.

use std::collections::BTreeMap;

use super::{
    BattlePicture, Figure, INK, Side,
    drawing::wedge,
    lens::{COMMON, OTHER},
    marks::{bar, body, circle, closed, closed_dashed, cross, filled, link, moved, open, words},
};
use crate::plot::{
    chart::Colour,
    scene::{Rectangle, Shape, Weight},
    text,
};

/// Pixels of a row.
const ROW: f64 = 22.0;
/// Pixels between the arena and the first row.
const GAP: f64 = 14.0;
/// Height of an em.
const SIZE: f64 = 12.5;

/// The legend below the arena.
pub(super) struct Legend {
    pub(super) shapes: Vec<Shape>,
    /// Pixels that it takes, the gap above included.
    pub(super) height: f64,
}

/// A mark, with its width and what it means.
struct Entry {
    width: f64,
    meaning: String,
    mark: Vec<Shape>,
}

/// The legend of all that is in the picture, below `area`.
pub(super) fn of(picture: &BattlePicture, area: Rectangle) -> Legend {
    let mut entries = kinds(picture);
    entries.extend(events(picture));
    entries.extend(knowledge(picture));
    flow(entries, area)
}

fn entry(width: f64, meaning: &str, mark: Vec<Shape>) -> Entry {
    Entry {
        width,
        meaning: meaning.to_owned(),
        mark,
    }
}

fn kinds(picture: &BattlePicture) -> Vec<Entry> {
    let mut kinds: BTreeMap<(Side, &str), &Figure> = BTreeMap::new();
    for figure in &picture.figures {
        kinds.entry((figure.side, &figure.kind)).or_insert(figure);
    }
    let kinds = kinds.into_iter().map(|((side, kind), figure)| {
        let owner = match side {
            Side::Ally => "ally",
            Side::Enemy => "enemy",
        };
        let mark = body([9.0, 0.0], figure, 9.0);
        entry(18.0, &format!("{kind} ({owner})"), mark)
    });
    kinds.collect()
}

fn events(picture: &BattlePicture) -> Vec<Entry> {
    let line = |dashed: bool| {
        let width = if dashed { 1.0 } else { 1.8 };
        vec![open(&[[0.0, 0.0], [22.0, 0.0]], INK, width, dashed)]
    };
    let life = |colour: Colour| vec![bar([0.0, -2.5], [20.0, 4.0], colour, 1.0)];
    let moved = wedge([[0.0, 0.0], [20.0, 0.0]], 5.0).map(|wedge| filled(&wedge, INK, 0.3));
    let mut entries = vec![
        entry(22.0, "attacked in this step", line(false)),
        entry(22.0, "aims", line(true)),
        entry(20.0, "moved in this step", moved.into_iter().collect()),
        entry(20.0, "life", life(INK)),
    ];
    if picture.figures.iter().any(|figure| figure.shield.is_some()) {
        entries.push(entry(20.0, "shields", life(Colour::SKY)));
    }
    entries.push(entry(14.0, "fell here", cross([7.0, 0.0], 5.0)));
    entries
}

fn knowledge(picture: &BattlePicture) -> Vec<Entry> {
    let mut entries = Vec::new();
    for (is_joint, meaning) in [
        (true, "paired, acted jointly"),
        (false, "paired, delegated"),
    ] {
        if picture.links.iter().any(|link| link.is_joint == is_joint) {
            let mark = link([[0.0, 0.0], [24.0, 0.0]], is_joint);
            entries.push(entry(24.0, meaning, mark));
        }
    }
    let disc = circle([8.0, 0.0], 7.0, 40);
    let blue = Side::Ally.colour();
    let Some(lens) = &picture.lens else {
        let seen = vec![filled(&disc, blue, 0.2)];
        entries.push(entry(16.0, "seen by an ally, darker by more", seen));
        return entries;
    };
    let name = |index: &usize| picture.figures[*index].name.as_str();
    let members: Vec<&str> = lens.members.iter().map(name).collect();
    let members = members.join(", ");
    let field = vec![filled(&disc, blue, 0.12), closed(&disc, blue, 1.6)];
    entries.push(entry(16.0, &format!("seen by {members}"), field));
    let common = vec![filled(&disc, COMMON, 0.28), closed(&disc, COMMON, 2.4)];
    let meaning = format!("common knowledge of {members}");
    entries.push(entry(16.0, &meaning, common));
    if !lens.other.is_empty() {
        let other = vec![closed_dashed(&disc, OTHER, 2.2)];
        let meaning = format!("seen, but not common knowledge of {members}");
        entries.push(entry(16.0, &meaning, other));
    }
    entries
}

/// Sets entries one after the other into rows below `area`.
fn flow(entries: Vec<Entry>, area: Rectangle) -> Legend {
    let (mut left, mut row) = (area.left, 0);
    let mut placed = Vec::new();
    for entry in entries {
        let words_width = text::width(&entry.meaning, SIZE, Weight::Regular);
        let width = entry.width + 7.0 + words_width + 20.0;
        if left + width > area.right + 20.0 && left > area.left {
            (left, row) = (area.left, row + 1);
        }
        let middle = area.bottom + GAP + (f64::from(row) + 0.5) * ROW;
        let mark = entry.mark.into_iter();
        placed.extend(mark.map(|shape| moved(shape, [left, middle])));
        let at = [left + entry.width + 7.0, middle + 0.36 * SIZE];
        placed.push(words(&entry.meaning, at, SIZE, Weight::Regular, INK));
        left += width;
    }
    Legend {
        shapes: placed,
        height: GAP + f64::from(row + 1) * ROW,
    }
}
