//! What grows back, and what puts that off.

use super::*;

#[test]
fn shields_recharge_two_points_a_second_after_ten_seconds() {
    let mut arena = Arena::new();
    let zealot = arena.add("zealot", Ally, Passive, [10.0, 16.0]);
    arena.unit(zealot).shield = 0.0;
    arena.unit(zealot).unharmed = 0.0;
    arena.loops(160);
    assert_eq!(arena.unit(zealot).shield, 0.0);
    arena.loops(16);
    assert_eq!(arena.unit(zealot).shield, 2.0);
    arena.loops(16 * 40);
    assert_eq!(arena.unit(zealot).shield, 50.0, "and stop when full");
}

#[test]
fn a_hit_puts_recharging_off() {
    let (mut arena, marine, zealot) = duel("marine", "zealot", 3.0);
    arena.loops(2);
    arena.battle.order(marine, Order::Stop);
    assert_eq!(arena.unit(zealot).shield, 44.0);
    arena.loops(159);
    assert_eq!(arena.unit(zealot).shield, 44.0);
    arena.loops(16);
    assert_eq!(arena.unit(zealot).shield, 46.0);
}

#[test]
fn zerg_life_grows_back() {
    let mut arena = Arena::new();
    let zergling = arena.add("zergling", Ally, Passive, [10.0, 16.0]);
    arena.unit(zergling).life = 10.0;
    arena.loops(160);
    assert!(
        (arena.unit(zergling).life - 12.734).abs() < 1e-3,
        "0.2734 a second"
    );
}
