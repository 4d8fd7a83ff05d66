//! What letters, bars and lines of pictures mean: those that occur.

use std::collections::BTreeMap;

use super::{
    BattlePicture, Figure, INK, Lens, Side,
    drawing::{HEAL, wedge},
    lens::{APART, COMMON, MUTUAL, PRIVATE},
    marks::{bar, body, circle, closed, cross, filled, link, missile, open},
};
use crate::plot::{chart::Colour, legend::Entry, scene::Stroke};

/// One entry for each kind of thing that is in some of the pictures.
pub(super) fn entries(pictures: &[BattlePicture]) -> Vec<Entry> {
    let mut entries = kinds(pictures);
    entries.extend(events(pictures));
    entries.extend(knowledge(pictures));
    entries
}

fn kinds(pictures: &[BattlePicture]) -> Vec<Entry> {
    let mut kinds: BTreeMap<(Side, &str), &Figure> = BTreeMap::new();
    for figure in pictures.iter().flat_map(BattlePicture::living) {
        kinds.entry((figure.side, &figure.kind)).or_insert(figure);
    }
    let kinds = kinds.into_iter().map(|((side, kind), figure)| {
        let owner = match side {
            Side::Ally => "ally",
            Side::Enemy => "enemy",
        };
        let mark = body([9.0, 0.0], figure, 9.0, 1.0);
        Entry::new(18.0, format!("{kind} ({owner})"), mark)
    });
    kinds.collect()
}

fn events(pictures: &[BattlePicture]) -> Vec<Entry> {
    let shots = || pictures.iter().flat_map(BattlePicture::shots_apart);
    let figures = || pictures.iter().flat_map(|picture| &picture.figures);
    let line =
        |colour, width, stroke| vec![open(&[[0.0, 0.0], [22.0, 0.0]], colour, width, stroke)];
    let life = |colour: Colour| vec![bar([0.0, -2.5], [20.0, 4.0], colour, 1.0)];
    let moved = wedge([[20.0, 0.0], [0.0, 0.0]], 5.0).map(|wedge| filled(&wedge, INK, 0.3));
    let is_healing = |[from, to]: [&Figure; 2]| from.side == to.side;
    let all = [
        (
            shots().any(|(shot, ends)| shot.has_fired && !is_healing(ends)),
            Entry::new(22.0, "attacks", line(INK, 1.8, Stroke::Solid)),
        ),
        (
            shots().any(|(shot, _)| !shot.has_fired),
            Entry::new(22.0, "aims", line(INK, 1.0, Stroke::Dashed)),
        ),
        (
            shots().any(|(shot, ends)| shot.has_fired && is_healing(ends)),
            Entry::new(22.0, "heals", line(HEAL, 1.8, Stroke::Solid)),
        ),
        (
            pictures.iter().any(|picture| !picture.missiles.is_empty()),
            Entry::new(8.0, "missile", missile([4.0, 0.0])),
        ),
        (
            figures().any(Figure::is_moving),
            Entry::new(20.0, "moves", moved.into_iter().collect()),
        ),
        (
            figures().any(|figure| figure.is_alive),
            Entry::new(20.0, "life", life(INK)),
        ),
        (
            figures().any(|figure| figure.is_alive && figure.shield.is_some()),
            Entry::new(20.0, "shields", life(Colour::SKY)),
        ),
        (
            figures().any(|figure| !figure.is_alive),
            Entry::new(14.0, "fell here", cross([7.0, 0.0], 5.0)),
        ),
    ];
    occurring(all)
}

fn knowledge(pictures: &[BattlePicture]) -> Vec<Entry> {
    let links = |is_joint: bool| {
        let mut links = pictures.iter().flat_map(|picture| &picture.links);
        links.any(|link| link.is_joint == is_joint)
    };
    let ends = [[0.0, 0.0], [24.0, 0.0]];
    let mut entries = occurring([
        (
            links(true),
            Entry::new(24.0, "paired, acts jointly", link(ends, true)),
        ),
        (
            links(false),
            Entry::new(24.0, "paired, delegates", link(ends, false)),
        ),
    ]);
    let disc = circle([8.0, 0.0], 7.0, 40);
    let field = vec![filled(&disc, Side::Ally.colour(), 0.2)];
    let lenses: Vec<&Lens> = pictures
        .iter()
        .filter_map(|picture| picture.lens.as_ref())
        .collect();
    let (Some(lens), Some(picture)) = (lenses.first(), pictures.first()) else {
        let is_seen = pictures.iter().any(|picture| picture.allies().count() > 0);
        let mark = Entry::new(16.0, "seen by an ally, darker by more", field);
        entries.extend(occurring([(is_seen, mark)]));
        return entries;
    };
    let names = |separator: &str| {
        let names = lens
            .members
            .iter()
            .map(|index| picture.figures[*index].name.as_str());
        names.collect::<Vec<_>>().join(separator)
    };
    let (both, one) = match lens.members.len() {
        2 => ("both", names(" or ")),
        _ => ("all", format!("some of {}", names(", "))),
    };
    let all_names = names(", ");
    let is_alone = lens.members.len() < 2;
    let ring = |colour, width, stroke| vec![closed(&disc, colour, width, stroke)];
    let member = lenses
        .iter()
        .any(|lens| lens.fields.iter().any(|index| lens.members.contains(index)));
    let other = lenses.iter().any(|lens| {
        lens.fields
            .iter()
            .any(|index| !lens.members.contains(index))
    });
    let has = |of: fn(&Lens) -> &Vec<usize>| lenses.iter().any(|lens| !of(lens).is_empty());
    let common = vec![
        filled(&disc, COMMON, 0.28),
        closed(&disc, COMMON, 2.4, Stroke::Solid),
    ];
    let pale = pictures.iter().find_map(BattlePicture::unseen);
    entries.extend(occurring([
        (
            member,
            Entry::new(
                16.0,
                format!("field of view of {all_names}"),
                [field, ring(Side::Ally.colour(), 1.6, Stroke::Solid)].concat(),
            ),
        ),
        (
            other,
            Entry::new(16.0, "of another agent", ring(APART, 1.4, Stroke::Dashed)),
        ),
        (
            has(|lens| &lens.common),
            Entry::new(
                16.0,
                if is_alone {
                    format!("{all_names} sees it")
                } else {
                    format!("common knowledge of {all_names}")
                },
                common,
            ),
        ),
        (
            has(|lens| &lens.mutual),
            Entry::new(
                16.0,
                format!("{both} see it, not common knowledge"),
                ring(MUTUAL, 2.4, Stroke::Dashed),
            ),
        ),
        (
            has(|lens| &lens.private),
            Entry::new(
                16.0,
                format!("only {one} sees it"),
                ring(PRIVATE, 2.4, Stroke::Dotted),
            ),
        ),
    ]));
    let pale = pale.map(|figure| {
        let mark = body([9.0, 0.0], figure, 9.0, super::drawing::PALE);
        Entry::new(18.0, "not seen by the group", mark)
    });
    entries.extend(pale);
    entries
}

/// The entries of what occurs.
fn occurring<const N: usize>(all: [(bool, Entry); N]) -> Vec<Entry> {
    let occurring = all.into_iter().filter(|(occurs, _)| *occurs);
    occurring.map(|(_, entry)| entry).collect()
}
