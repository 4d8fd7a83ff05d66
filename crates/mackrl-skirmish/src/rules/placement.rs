//! Where the units of a group appear: the places of a map, and how far from them a battle begins.

use std::{collections::BTreeMap, sync::LazyLock};

use crate::{
    rules::{
        Battle, BattleState, Chance, Profile,
        movement::{Footing, on_grid},
    },
    terrain::Terrain,
    unit_types::Layer,
};

/// A place that somebody has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taken {
    /// Its centre.
    pub at: [f32; 2],
    /// Separation radius of who is there.
    pub radius: f32,
    /// Layer of who is there.
    pub layer: Layer,
}

/// Edge of the lattice on which places are tried, in map units.
const LATTICE: f32 = 0.25;
/// Lattice steps from the point to the farthest place tried.
const REACH: i32 = 64;
/// Rounds of pushing apart after a scatter, at most; a few suffice where there is room.
const SCATTER_ROUNDS: usize = 32;

/// Finds places for units of the given profiles around a point: each takes the free place nearest to the point, so the first
/// stands on it and the others surround it compactly. Of equally near places those towards `front`, where the other side is,
/// are taken first, then those of smaller y: armies that face each other stand as mirror images.
///
/// The engine's own search is not known; this stands in for it. `taken` holds everybody placed before and is
/// extended.
///
/// Returns `None` if there is no room.
#[must_use]
pub fn spread_around(
    point: [f32; 2],
    front: [f32; 2],
    profiles: &[&Profile],
    terrain: &Terrain,
    taken: &mut Vec<Taken>,
) -> Option<Vec<[f32; 2]>> {
    let mut offsets = Offsets::new([front[0] - point[0], front[1] - point[1]]);
    profiles
        .iter()
        .map(|profile| {
            let mut tried = 0;
            let place = loop {
                let (dy, dx) = offsets.get(tried)?;
                let place = [
                    point[0] + dx as f32 * LATTICE,
                    point[1] + dy as f32 * LATTICE,
                ];
                if is_free(place, profile, terrain, taken) {
                    break place;
                }
                tried += 1;
            };
            taken.push(Taken {
                at: place,
                radius: profile.separation_radius,
                layer: profile.layer,
            });
            Some(place)
        })
        .collect()
}

/// Steps (dy, dx) on the lattice from a point, the nearest first, and of equally near ones those that lead forward.
///
/// A group stands within a few rings of its point, so a ring is sorted when it is reached: sorting the whole lattice took
/// nine tenths of the time in which a world is built.
struct Offsets {
    forward: [f32; 2],
    /// Those of the rings reached so far.
    sorted: Vec<(i32, i32)>,
    rings: std::slice::Iter<'static, Vec<(i32, i32)>>,
}

impl Offsets {
    fn new(forward: [f32; 2]) -> Self {
        Self {
            forward,
            sorted: Vec::new(),
            rings: rings().iter(),
        }
    }

    /// Number `index` of them, unless all have been given.
    fn get(&mut self, index: usize) -> Option<(i32, i32)> {
        while index >= self.sorted.len() {
            let [x, y] = self.forward;
            // Adding zero turns −0 into 0, so that places beside the point are equally far ahead for either army.
            let ahead = |(dy, dx): (i32, i32)| dx as f32 * x + dy as f32 * y + 0.0;
            let begin = self.sorted.len();
            self.sorted.extend(self.rings.next()?);
            self.sorted[begin..].sort_by(|a, b| ahead(*b).total_cmp(&ahead(*a)));
        }
        Some(self.sorted[index])
    }
}

/// The steps (dy, dx) on the lattice that are equally long, for every length from 0 on; of these, those of smaller dy first,
/// then those of smaller dx.
fn rings() -> &'static [Vec<(i32, i32)>] {
    static RINGS: LazyLock<Vec<Vec<(i32, i32)>>> = LazyLock::new(|| {
        let mut rings = BTreeMap::<i32, Vec<(i32, i32)>>::new();
        for dy in -REACH..=REACH {
            for dx in -REACH..=REACH {
                rings.entry(dx * dx + dy * dy).or_default().push((dy, dx));
            }
        }
        rings.into_values().collect()
    });
    &RINGS
}

