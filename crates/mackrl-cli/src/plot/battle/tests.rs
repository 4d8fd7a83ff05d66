use mackrl_run::replay::Shot;
use tiny_skia::Pixmap;

use super::*;
use crate::plot::png;

fn figure(side: Side, x: f64, life: f64) -> Figure {
    Figure {
        side,
        kind: "marine".to_owned(),
        name: "A".to_owned(),
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
        links: Vec::new(),
        lens: None,
    }
}

fn count(picture: &BattlePicture, Colour(red, green, blue): Colour) -> usize {
    let image = png::write(&Drawing::new(picture).scene()).unwrap();
    let image = Pixmap::decode_png(&image).unwrap();
    let same =
        |p: &&tiny_skia::PremultipliedColorU8| [p.red(), p.green(), p.blue()] == [red, green, blue];
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
    let area = scene.panels[0].area;
    assert_eq!(
        area.right - area.left,
        8.0 * 52.0,
        "the map is 8 cells wide"
    );
    assert_eq!(ground::cells([10.5, 12.5], 8, 32), [7, 15]);
    assert_eq!(ground::cells([-1.0, 2.0], 8, 32), [0, 7]);
}
