//! Weapons: periods, damage, range, missiles, and what breaks an attack off.

use super::*;

#[test]
fn a_marine_kills_a_zealot_in_29_shots() {
    // 8 shots leave 2 of 50 shield; the 9th takes them and 6 − 2 − 1 life; 97 life go by 5. The 29th shot starts
    // 28 · 13.7728 loops after the first and lands 0.8 loops later, in loop number 387 counted from 0.
    let (mut arena, _, zealot) = duel("marine", "zealot", 3.0);
    arena.loops(111);
    assert_eq!(
        (arena.unit(zealot).shield, arena.unit(zealot).life),
        (2.0, 100.0)
    );
    arena.loops(1);
    assert_eq!(
        (arena.unit(zealot).shield, arena.unit(zealot).life),
        (0.0, 97.0)
    );
    let loops = arena.loops_until(|state| !state.units[1].is_alive());
    assert_eq!(loops + 112, 388);
}

#[test]
fn a_stalker_shoots_every_23_loops_and_a_twenty_fifth() {
    // Damage point 2.672 loops, period 23.04: shots leave in loops 3, 26, 49, ... and 25 periods later one loop more.
    let (mut arena, stalker, _) = duel("stalker", "marauder", 6.0);
    arena.battle.state.units[1].life = 1e5;
    let mut shots = Vec::new();
    for number in 0..600 {
        let before = arena.unit(stalker).cooldown;
        arena.loops(1);
        if arena.unit(stalker).cooldown > before + 1.0 {
            shots.push(number);
        }
    }
    assert_eq!(shots[..4], [3, 26, 49, 72]);
    assert_eq!(shots[25], 579, "25 periods are 576 loops");
}

#[test]
fn jitter_lengthens_a_period_by_minus_1_to_2_loops() {
    let mut arena = Arena::on(TerrainName::Open, [-0.0625, 0.125]);
    let marine = arena.add("marine", Ally, Passive, [10.0, 16.0]);
    let target = arena.add("zealot", Enemy, Passive, [13.0, 16.0]);
    arena.attack(marine, target);
    let mut drawn = Vec::new();
    for _ in 0..20_000 {
        arena.loops(1);
        arena.unit(target).life = 100.0;
        let cooldown = arena.unit(marine).cooldown;
        if cooldown > 11.0 && drawn.last().is_none_or(|last: &f32| cooldown > last - 0.5) {
            drawn.push(cooldown);
        } else if cooldown < 1.0 {
            drawn.push(0.0);
        }
    }
    let shots: Vec<f32> = drawn
        .into_iter()
        .filter(|cooldown| *cooldown > 0.0)
        .collect();
    // Set at a time 0.8 to 2 loops into the attack.
    assert!(
        shots
            .iter()
            .all(|cooldown| (10.77..=14.98).contains(cooldown)),
        "out of bounds"
    );
    let mean = shots.iter().sum::<f32>() / shots.len() as f32;
    assert!(
        (12.0..14.0).contains(&mean) && shots.len() > 1000,
        "{} shots, mean {mean}",
        shots.len()
    );
}

#[test]
fn bonus_damage_is_for_the_armoured_alone() {
    for (target, damage) in [("marauder", 10.0 + 4.0 - 1.0), ("marine", 10.0)] {
        let (mut arena, _, other) = duel("stalker", target, 3.0);
        let full = arena.unit(other).life;
        arena.loops(20);
        assert_eq!(
            full - arena.unit(other).life,
            damage,
            "stalker against {target}"
        );
    }
}

#[test]
fn a_zealot_strikes_twice_a_third_of_a_second_apart() {
    let (mut arena, _, marine) = duel("zealot", "marine", 0.9);
    arena.loops(1);
    assert_eq!(arena.unit(marine).life, 37.0, "the first blade");
    arena.loops(4);
    assert_eq!(arena.unit(marine).life, 37.0, "0.28 s are 4.48 loops");
    arena.loops(1);
    assert_eq!(arena.unit(marine).life, 29.0, "the second blade");
    arena.loops(13);
    assert_eq!(
        arena.unit(marine).life,
        29.0,
        "19.2 loops from attack to attack"
    );
    arena.loops(2);
    assert_eq!(arena.unit(marine).life, 21.0, "the next attack");
}

#[test]
fn a_second_blade_falls_with_its_zealot() {
    let (mut arena, zealot, marine) = duel("zealot", "marine", 0.9);
    arena.loops(2);
    arena.unit(zealot).life = 0.0;
    arena.loops(10);
    assert_eq!(arena.unit(marine).life, 37.0);
    assert!(arena.battle.state.blows.is_empty(), "the blow is forgotten");
}

#[test]
fn armour_counts_per_hit_and_never_takes_all() {
    // A hit of 6 finds 5.8 of shield: 0.2 meet an armour of 1, and half a point of damage is done all the same.
    let (mut arena, _, zealot) = duel("marine", "zealot", 3.0);
    arena.unit(zealot).shield = 5.8;
    arena.loops(2);
    assert_eq!(
        (arena.unit(zealot).shield, arena.unit(zealot).life),
        (0.0, 99.5)
    );
}

#[test]
fn a_missile_in_flight_outlives_its_shooter() {
    let (mut arena, stalker, marine) = duel("stalker", "marine", 6.5);
    arena.loops_until(|state| !state.missiles.is_empty());
    arena.unit(stalker).life = 0.0;
    assert_eq!(arena.unit(marine).life, 45.0);
    // 6.5 less the target's radius of 0.375 at 18.75 / 16 a loop: in the sixth loop, of which one is over.
    arena.loops(4);
    assert_eq!(arena.unit(marine).life, 45.0);
    arena.loops(1);
    assert_eq!(arena.unit(marine).life, 35.0);
}

