//! Colossi: beams and long legs.

use super::*;

#[test]
fn two_beams_of_twenty_strike_the_target_after_six_loops() {
    let (mut arena, _, stalker) = duel("colossus", "stalker", 5.0);
    // Damage point 1.33 loops: the sweep starts in loop 2.
    arena.loops(8);
    assert_eq!(arena.unit(stalker).shield, 80.0);
    arena.loops(1);
    assert_eq!(arena.unit(stalker).shield, 40.0);
    arena.loops(34);
    assert_eq!(
        arena.unit(stalker).shield,
        40.0,
        "35.2 loops from attack to attack"
    );
    arena.loops(2);
    assert_eq!(arena.unit(stalker).shield, 0.0);
}

#[test]
fn beams_burn_a_line_across_the_target_and_spare_friends() {
    let (mut arena, _, target) = duel("colossus", "zealot", 5.0);
    let beside = arena.add("zealot", Enemy, Passive, [15.0, 17.8]);
    let beyond = arena.add("zealot", Enemy, Passive, [15.0, 14.05]);
    let behind = arena.add("zealot", Enemy, Passive, [15.8, 16.0]);
    let friend = arena.add("zealot", Ally, Passive, [15.0, 15.2]);
    arena.loops(14);
    for (unit, shield, place) in [
        (target, 10.0, "the target"),
        (beside, 10.0, "1.8 to the side: 1.25 + 0.15 + 0.5"),
        (beyond, 50.0, "1.95 to the side"),
        (behind, 50.0, "behind the target"),
        (friend, 50.0, "a friend"),
    ] {
        assert_eq!(arena.unit(unit).shield, shield, "{place}");
    }
}

#[test]
fn a_zergling_in_the_line_dies_of_both_beams() {
    let (mut arena, _, target) = duel("colossus", "zergling", 5.0);
    let other = arena.add("zergling", Enemy, Passive, [15.0, 16.8]);
    arena.loops(14);
    assert_eq!(
        (arena.unit(target).life, arena.unit(other).life),
        (0.0, 0.0)
    );
}

#[test]
fn colossi_walk_over_troops_but_not_through_each_other() {
    let mut arena = Arena::new();
    let colossus = arena.add("colossus", Ally, Passive, [10.0, 16.0]);
    let enemy = arena.add("zealot", Enemy, Passive, [12.0, 16.0]);
    arena
        .battle
        .order(colossus, Order::Move { to: [14.0, 16.0] });
    arena.loops(40);
    assert_eq!(arena.at(colossus), [14.0, 16.0]);
    assert_eq!(arena.at(enemy), [12.0, 16.0]);
    let other = arena.add("colossus", Ally, Passive, [14.2, 16.0]);
    arena.loops(60);
    let distance = arena
        .battle
        .state
        .distance_squared(0, usize::from(other))
        .sqrt();
    assert!(distance > 1.49, "{distance} apart");
}

#[test]
fn weapons_against_air_reach_a_colossus_too() {
    let mut data = (*UnitTypes::load(UnitData::Liberty).unwrap()).clone();
    for unit in &mut data.types {
        if let Some(weapon) = &mut unit.weapon {
            weapon.targets = vec![crate::unit_types::Plane::Air];
        }
    }
    let types: Vec<&UnitType> = data.types.iter().collect();
    let field = Battlefield::new(Terrain::named(TerrainName::Open), &data, &types);
    for (target, effect) in types
        .iter()
        .zip(&field.profiles[0].strike.as_ref().unwrap().effects)
    {
        let is_high = ["colossus", "medivac"].contains(&target.name.as_str());
        assert_eq!(effect.can_hit, is_high, "{}", target.name);
    }
}

#[test]
fn a_colossus_walks_over_the_cliff_and_zerglings_run_round() {
    let mut arena = Arena::on(TerrainName::Plateau, [0.0, 0.0]);
    let colossus = arena.add("colossus", Ally, Passive, [16.0, 16.0]);
    let zergling = arena.add("zergling", Enemy, Aggressive, [16.0, 9.0]);
    arena.battle.order(zergling, Order::Hunt);
    let loops = arena.loops_until(|state| state.units[0].shield < 150.0);
    // Over the ramps it is some 30 map units, at 2.9531 a second.
    assert!((120..200).contains(&loops), "{loops} loops");
    arena.unit(zergling).life = 0.0;
    arena
        .battle
        .order(colossus, Order::Move { to: [16.0, 9.0] });
    arena.loops(60);
    assert_eq!(arena.at(colossus), [16.0, 9.0]);
}

#[test]
fn a_marauder_missile_does_twice_its_damage_to_the_armoured() {
    for (target, damage) in [("marauder", 19.0), ("marine", 10.0)] {
        let (mut arena, _, other) = duel("marauder", target, 6.0);
        let full = arena.unit(other).life;
        arena.loops_until(|state| state.units[1].life < full);
        assert_eq!(full - arena.unit(other).life, damage, "{target}");
        arena.loops(23);
        assert_eq!(full - arena.unit(other).life, damage, "24 loops a shot");
        arena.loops(1);
        assert_eq!(full - arena.unit(other).life, 2.0 * damage);
    }
}
