//! Rules, one at a time, on units placed by hand. Numbers are those of the unit table.

use super::*;
use crate::{
    EpisodeKey, Stream,
    skirmish::{
        UnitData,
        terrain::{Terrain, TerrainName},
        unit_types::{UnitType, UnitTypes},
    },
};

use Stance::{Aggressive, Passive};
use Team::{Ally, Enemy};

/// A battle and its dice, with units named by type.
struct Arena {
    battle: Battle,
    chance: Chance,
}

impl Arena {
    /// The open field, every weapon period exact.
    fn new() -> Self {
        Self::on(TerrainName::Open, [0.0, 0.0])
    }

    fn on(terrain: TerrainName, jitter_s: [f32; 2]) -> Self {
        let mut data = (*UnitTypes::load(UnitData::Liberty).unwrap()).clone();
        data.cooldown_jitter_s = jitter_s;
        let types: Vec<&UnitType> = data.types.iter().collect();
        let field = Battlefield::new(Terrain::named(terrain), &data, &types);
        Self {
            battle: Battle::new(field.into(), 0),
            chance: Chance::new(EpisodeKey::new(3, Stream::Other, 0), 1),
        }
    }

    fn add(&mut self, name: &str, team: Team, stance: Stance, at: [f32; 2]) -> UnitIndex {
        let profiles = &self.battle.field.profiles;
        let kind = profiles
            .iter()
            .position(|profile| profile.name == name)
            .unwrap();
        self.battle
            .add(u8::try_from(kind).unwrap(), team, stance, at)
    }

    fn loops(&mut self, count: usize) {
        (0..count).for_each(|_| self.battle.advance(&mut self.chance));
    }

    /// Loops played until `holds`, at most 10 000.
    fn loops_until(&mut self, holds: impl Fn(&BattleState) -> bool) -> usize {
        (1..=10_000)
            .find(|_| {
                self.loops(1);
                holds(&self.battle.state)
            })
            .expect("it happens within 10 000 loops")
    }

    fn unit(&mut self, index: UnitIndex) -> &mut Unit {
        &mut self.battle.state.units[usize::from(index)]
    }

    fn at(&self, index: UnitIndex) -> [f32; 2] {
        [
            self.battle.state.x[usize::from(index)],
            self.battle.state.y[usize::from(index)],
        ]
    }

    fn attack(&mut self, attacker: UnitIndex, target: UnitIndex) {
        self.battle.order(attacker, Order::Attack { target });
    }
}

/// A unit of a type on the allies' side that attacks an idle enemy 3 map units away (1 for melee).
fn duel(attacker: &str, target: &str, distance: f32) -> (Arena, UnitIndex, UnitIndex) {
    let mut arena = Arena::new();
    let one = arena.add(attacker, Ally, Passive, [10.0, 16.0]);
    let other = arena.add(target, Enemy, Passive, [10.0 + distance, 16.0]);
    arena.attack(one, other);
    (arena, one, other)
}

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
    // A zealot scans 5 from edge to edge: 5 + 0.5 + 0.375 against a marine.
    for (distance, notices) in [(5.87, true), (5.89, false)] {
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
    let stalker = arena.add("stalker", Ally, Passive, [10.0, 16.0]);
    let victim = arena.add("zealot", Enemy, Aggressive, [17.1, 16.0]);
    let near = arena.add("zealot", Enemy, Aggressive, [17.1, 19.9]);
    let far = arena.add("zealot", Enemy, Aggressive, [17.1, 20.7]);
    arena.attack(stalker, victim);
    arena.loops_until(|state| state.units[usize::from(victim)].shield < 50.0);
    assert_eq!(
        arena.unit(victim).quarry,
        Some(stalker),
        "7.1 is beyond its scan range of 6.125"
    );
    assert_eq!(
        arena.unit(near).quarry,
        Some(stalker),
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
        (arena.at(stalker)[0] - 11.476_55).abs() < 1e-5,
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
        let idle = arena.add("marine", team, Passive, [12.0, 16.1]);
        let walker = arena.add("marine", Ally, Passive, [10.0, 16.0]);
        arena.battle.order(walker, Order::Move { to: [14.0, 16.0] });
        arena.loops(60);
        assert_eq!(arena.at(idle) != [12.0, 16.1], is_pushed, "{team:?}");
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
fn a_mirrored_start_gives_a_mirrored_battle() {
    let mut arena = Arena::on(TerrainName::Lane, [0.0, 0.0]);
    let army = [
        ("stalker", [6.0, 16.0]),
        ("stalker", [6.25, 18.0]),
        ("zealot", [8.0, 16.5]),
    ]
    .into_iter()
    .chain([
        ("zealot", [8.25, 14.5]),
        ("marine", [7.0, 20.0]),
        ("marine", [5.0, 13.0]),
    ]);
    let half = army.clone().count();
    for (name, [x, y]) in army.clone() {
        arena.add(name, Ally, Aggressive, [x, y]);
    }
    for (name, [x, y]) in army {
        arena.add(name, Enemy, Aggressive, [32.0 - x, y]);
    }
    for index in 0..2 * half {
        let to = if index < half {
            [25.0, 16.0]
        } else {
            [7.0, 16.0]
        };
        arena
            .battle
            .order(u8::try_from(index).unwrap(), Order::AttackMove { to });
    }
    // Rounding differs on the two sides of the map and grows once units jostle; ten seconds of march and battle are compared.
    for number in 0..160 {
        arena.loops(1);
        let state = &arena.battle.state;
        for left in 0..half {
            let right = left + half;
            let (one, other) = (&state.units[left], &state.units[right]);
            assert_eq!(
                (one.life, one.shield),
                (other.life, other.shield),
                "loop {number}, {left}"
            );
            let gap = (state.x[left] + state.x[right] - 32.0).abs()
                + (state.y[left] - state.y[right]).abs();
            assert!(
                gap < 0.01,
                "loop {number}: unit {left} is off its mirror image by {gap}"
            );
        }
    }
    let state = &arena.battle.state;
    assert!(
        state.units.iter().any(|unit| unit.life < 45.0),
        "there was a battle"
    );
}

#[test]
fn a_battle_restored_at_any_loop_goes_on_to_the_same_bits() {
    let mut arena = Arena::on(TerrainName::Lane, [-0.0625, 0.125]);
    for i in 0..9_u8 {
        let y = 14.0 + f32::from(i) * 0.8;
        let ally = arena.add(
            if i % 2 == 0 { "marine" } else { "stalker" },
            Ally,
            Aggressive,
            [9.0, y],
        );
        let enemy = arena.add("zealot", Enemy, Aggressive, [20.0, y - 2.0]);
        arena
            .battle
            .order(ally, Order::AttackMove { to: [23.0, 16.0] });
        arena
            .battle
            .order(enemy, Order::AttackMove { to: [9.0, 16.0] });
    }
    let mut other = arena.battle.clone();
    for number in 0..400 {
        let state = other.state().clone();
        other.restore(&state);
        let mut chance = arena.chance.clone();
        arena.loops(1);
        other.advance(&mut chance);
        assert!(arena.battle.state == other.state, "loop {number} differs");
        assert_eq!(arena.battle.state.hash(), other.state.hash());
    }
    let dead = arena
        .battle
        .state
        .units
        .iter()
        .filter(|unit| !unit.is_alive())
        .count();
    assert!(
        dead > 5,
        "only {dead} died: too tame a battle to show anything"
    );
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
