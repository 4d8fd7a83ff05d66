//! Equal armies under equal orders win equally often: no rule favours the side that comes first in the arrays.

use std::sync::Arc;

use super::*;
use crate::scenario::Scenario;

/// Outcomes of battles in which both sides are the game's own and march at each other.
#[derive(Debug, Default)]
struct Tally {
    allies: u32,
    enemies: u32,
    neither: u32,
}

/// Plays the armies of the map called `name` against each other with `battles` different dice.
fn march_at_each_other(name: &str, battles: u64) -> Tally {
    let data = UnitTypes::load(UnitData::Liberty).unwrap();
    let scenario = Scenario::shipped(name, &data).unwrap().unwrap();
    let mut start = Battle::new(Arc::clone(&scenario.field), scenario.recruits.len());
    for recruit in &scenario.recruits {
        let unit = start.add(recruit.kind, recruit.team, Aggressive, recruit.at);
        // Each keeps its place in the formation, 14 map units further on.
        let ahead = if recruit.team == Ally { 14.0 } else { -14.0 };
        let to = [recruit.at[0] + ahead, recruit.at[1]];
        start.order(unit, Order::AttackMove { to });
    }
    let mut tally = Tally::default();
    for episode in 0..battles {
        let key = EpisodeKey::new(11, Stream::Other, episode);
        let mut battle = start.clone();
        let mut step = 0;
        while battle.state.living(Ally) > 0 && battle.state.living(Enemy) > 0 && step < 400 {
            step += 1;
            let mut chance = Chance::new(key, step);
            (0..8).for_each(|_| battle.advance(&mut chance));
        }
        match (battle.state.living(Ally), battle.state.living(Enemy)) {
            (1.., 0) => tally.allies += 1,
            (0, 1..) => tally.enemies += 1,
            _ => tally.neither += 1,
        }
    }
    tally
}

#[test]
fn equal_armies_win_half_their_battles() {
    for (name, battles) in [("3m", 600), ("8m", 600), ("25m", 400)] {
        let tally = march_at_each_other(name, battles);
        let decided = f64::from(tally.allies + tally.enemies);
        let rate = f64::from(tally.allies) / decided;
        // In some battles the last survivors pass each other out of sight.
        assert!(decided > 0.6 * battles as f64, "{name}: {tally:?}");
        let standard_error = 0.5 / decided.sqrt();
        assert!(
            (rate - 0.5).abs() < 4.0 * standard_error,
            "{name}: {tally:?}"
        );
    }
}

#[test]
fn armies_that_face_each_other_stand_as_mirror_images() {
    let data = UnitTypes::load(UnitData::Liberty).unwrap();
    for name in ["3m", "8m", "25m", "2s3z", "3s5z"] {
        let scenario = Scenario::shipped(name, &data).unwrap().unwrap();
        for recruit in &scenario.recruits[..scenario.agents] {
            let mirror = [32.0 - recruit.at[0], recruit.at[1]];
            let opposite = scenario.recruits[scenario.agents..]
                .iter()
                .find(|enemy| enemy.at == mirror);
            assert_eq!(
                opposite.map(|enemy| enemy.kind),
                Some(recruit.kind),
                "{name}: opposite {:?}",
                recruit.at
            );
        }
    }
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
            assert_eq!(
                [32.0 - state.x[left], state.y[left]],
                [state.x[right], state.y[right]],
                "loop {number}: unit {left} is off its mirror image"
            );
        }
    }
    let state = &arena.battle.state;
    assert!(
        state.units.iter().any(|unit| unit.life < 45.0),
        "there was a battle"
    );
}
