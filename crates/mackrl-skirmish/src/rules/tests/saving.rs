//! A battle is its state: nothing else is remembered.

use super::*;

#[test]
fn a_state_written_as_text_is_read_back_to_the_bit() {
    let mut arena = Arena::on(TerrainName::Lane, [-0.0625, 0.125]);
    for i in 0..5_u8 {
        let y = 14.0 + f32::from(i) * 0.9;
        let ally = if i == 0 { "colossus" } else { "stalker" };
        arena.add(ally, Ally, Aggressive, [12.0, y]);
        arena.add("zealot", Enemy, Aggressive, [16.0, y]);
    }
    let (mut missiles, mut blows) = (0, 0);
    for number in 0..150 {
        arena.loops(1);
        let state = &arena.battle.state;
        missiles = missiles.max(state.missiles.len());
        blows = blows.max(state.blows.len());
        let text = serde_json::to_string(state).unwrap();
        let read: BattleState = serde_json::from_str(&text).unwrap();
        assert!(read == *state, "loop {number}: {text}");
        assert_eq!(read.hash(), state.hash());
    }
    assert!(
        missiles > 0 && blows > 0,
        "{missiles} missiles, {blows} blows"
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
