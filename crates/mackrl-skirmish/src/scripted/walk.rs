//! Which of the four moves leads where a scripted agent wants to be.

use crate::{
    actions::{DIRECTIONS, MOVES_FROM},
    scripted::sight::{Foe, Sight},
    terrain::{Terrain, cell_of},
};

/// Map units that a move is taken to go when its outcome is weighed.
const STRIDE: f32 = 1.5;
/// Map units at which a wall is too near to be comfortable, and how dangerous a wall on one side is taken to be.
const NEAR_WALL: f32 = 4.0;
const WALL_DANGER: f32 = 0.06;
/// Map units beyond which enemies are no reason to back off.
const SAFE: f32 = 6.5;

/// The available move that leads nearest to `goal`, if one leads nearer at all.
pub(super) fn towards(sight: &Sight<'_>, goal: [f32; 2]) -> Option<usize> {
    let gain = |direction: [f32; 2]| {
        let ahead = [0, 1].map(|axis| goal[axis] - sight.own[axis]);
        direction[0] * ahead[0] + direction[1] * ahead[1]
    };
    moves()
        .filter(|(action, direction)| sight.available[*action] && gain(*direction) > 0.25)
        .max_by(|a, b| gain(a.1).total_cmp(&gain(b.1)))
        .map(|(action, _)| action)
}

/// The available move that leads farthest from the near enemies that `is_feared`; none if there are none, or if standing is
/// as good.
///
/// Walls near a place make it worse: whoever backs into a corner is caught there.
pub(super) fn back_off(
    sight: &Sight<'_>,
    terrain: &Terrain,
    is_feared: impl Fn(&Foe) -> bool,
) -> Option<usize> {
    let feared: Vec<&Foe> = sight
        .foes
        .iter()
        .filter(|foe| foe.distance_squared <= SAFE * SAFE && is_feared(foe))
        .collect();
    if feared.is_empty() {
        return None;
    }
    // The nearest counts most, but one does not flee from it into the others.
    let danger = |at: [f32; 2]| -> f32 {
        let squares = feared.iter().map(|foe| distance_squared(at, foe.at));
        let walls = DIRECTIONS.iter().filter(|direction| {
            let [x, y] = [0, 1].map(|axis| at[axis] + NEAR_WALL * direction[axis]);
            !terrain.is_walkable(cell_of(x.floor()), cell_of(y.floor()))
        });
        squares.map(|square| 1.0 / (0.25 + square)).sum::<f32>()
            + WALL_DANGER * walls.count() as f32
    };
    let place = |direction: [f32; 2]| [0, 1].map(|axis| sight.own[axis] + STRIDE * direction[axis]);
    moves()
        .filter(|(action, _)| sight.available[*action])
        .map(|(action, direction)| (action, danger(place(direction))))
        .filter(|(_, danger_there)| *danger_there < danger(sight.own))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(action, _)| action)
}

/// Every move with where it leads.
fn moves() -> impl Iterator<Item = (usize, [f32; 2])> {
    (MOVES_FROM..).zip(DIRECTIONS)
}

/// Square of the distance between two points.
pub(super) fn distance_squared(a: [f32; 2], b: [f32; 2]) -> f32 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    dx * dx + dy * dy
}
