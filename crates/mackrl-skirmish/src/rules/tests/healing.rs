//! Medivacs.

use super::*;

/// A medivac of the given stance and a marine of 10 life at a distance.
fn ward(stance: Stance, distance: f32) -> (Arena, UnitIndex, UnitIndex) {
    let mut arena = Arena::new();
    let medivac = arena.add("medivac", Ally, stance, [10.0, 16.0]);
    let marine = arena.add("marine", Ally, Passive, [10.0 + distance, 16.0]);
    arena.unit(marine).life = 10.0;
    (arena, medivac, marine)
}

#[test]
fn a_medivac_heals_nine_points_a_second_for_a_third_of_energy_each() {
    let (mut arena, medivac, marine) = ward(Passive, 3.0);
    arena.battle.order(medivac, Order::Heal { target: marine });
    arena.loops(16);
    assert!((arena.unit(marine).life - 19.0).abs() < 1e-4, "a second");
    let energy = arena.unit(medivac).energy;
    assert!(
        (energy - (50.0 - 2.97 + 0.5625)).abs() < 1e-3,
        "{energy} left"
    );
    arena.loops(80);
    assert_eq!(arena.unit(marine).life, 45.0, "and no more");
    assert_eq!(arena.unit(medivac).order, Order::Stop);
}

#[test]
fn without_energy_nothing_is_healed() {
    let (mut arena, medivac, marine) = ward(Passive, 3.0);
    arena.unit(medivac).energy = 0.33;
    arena.battle.order(medivac, Order::Heal { target: marine });
    arena.loops(16);
    // One point at once, then what 0.5625 of energy a second are worth, the last loop's not yet spent.
    let healed = arena.unit(marine).life - 10.0;
    let most = 1.0 + 0.5625 / 0.33;
    assert!((most - 0.2..=most).contains(&healed), "{healed}");
}

#[test]
fn healing_has_a_range_of_four_from_edge_to_edge() {
    for (distance, heals) in [(5.125, true), (5.13, false)] {
        let (mut arena, medivac, marine) = ward(Passive, distance);
        arena.battle.order(medivac, Order::Heal { target: marine });
        arena.loops(1);
        assert_eq!(arena.unit(marine).life > 10.0, heals, "at {distance}");
        arena.loops(10);
        assert!(arena.unit(marine).life > 10.0, "it flies closer");
    }
}

#[test]
fn only_aggressive_medivacs_choose_patients_and_only_with_some_energy() {
    for (stance, energy, heals) in [
        (Passive, 50.0, false),
        (Aggressive, 50.0, true),
        (Aggressive, 4.0, false),
    ] {
        let (mut arena, medivac, marine) = ward(stance, 7.0);
        arena.unit(medivac).energy = energy;
        arena.loops(24);
        assert_eq!(
            arena.unit(marine).life > 10.0,
            heals,
            "{stance:?}, {energy}"
        );
    }
}

#[test]
fn the_whole_the_mechanical_and_the_enemy_are_not_healed() {
    let (mut arena, medivac, marine) = ward(Passive, 3.0);
    let whole = arena.add("marauder", Ally, Passive, [10.0, 18.0]);
    let stalker = arena.add("stalker", Ally, Passive, [10.0, 14.0]);
    let enemy = arena.add("marine", Enemy, Passive, [8.0, 16.0]);
    for hurt in [stalker, enemy] {
        arena.unit(hurt).life = 10.0;
    }
    let order = Order::Heal { target: marine };
    arena.battle.order(medivac, order);
    for refused in [whole, stalker, enemy, medivac] {
        arena.battle.order(medivac, Order::Heal { target: refused });
        assert_eq!(arena.unit(medivac).order, order, "goes on with the marine");
    }
}

#[test]
fn a_medivac_takes_more_than_a_second_to_full_speed() {
    let mut arena = Arena::new();
    let medivac = arena.add("medivac", Ally, Passive, [2.0, 16.0]);
    arena
        .battle
        .order(medivac, Order::Move { to: [30.0, 16.0] });
    arena.loops(16);
    let first = arena.at(medivac)[0] - 2.0;
    assert!(
        (first - 0.5 * 2.3125 * (17.0 / 16.0)).abs() < 1e-3,
        "{first} in a second"
    );
    arena.loops(16);
    let before = arena.at(medivac)[0];
    arena.loops(16);
    let last = arena.at(medivac)[0] - before;
    assert!((last - 2.75).abs() < 1e-3, "{last} in the third second");
}

#[test]
fn flyers_pass_over_everybody_and_over_walls() {
    let mut arena = Arena::on(TerrainName::Lane, [0.0, 0.0]);
    let medivac = arena.add("medivac", Ally, Passive, [10.0, 10.0]);
    let below = arena.add("marine", Enemy, Passive, [10.0, 9.0]);
    arena.battle.order(medivac, Order::Move { to: [10.0, 4.0] });
    arena.loops(80);
    assert_eq!(arena.at(medivac), [10.0, 4.0]);
    assert_eq!(arena.at(below), [10.0, 9.0]);
}

#[test]
fn weapons_against_the_ground_do_not_reach_flyers() {
    for (name, reaches) in [
        ("marine", true),
        ("marauder", false),
        ("stalker", true),
        ("zealot", false),
        ("hydralisk", true),
        ("colossus", false),
        ("zergling", false),
        ("baneling", false),
        ("spine-crawler", false),
    ] {
        let mut arena = Arena::new();
        let attacker = arena.add(name, Enemy, Aggressive, [10.0, 16.0]);
        let medivac = arena.add("medivac", Ally, Passive, [11.0, 16.0]);
        arena.loops(30);
        assert_eq!(arena.unit(medivac).life < 150.0, reaches, "{name}");
        assert_eq!(arena.unit(attacker).quarry.is_some(), reaches, "{name}");
    }
}

#[test]
fn a_medivac_sent_to_attack_stays_with_the_fighters() {
    let mut arena = Arena::new();
    let medivac = arena.add("medivac", Enemy, Aggressive, [23.0, 16.0]);
    let marine = arena.add("marine", Enemy, Aggressive, [23.0, 14.0]);
    arena
        .battle
        .order(medivac, Order::AttackMove { to: [9.0, 16.0] });
    arena.loops(60);
    let [x, _] = arena.at(medivac);
    assert!(x > 17.5, "it is alone at {x}");
    arena.unit(marine).life = 0.0;
    arena.loops(160);
    assert_eq!(
        arena.at(medivac),
        [9.0, 16.0],
        "nobody is left to stay with"
    );
}
