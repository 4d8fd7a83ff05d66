//! Banelings.

use super::*;

#[test]
fn a_baneling_takes_all_enemies_around_with_it_and_no_friends() {
    let (mut arena, baneling, zealot) = duel("baneling", "zealot", 1.1);
    let marine = arena.add("marine", Enemy, Passive, [12.5, 16.0]);
    let beyond = arena.add("marine", Enemy, Passive, [10.0, 18.6]);
    let crawler = arena.add("spine-crawler", Enemy, Passive, [7.5, 16.0]);
    let friend = arena.add("marine", Ally, Passive, [10.0, 15.0]);
    arena.loops(1);
    assert_eq!(arena.unit(baneling).life, 0.0);
    assert_eq!(
        arena.unit(zealot).shield,
        15.0,
        "20 and 15 more against the light"
    );
    assert_eq!(arena.unit(marine).life, 10.0, "its edge is 2.125 away");
    assert_eq!(arena.unit(beyond).life, 45.0, "its edge is 2.225 away");
    // 80 less an armour of 2, and a loop's growth.
    assert!(
        (arena.unit(crawler).life - 222.0).abs() < 0.1,
        "{}",
        arena.unit(crawler).life
    );
    assert_eq!(arena.unit(friend).life, 45.0);
}

#[test]
fn a_baneling_explodes_when_it_is_killed_and_sets_off_others() {
    let mut arena = Arena::new();
    let marine = arena.add("marine", Ally, Passive, [10.0, 16.0]);
    let enemy = arena.add("baneling", Enemy, Passive, [12.0, 16.0]);
    let own = arena.add("baneling", Ally, Passive, [12.0, 18.0]);
    let zergling = arena.add("zergling", Enemy, Passive, [12.0, 20.0]);
    for unit in [enemy, own] {
        arena.unit(unit).life = 5.0;
    }
    arena.attack(marine, enemy);
    arena.loops(2);
    assert_eq!(arena.unit(enemy).life, 0.0);
    assert_eq!(arena.unit(marine).life, 10.0, "35 by the enemy's explosion");
    assert_eq!(arena.unit(own).life, 0.0, "20 by the enemy's explosion");
    assert_eq!(
        arena.unit(zergling).life,
        0.0,
        "35 by the explosion that it set off"
    );
}
