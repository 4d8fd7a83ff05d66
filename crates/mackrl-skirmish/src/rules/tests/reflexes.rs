//! What units do unasked, and that passive ones do nothing.

use super::*;

#[test]
fn passive_units_do_exactly_what_they_are_told() {
    let mut arena = Arena::new();
    let marine = arena.add("marine", Ally, Passive, [10.0, 16.0]);
    arena.add("marine", Enemy, Aggressive, [13.0, 16.0]);
    let loops = arena.loops_until(|state| !state.units[0].is_alive());
    assert!(loops > 90, "it takes eight shots");
    assert_eq!(arena.battle.state.units[1].life, 45.0);
    assert_eq!(arena.at(marine), [10.0, 16.0]);
}

#[test]
fn aggressive_units_notice_what_comes_within_their_scan_range() {
    // A zealot notices at 5 and a margin of 0.9 from edge to edge: 5.9 + 0.5 + 0.375 against a marine.
    for (distance, notices) in [(6.77, true), (6.78, false)] {
        let mut arena = Arena::new();
        let zealot = arena.add("zealot", Enemy, Aggressive, [10.0, 16.0]);
        arena.add("marine", Ally, Passive, [10.0 + distance, 16.0]);
        arena.loops(1);
        assert_eq!(
            arena.unit(zealot).quarry.is_some(),
            notices,
            "at {distance}"
        );
    }
}

#[test]
fn an_attack_move_goes_to_its_point_and_fights_on_the_way() {
    let mut arena = Arena::new();
    let enemy = arena.add("zealot", Enemy, Aggressive, [23.0, 16.0]);
    let marine = arena.add("marine", Ally, Passive, [16.0, 19.0]);
    arena
        .battle
        .order(enemy, Order::AttackMove { to: [9.0, 16.0] });
    arena.loops_until(|state| !state.units[usize::from(marine)].is_alive());
    let at = arena.at(enemy);
    assert!(
        (at[0] - 16.0).abs() < 1.5 && (at[1] - 19.0).abs() < 1.5,
        "fought at {at:?}"
    );
    arena.loops(200);
    assert_eq!(arena.at(enemy), [9.0, 16.0]);
}

#[test]
fn a_unit_hit_from_afar_turns_on_its_attacker_and_calls_its_friends() {
    let mut arena = Arena::new();
    // Its reach of 7 is farther than zealots notice.
    let crawler = arena.add("spine-crawler", Ally, Passive, [10.0, 16.0]);
    let victim = arena.add("zealot", Enemy, Aggressive, [18.2, 16.0]);
    let near = arena.add("zealot", Enemy, Aggressive, [18.2, 19.9]);
    let far = arena.add("zealot", Enemy, Aggressive, [18.2, 20.7]);
    arena.attack(crawler, victim);
    arena.loops_until(|state| state.units[usize::from(victim)].shield < 50.0);
    assert_eq!(
        arena.unit(victim).quarry,
        Some(crawler),
        "8.2 is beyond the 7.275 in which it notices"
    );
    assert_eq!(
        arena.unit(near).quarry,
        Some(crawler),
        "within 4 of the victim"
    );
    assert_eq!(arena.unit(far).quarry, None, "beyond 4");
}

#[test]
fn a_fighter_stays_with_a_quarry_in_range_and_leaves_one_that_flees() {
    let mut arena = Arena::new();
    let enemy = arena.add("marine", Enemy, Aggressive, [10.0, 16.0]);
    let first = arena.add("marine", Ally, Passive, [14.0, 16.0]);
    arena.loops(1);
    let second = arena.add("marine", Ally, Passive, [10.0, 14.0]);
    arena.loops(9);
    assert_eq!(
        arena.unit(enemy).quarry,
        Some(first),
        "though another is nearer"
    );
    arena.battle.state.x[usize::from(first)] = 17.0;
    arena.loops(9);
    assert_eq!(
        arena.unit(enemy).quarry,
        Some(second),
        "when it looks again"
    );
}

