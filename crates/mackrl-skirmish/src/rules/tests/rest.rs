//! What holds of any crowd on any ground: nobody in a wall, and nobody inside another once all stand still.

use proptest::prelude::*;

use super::*;

const TERRAINS: [TerrainName; 8] = [
    TerrainName::Lane,
    TerrainName::Open,
    TerrainName::Octagon,
    TerrainName::Arena6h,
    TerrainName::Arena2s,
    TerrainName::WindingSlope,
    TerrainName::Corridor,
    TerrainName::Plateau,
];
const TYPES: [&str; 7] = [
    "marine", "marauder", "stalker", "zealot", "zergling", "colossus", "medivac",
];

/// Somewhere a unit of this kind can stand, from two numbers in [0, 1).
fn place(arena: &Arena, kind: usize, [u, v]: [f32; 2]) -> [f32; 2] {
    let profile = &arena.battle.field.profiles[kind];
    let (mut x, mut y) = Terrain::within_map(u * 32.0, v * 32.0);
    if let Some(terrain) = arena.battle.field.terrain.for_layer(profile.layer) {
        while !terrain.is_walkable(cell_of(x), cell_of(y)) {
            // The golden ratio visits every place sooner or later.
            x = (x + 0.618 * 32.0) % 32.0;
            y = (y + 0.382 * 32.0) % 32.0;
        }
        (x, y) = terrain.pushed_out_of_walls(x, y, profile.inner_radius);
    }
    [x, y]
}

fn check_walls(arena: &Arena) {
    let (state, field) = (&arena.battle.state, &arena.battle.field);
    for (index, unit) in state.units.iter().enumerate() {
        let profile = &field.profiles[usize::from(unit.kind)];
        let (x, y) = (state.x[index], state.y[index]);
        if let Some(terrain) = field.terrain.for_layer(profile.layer) {
            let (free_x, free_y) = terrain.pushed_out_of_walls(x, y, profile.inner_radius - 0.01);
            let depth = (free_x - x).abs() + (free_y - y).abs();
            assert!(
                depth < 1e-4,
                "{} stands {depth} deep in a wall at {x}, {y}",
                profile.name
            );
        }
    }
}

fn check_gaps(arena: &Arena) {
    let (state, field) = (&arena.battle.state, &arena.battle.field);
    let profile = |index: usize| &field.profiles[usize::from(state.units[index].kind)];
    for a in 0..state.units.len() {
        for b in 0..a {
            let touch = profile(a).separation_radius + profile(b).separation_radius;
            let gap = state.distance_squared(a, b).sqrt() - touch;
            assert!(
                gap > -0.02 || !profile(a).layer.collides_with(profile(b).layer),
                "{} and {} are {gap} apart at {:?} and {:?}",
                profile(a).name,
                profile(b).name,
                [state.x[a], state.y[a]],
                [state.x[b], state.y[b]]
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_crowd_that_walked_anywhere_stands_apart_and_off_the_walls(
        terrain in 0..TERRAINS.len(),
        crowd in prop::collection::vec((0..TYPES.len(), [0.0..1.0_f32, 0.0..1.0], [0.0..1.0_f32, 0.0..1.0]), 2..17),
    ) {
        let mut arena = Arena::on(TERRAINS[terrain], [0.0, 0.0]);
        for (name, from, to) in crowd {
            let profiles = &arena.battle.field.profiles;
            let kind = profiles.iter().position(|profile| profile.name == TYPES[name]).unwrap();
            let (from, to) = (place(&arena, kind, from), place(&arena, kind, to));
            let unit = arena.add(TYPES[name], Ally, Passive, from);
            arena.battle.order(unit, Order::Move { to });
        }
        for _ in 0..120 {
            arena.loops(1);
            check_walls(&arena);
        }
        for unit in 0..arena.battle.state.units.len() {
            arena.battle.order(u8::try_from(unit).unwrap(), Order::Stop);
        }
        arena.loops(100);
        check_walls(&arena);
        check_gaps(&arena);
    }
}
