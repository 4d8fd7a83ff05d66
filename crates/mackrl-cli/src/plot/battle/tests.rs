use mackrl_env::{AgentId, EpisodeKey, Stream};
use mackrl_run::{
    config::ConfigBuilder,
    replay::{Shot, record_script},
};
use mackrl_skirmish::scripted::ScriptedPolicy;

use super::*;
use crate::{
    args::world,
    plot::{png, scene::Shape},
    replay::{Opened, picture as picture_of},
};

fn figure(side: Side, x: f64, life: f64) -> Figure {
    Figure {
        side,
        kind: "marine".to_owned(),
        letters: "M".to_owned(),
        name: "A".to_owned(),
        at: [x, 4.5],
        to: [x, 4.5],
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
        caption: String::new(),
        walkable: (0..256).map(|cell| cell / 16 >= 3).collect(),
        edge: 16,
        figures: vec![figure(Side::Ally, 2.0, 1.0), figure(Side::Enemy, 6.0, life)],
        shots: vec![Shot {
            from: 0,
            to: 1,
            has_fired: true,
        }],
        missiles: Vec::new(),
        sight: 3.0,
        links: Vec::new(),
        lens: None,
    }
}

/// A scripted battle on a map.
fn battle(map: &str) -> Opened {
    let env = world(ConfigBuilder::new(crate::registry()), "--map", map, &[]).unwrap();
    let key = EpisodeKey::new(1, Stream::Other, 0);
    Opened::of(record_script(&env, ScriptedPolicy::FocusFire, key).unwrap()).unwrap()
}

/// Its pictures, one a step.
fn pictures(opened: &Opened) -> Vec<BattlePicture> {
    let group = [0, 1].map(AgentId::new);
    let steps = 0..=opened.playback.steps();
    steps
        .flat_map(|step| {
            [
                picture_of(opened, step, &[]),
                picture_of(opened, step, &group),
            ]
        })
        .collect()
}

fn scene(picture: &BattlePicture) -> crate::plot::scene::Scene {
    let stage = Stage::of(std::slice::from_ref(picture));
    Drawing::new(picture, &stage, &[]).scene()
}

fn count(picture: &BattlePicture, Colour(red, green, blue): Colour) -> usize {
    let image = png::draw(&scene(picture), 1).unwrap();
    let same =
        |p: &&tiny_skia::PremultipliedColorU8| [p.red(), p.green(), p.blue()] == [red, green, blue];
    image.pixels().iter().filter(same).count()
}

/// What the legend of a picture says.
fn legend(picture: &BattlePicture) -> Vec<String> {
    let below = Stage::of(std::slice::from_ref(picture)).area.bottom;
    let shapes = scene(picture).panels.remove(0).foreground;
    let words = shapes.into_iter().filter_map(|shape| match shape {
        Shape::Words(words) if words.at[1] > below && words.size > 9.5 => Some(words.text),
        _ => None,
    });
    words.collect()
}