#[test]
fn a_missile_is_lost_with_its_target() {
    let (mut arena, _, marine) = duel("stalker", "marine", 6.5);
    arena.loops_until(|state| !state.missiles.is_empty());
    arena.unit(marine).life = 0.0;
    arena.loops(1);
    assert!(arena.battle.state.missiles.is_empty(), "nothing to hit");
}

#[test]
fn range_is_from_edge_to_edge() {
    // Marines: 5 + 0.375 + 0.375.
    for (distance, shoots) in [(5.75, true), (5.76, false)] {
        let (mut arena, marine, _) = duel("marine", "marine", distance);
        arena.loops(1);
        assert_eq!(arena.unit(marine).swing.is_some(), shoots, "at {distance}");
    }
}

#[test]
fn an_attack_order_walks_into_range_and_shoots() {
    let (mut arena, marine, other) = duel("marine", "marine", 7.0);
    // 1.25 to go at 0.140625 a loop: 9 loops, then one to start and one to the damage point.
    let loops = arena.loops_until(|state| state.units[1].life < 45.0);
    assert_eq!(loops, 11);
    let distance = arena
        .battle
        .state
        .distance_squared(usize::from(marine), usize::from(other))
        .sqrt();
    assert!((5.6..=5.75).contains(&distance), "stopped at {distance}");
}

#[test]
fn an_attack_is_lost_if_its_target_gets_beyond_the_slop() {
    for (distance, is_hit) in [(6.7, true), (6.8, false)] {
        let (mut arena, _, other) = duel("marine", "marine", 5.7);
        arena.loops(1);
        arena.battle.state.x[usize::from(other)] = 10.0 + distance;
        arena.loops(1);
        assert_eq!(
            arena.unit(other).life < 45.0,
            is_hit,
            "at {distance}, slop 1"
        );
    }
}

#[test]
fn repeating_an_order_keeps_the_attack_and_another_breaks_it_off() {
    let (mut arena, stalker, marine) = duel("stalker", "marine", 3.0);
    arena.loops(2);
    assert_eq!(arena.unit(stalker).swing, Some(1.0));
    arena.attack(stalker, marine);
    assert_eq!(arena.unit(stalker).swing, Some(1.0), "the same order");
    arena.battle.order(stalker, Order::Stop);
    arena.loops(30);
    assert_eq!(
        arena.unit(marine).life,
        45.0,
        "broken off before the damage point"
    );
    assert_eq!(arena.unit(stalker).cooldown, 0.0, "and nothing spent");
}

#[test]
fn both_die_who_kill_each_other_in_one_loop() {
    let mut arena = Arena::new();
    let one = arena.add("marine", Ally, Passive, [10.0, 16.0]);
    let other = arena.add("marine", Enemy, Aggressive, [13.0, 16.0]);
    arena.attack(one, other);
    arena.loops_until(|state| state.units.iter().any(|unit| !unit.is_alive()));
    assert_eq!((arena.unit(one).life, arena.unit(other).life), (0.0, 0.0));
}

#[test]
fn a_spine_crawler_strikes_the_armoured_harder_and_never_moves() {
    let mut arena = Arena::new();
    let spine = arena.add("spine-crawler", Enemy, Aggressive, [10.0, 16.0]);
    let stalker = arena.add("stalker", Ally, Passive, [18.5, 16.0]);
    let pusher = arena.add("stalker", Enemy, Passive, [8.0, 16.0]);
    arena.battle.order(pusher, Order::Move { to: [14.0, 16.0] });
    // Damage point 0.3332 s: 5.33 loops. Distance 8.5 = 7 + 0.875 + 0.625.
    arena.loops(6);
    assert_eq!(arena.unit(stalker).shield, 80.0);
    arena.loops(1);
    assert_eq!(
        arena.unit(stalker).shield,
        50.0,
        "25 and 5 more against armour"
    );
    arena.battle.state.x[usize::from(stalker)] = 25.0;
    arena.loops(60);
    assert_eq!(arena.at(spine), [10.0, 16.0]);
    assert_eq!(arena.at(pusher), [14.0, 16.0], "round it");
}

#[test]
fn missiles_fly_at_the_speed_of_their_data() {
    for (name, speed) in [
        ("marauder", 20.0),
        ("stalker", 18.75),
        ("hydralisk", 40.0_f32),
    ] {
        let (mut arena, _, marine) = duel(name, "marine", 5.5);
        arena.loops_until(|state| !state.missiles.is_empty());
        let flight = arena.loops_until(|state| state.units[usize::from(marine)].life < 45.0);
        // To the target's edge, the first loop's flight already over.
        let expected = ((5.5 - 0.375) / (speed / 16.0)).ceil() - 1.0;
        assert_eq!(flight as f32, expected, "{name}");
    }
}

#[test]
fn a_weapon_reloads_while_its_unit_walks() {
    let (mut arena, marine, other) = duel("marine", "zealot", 3.0);
    arena.loops_until(|state| state.units[1].shield < 50.0);
    arena.battle.order(marine, Order::Move { to: [9.0, 16.0] });
    arena.loops(7);
    assert!(
        arena.at(marine)[0] < 9.1,
        "another order ends the backswing"
    );
    arena.attack(marine, other);
    // 13.77 loops from shot to shot, walking or not.
    let loops = arena.loops_until(|state| state.units[1].shield < 44.0);
    assert_eq!(7 + loops, 14);
}