#[test]
fn a_chase_ends_where_the_leash_does() {
    let mut arena = Arena::new();
    let zealot = arena.add("zealot", Enemy, Aggressive, [2.0, 16.0]);
    let stalker = arena.add("stalker", Ally, Passive, [7.0, 16.0]);
    arena.loops(1);
    arena
        .battle
        .order(stalker, Order::Move { to: [31.0, 16.0] });
    arena.loops_until(|state| state.units[0].quarry.is_none());
    let at = arena.at(zealot);
    assert!(
        (23.0..23.3).contains(&at[0]),
        "gave up at {at:?}, 21 from where it began"
    );
}

#[test]
fn hunters_find_their_prey_anywhere() {
    let mut arena = Arena::new();
    let zergling = arena.add("zergling", Enemy, Aggressive, [2.0, 2.0]);
    let marine = arena.add("marine", Ally, Passive, [30.0, 30.0]);
    arena.battle.order(zergling, Order::Hunt);
    arena.loops_until(|state| !state.units[usize::from(marine)].is_alive());
}

#[test]
fn a_unit_takes_the_nearest_target_whatever_its_type() {
    for (near, far) in [
        ("zergling", "marine"),
        ("colossus", "zergling"),
        ("medivac", "marine"),
    ] {
        let mut arena = Arena::new();
        let marine = arena.add("marine", Enemy, Aggressive, [10.0, 16.0]);
        arena.add(far, Ally, Passive, [14.0, 16.0]);
        let nearest = arena.add(near, Ally, Passive, [10.0, 13.0]);
        arena.loops(1);
        assert_eq!(arena.unit(marine).quarry, Some(nearest), "{near} and {far}");
    }
}

#[test]
fn of_two_targets_equally_near_it_is_the_southern_one() {
    let mut arena = Arena::new();
    let marine = arena.add("marine", Enemy, Aggressive, [10.0, 16.0]);
    arena.add("marine", Ally, Passive, [10.0, 19.0]);
    let southern = arena.add("marine", Ally, Passive, [10.0, 13.0]);
    arena.loops(1);
    assert_eq!(arena.unit(marine).quarry, Some(southern));
}

#[test]
fn a_unit_calls_for_help_every_two_seconds() {
    let mut arena = Arena::new();
    // One that shoots back would have the support of its friends, called or not.
    let victim = arena.add("spine-crawler", Enemy, Passive, [20.0, 16.0]);
    let stalker = arena.add("stalker", Ally, Passive, [20.0, 7.5]);
    arena.attack(stalker, victim);
    arena.loops_until(|state| state.units[0].life < 300.0);
    let called = arena.unit(victim).call_wait;
    assert!(
        (31.0..=32.0).contains(&called),
        "{called} loops until the next call"
    );
    // A friend that comes later does not hear the hits in between.
    let late = arena.add("zealot", Enemy, Aggressive, [20.0, 19.0]);
    arena.loops_until(|state| state.units[0].life < 280.0);
    assert_eq!(arena.unit(late).quarry, None, "23 loops after the call");
    arena.loops_until(|state| state.units[0].life < 270.0);
    assert_eq!(
        arena.unit(late).quarry,
        Some(stalker),
        "46 loops after the call"
    );
}

#[test]
fn a_zergling_that_lost_its_quarry_takes_the_next_in_the_same_loop() {
    let mut arena = Arena::new();
    let zergling = arena.add("zergling", Enemy, Aggressive, [10.0, 16.0]);
    let first = arena.add("marine", Ally, Passive, [10.7, 16.0]);
    let second = arena.add("marine", Ally, Passive, [10.0, 18.0]);
    arena.loops(2);
    assert_eq!(arena.unit(zergling).quarry, Some(first));
    arena.unit(first).life = 0.0;
    arena.loops(1);
    assert_eq!(arena.unit(zergling).quarry, Some(second));
}

#[test]
fn banelings_of_an_army_run_into_their_targets_and_explode() {
    let mut arena = Arena::new();
    let baneling = arena.add("baneling", Enemy, Aggressive, [20.0, 16.0]);
    let zealots: Vec<UnitIndex> = [15.2, 16.8]
        .map(|y| arena.add("zealot", Ally, Passive, [14.0, y]))
        .to_vec();
    arena
        .battle
        .order(baneling, Order::AttackMove { to: [9.0, 16.0] });
    arena.loops_until(|state| !state.units[0].is_alive());
    for zealot in zealots {
        assert_eq!(
            arena.unit(zealot).shield,
            15.0,
            "20 and 15 more against the light"
        );
    }
}