impl Battle {
    /// Moves everybody who can walk aside, by up to `scatter` map units along each axis, and lets them push one another apart:
    /// the armies of one map stand a little differently in every battle, and are no mirror images.
    ///
    /// On the bare lattice the same shots fall in the same loops in nearly every battle: two equal armies of which one attacks
    /// whoever is nearest then win all battles on one map and none on another, which no player would recognise.
    pub fn scatter(&mut self, scatter: f32, chance: &mut Chance) {
        let field = self.field.clone();
        for index in 0..self.state.units.len() {
            let profile = &field.profiles[usize::from(self.state.units[index].kind)];
            let x = self.state.x[index] + on_grid(chance.between(-scatter, scatter));
            let y = self.state.y[index] + on_grid(chance.between(-scatter, scatter));
            self.scratch.footing[index] = if profile.is_immobile() {
                Footing::Braced
            } else {
                (self.state.x[index], self.state.y[index]) =
                    off_walls([x, y], profile, &field.terrain);
                Footing::Standing
            };
        }
        self.part(SCATTER_ROUNDS);
    }

    /// Exchanges places among units of one kind so that they stand in the order of x, then y. `units` are sorted by kind.
    pub fn sort_places(&mut self, units: std::ops::Range<usize>) {
        let BattleState {
            x, y, units: who, ..
        } = &mut self.state;
        let begin = units.start;
        for sorted in units {
            let mut index = sorted;
            while index > begin
                && who[index].kind == who[index - 1].kind
                && (x[index], y[index]) < (x[index - 1], y[index - 1])
            {
                x.swap(index, index - 1);
                y.swap(index, index - 1);
                index -= 1;
            }
        }
    }
}

fn is_free([x, y]: [f32; 2], profile: &Profile, terrain: &Terrain, taken: &[Taken]) -> bool {
    let is_clear_of_units = taken.iter().all(|other| {
        let (dx, dy) = (x - other.at[0], y - other.at[1]);
        let apart = other.radius + profile.separation_radius;
        !profile.layer.collides_with(other.layer) || dx * dx + dy * dy >= apart * apart
    });
    is_clear_of_units && off_walls([x, y], profile, terrain) == (x, y)
}

/// The place nearest to (x, y), nearly, where a unit of the given profile is in no wall.
fn off_walls([x, y]: [f32; 2], profile: &Profile, terrain: &Terrain) -> (f32, f32) {
    terrain.for_layer(profile.layer).map_or_else(
        || Terrain::within_map(x, y),
        |terrain| terrain.pushed_out_of_walls(x, y, profile.inner_radius),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_in_turn_are_the_whole_lattice_sorted_at_once() {
        for forward in [[0.0, 0.0], [1.0, 0.0], [-0.0, -7.5], [13.25, 4.0]] {
            let mut expected: Vec<(i32, i32)> = (-REACH..=REACH)
                .flat_map(|dy| (-REACH..=REACH).map(move |dx| (dy, dx)))
                .collect();
            let ahead = |dy: i32, dx: i32| dx as f32 * forward[0] + dy as f32 * forward[1] + 0.0;
            expected.sort_by(|a, b| {
                let square = |(dy, dx): (i32, i32)| dx * dx + dy * dy;
                let front_first = ahead(b.0, b.1).total_cmp(&ahead(a.0, a.1));
                square(*a).cmp(&square(*b)).then(front_first).then(a.cmp(b))
            });
            let mut offsets = Offsets::new(forward);
            for (index, step) in expected.iter().enumerate() {
                assert_eq!(offsets.get(index), Some(*step), "{forward:?}, {index}");
            }
            assert_eq!(offsets.get(expected.len()), None);
        }
    }
}
