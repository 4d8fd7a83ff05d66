//! Walking, walls, and who gives way to whom.

use super::*;

#[test]
fn units_walk_at_the_speed_of_their_data() {
    let mut arena = Arena::new();
    let marine = arena.add("marine", Ally, Passive, [10.0, 16.0]);
    let stalker = arena.add("stalker", Ally, Passive, [10.0, 20.0]);
    arena.battle.order(marine, Order::Move { to: [12.0, 16.0] });
    arena
        .battle
        .order(stalker, Order::Move { to: [12.0, 20.0] });
    arena.loops(8);
    assert!((arena.at(marine)[0] - 11.125).abs() < 1e-5, "2.25 a second");
    assert!(
        (arena.at(stalker)[0] - 11.476_56).abs() < 1e-5,
        "2.9531 a second"
    );
    arena.loops(8);
    assert_eq!(arena.at(marine), [12.0, 16.0]);
    assert_eq!(arena.unit(marine).order, Order::Stop, "arrived");
}

#[test]
fn walls_stop_units_at_their_inner_radius() {
    let mut arena = Arena::on(TerrainName::Lane, [0.0, 0.0]);
    let marine = arena.add("marine", Ally, Passive, [10.0, 9.0]);
    arena.battle.order(marine, Order::Move { to: [10.0, 6.0] });
    arena.loops(30);
    assert_eq!(arena.at(marine), [10.0, 8.375]);
}

#[test]
fn walkers_go_round_whoever_is_fighting() {
    let mut arena = Arena::new();
    let target = arena.add("zealot", Enemy, Passive, [14.0, 16.0]);
    let fighter = arena.add("marine", Ally, Passive, [12.0, 16.0]);
    let walker = arena.add("marine", Ally, Passive, [10.0, 16.0]);
    arena.attack(fighter, target);
    arena.battle.order(walker, Order::Move { to: [13.0, 18.0] });
    arena.loops(1);
    arena.battle.order(walker, Order::Move { to: [12.9, 16.0] });
    arena.loops(60);
    assert_eq!(arena.at(fighter), [12.0, 16.0], "nobody pushes a fighter");
    let [x, y] = arena.at(walker);
    assert!(
        (x - 12.9).hypot(y - 16.0) < 0.1,
        "the walker arrived at {:?}",
        [x, y]
    );
}

#[test]
fn walkers_push_idle_friends_aside_but_not_enemies() {
    for (team, is_pushed) in [(Ally, true), (Enemy, false)] {
        let mut arena = Arena::new();
        let idle = arena.add("marine", team, Passive, [12.0, 16.125]);
        let walker = arena.add("marine", Ally, Passive, [10.0, 16.0]);
        arena.battle.order(walker, Order::Move { to: [14.0, 16.0] });
        arena.loops(60);
        assert_eq!(arena.at(idle) != [12.0, 16.125], is_pushed, "{team:?}");
        assert_eq!(arena.at(walker), [14.0, 16.0]);
    }
}

#[test]
fn a_crowd_sent_to_one_point_comes_to_rest_side_by_side() {
    let mut arena = Arena::new();
    let crowd: Vec<UnitIndex> = (0..12_u8)
        .map(|i| {
            let at = [8.0 + f32::from(i % 4) * 1.3, 12.0 + f32::from(i / 4) * 1.7];
            arena.add(
                if i % 2 == 0 { "marine" } else { "zealot" },
                Ally,
                Passive,
                at,
            )
        })
        .collect();
    for unit in &crowd {
        arena.battle.order(*unit, Order::Move { to: [16.0, 16.0] });
    }
    arena.loops(100);
    for unit in &crowd {
        arena.battle.order(*unit, Order::Stop);
    }
    arena.loops(60);
    for a in 0..crowd.len() {
        for b in 0..a {
            let distance = arena.battle.state.distance_squared(a, b).sqrt();
            assert!(distance > 0.75 - 0.01, "{a} and {b} are {distance} apart");
        }
    }
}