#[test]
fn the_dead_leave_the_field() {
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
fn all_units_are_inside_and_the_ground_about_them_is_bounded() {
    for map in ["3m", "2s3z", "MMM2", "27m_vs_30m"] {
        for picture in pictures(&battle(map)) {
            let stage = Stage::of(std::slice::from_ref(&picture));
            let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
            for figure in &picture.figures {
                for place in [figure.at, figure.to].map(|at| stage.place(at)) {
                    let radius = figure.radius * stage.unit;
                    for axis in [0, 1] {
                        let [first, last] = ends[axis];
                        ends[axis] = [
                            first.min(place[axis] - radius),
                            last.max(place[axis] + radius),
                        ];
                    }
                }
            }
            let area = stage.area;
            let sides = [[area.left, area.right], [area.top, area.bottom]];
            let about = ground::SURROUNDINGS * stage.unit;
            for ((side, end), least) in sides.into_iter().zip(ends).zip([560.0, 280.0]) {
                let spare = [end[0] - side[0], side[1] - end[1]];
                assert!(
                    spare.iter().all(|spare| *spare > 0.9 * about),
                    "{map}: {spare:?}"
                );
                let is_close = spare.iter().all(|spare| *spare < 1.1 * about);
                let is_least = side[1] - side[0] < 1.01 * least;
                assert!(is_close || is_least, "{map}, {}: {spare:?}", picture.title);
            }
            let [width, height] = stage.size;
            assert!(
                width <= 880.0 && height <= 800.0,
                "{map}: {width} by {height}"
            );
        }
    }
}

#[test]
fn names_cover_neither_units_nor_each_other() {
    let (mut names, mut units) = (0, 0);
    for picture in pictures(&battle("27m_vs_30m")) {
        let stage = Stage::of(std::slice::from_ref(&picture));
        let drawing = Drawing::new(&picture, &stage, &[]);
        let bodies = drawing::bodies(&picture, &stage);
        let tags: Vec<_> = drawing.tags().collect();
        for (number, tag) in tags.iter().enumerate() {
            let mut others = tags[..number].iter();
            let covered = others.find(|other| other.plate.overlaps(tag.plate));
            assert_eq!(covered.map(|other| &other.name), None, "{}", tag.name);
            let covered = bodies.iter().find(|body| body.touches(tag.plate));
            assert_eq!(covered.map(|body| &body.name), None, "{}", tag.name);
        }
        names += tags.len();
        units += bodies.len();
    }
    assert!(10 * names > 9 * units, "{names} names of {units} units");
}

#[test]
fn the_legend_says_what_occurs() {
    let kinds = ["marine (ally)", "marine (enemy)"];
    let seen = "seen by an ally, darker by more";
    let full = legend(&picture(1.0));
    assert_eq!(full, [&kinds[..], &["attacks", "life", seen]].concat());
    assert_eq!(
        legend(&picture(0.0)),
        ["marine (ally)", "attacks", "life", "fell here", seen]
    );
    let mut other = picture(1.0);
    other.shots[0].has_fired = false;
    other.figures[0].to = [3.0, 4.5];
    other.links.push(Link {
        members: [0, 1],
        is_joint: true,
    });
    let last = ["aims", "moves", "life", "paired, acts jointly", seen];
    assert_eq!(legend(&other), [&kinds[..], &last].concat());
}

#[test]
fn what_a_lens_shows_is_in_the_legend() {
    let mut lit = picture(1.0);
    lit.shots.clear();
    let other = Figure {
        name: "B".to_owned(),
        ..figure(Side::Ally, 4.0, 1.0)
    };
    lit.figures.insert(1, other);
    let lens = Lens {
        members: vec![0, 1],
        fields: vec![0, 1],
        common: vec![0, 1],
        mutual: Vec::new(),
        private: vec![2],
    };
    lit.lens = Some(lens.clone());
    let knows = [
        "field of view of A, B",
        "common knowledge of A, B",
        "only A or B sees it",
    ];
    let all = ["marine (ally)", "marine (enemy)", "life"];
    assert_eq!(legend(&lit), [&all[..], &knows].concat());
    lit.lens = Some(Lens {
        private: Vec::new(),
        ..lens
    });
    let knows = [knows[0], knows[1], "not seen by the group"];
    assert_eq!(legend(&lit), [&all[..], &knows].concat());
}

#[test]
fn the_pictures_of_a_film_have_one_size_one_ground_and_one_legend() {
    let mut far = picture(1.0);
    far.figures[1].at = [12.0, 9.5];
    far.missiles.push([5.0, 5.0]);
    let both = [picture(1.0), far];
    let stage = Stage::of(&both);
    let images: Vec<Pixmap> = film(&both).collect::<Result<_, _>>().unwrap();
    let sizes: Vec<_> = images
        .iter()
        .map(|image| [image.width(), image.height()])
        .collect();
    assert_eq!(sizes[0], sizes[1]);
    for picture in &both {
        for figure in &picture.figures {
            assert!(stage.area.holds(stage.place(figure.at)), "{figure:?}");
        }
    }
    // Everything below the arena, that is the legend, is the same.
    let width = images[0].width() as usize;
    let from = usize::from(crate::plot::scene::pixels(stage.area.bottom + 2.0)) * width;
    assert!(
        images[0].pixels()[from..] == images[1].pixels()[from..],
        "legends differ"
    );
    assert!(
        images[0].pixels()[..from] != images[1].pixels()[..from],
        "battles do not differ"
    );
}
