//! What agents are shown and paid, on maps written for one purpose each.

use std::sync::Arc;

use mackrl_env::{
    Action, AgentId, EntityId, Environment, EpisodeEnd, EpisodeKey, Observations, Stream,
};

use super::*;
use crate::{
    Compatibility, Scenario, SkirmishSettings, UnitData,
    face::reward::{Outcome, Rewards},
    unit_types::UnitTypes,
};

/// A skirmish with its observations.
struct Play {
    skirmish: Skirmish,
    observations: Observations,
}

impl Play {
    /// Units by type and place; enemies without orders.
    fn new(allies: &[(&str, [f32; 2])], enemies: &[(&str, [f32; 2])]) -> Self {
        Self::with(allies, enemies, SkirmishSettings::default())
    }

    fn with(
        allies: &[(&str, [f32; 2])],
        enemies: &[(&str, [f32; 2])],
        settings: SkirmishSettings,
    ) -> Self {
        let race = |units: &[(&str, [f32; 2])]| {
            if units
                .iter()
                .any(|(name, _)| ["stalker", "zealot"].contains(name))
            {
                "protoss"
            } else {
                "terran"
            }
        };
        let groups = |units: &[(&str, [f32; 2])]| {
            units
                .iter()
                .map(|(name, at)| format!("{{ unit = \"{name}\", count = 1, at = {at:?} }}, "))
                .collect::<String>()
        };
        let map = format!(
            "terrain = \"lane\"\nepisode_limit = 7\n\
             [allies]\nrace = \"{}\"\ngroups = [{}]\n\
             [enemies]\nrace = \"{}\"\norder = \"none\"\ngroups = [{}]\n",
            race(allies),
            groups(allies),
            race(enemies),
            groups(enemies)
        );
        let units = UnitTypes::load(UnitData::Liberty).unwrap();
        let scenario = Scenario::parse("test", &map, &units).unwrap();
        // Units stand where a test puts them.
        let settings = SkirmishSettings {
            spawn_scatter: 0.0,
            ..settings
        };
        let mut skirmish = Skirmish::new(Arc::new(scenario), settings).unwrap();
        let mut observations = Observations::new(skirmish.spec(), 1);
        skirmish.reset(
            EpisodeKey::new(1, Stream::Other, 0),
            &mut observations.row_mut(0),
        );
        Self {
            skirmish,
            observations,
        }
    }

    fn step(&mut self, actions: &[usize]) -> mackrl_env::TimeStep {
        let actions: Vec<Action> = actions.iter().copied().map(Action::new).collect();
        self.skirmish
            .step(&actions, &mut self.observations.row_mut(0))
            .unwrap()
    }

    fn observation(&self, agent: usize) -> &[f32] {
        self.observations
            .local_view(0, AgentId::new(agent))
            .observation()
    }

    fn available(&self, agent: usize) -> Vec<usize> {
        let available = self
            .observations
            .local_view(0, AgentId::new(agent))
            .available();
        (0..available.len())
            .filter(|action| available[*action])
            .collect()
    }
}

#[test]
fn an_observation_is_moves_then_enemies_then_allies_then_oneself() {
    let play = Play::new(
        &[("marine", [10.0, 16.0]), ("marine", [10.0, 19.0])],
        &[
            ("marine", [13.0, 20.0]),
            ("marine", [18.5, 16.0]),
            ("marine", [19.0, 16.0]),
        ],
    );
    let expected = [
        [1.0, 1.0, 1.0, 1.0].as_slice(),
        &[1.0, 5.0 / 9.0, 3.0 / 9.0, 4.0 / 9.0, 1.0],
        &[0.0, 8.5 / 9.0, 8.5 / 9.0, 0.0, 1.0],
        &[0.0; 5], // at 9.0 exactly, which is not below 9
        &[1.0, 3.0 / 9.0, 0.0, 3.0 / 9.0, 1.0],
        &[1.0],
    ]
    .concat();
    assert_eq!(play.observation(0), expected);
    let seen = play.observations.visible(0)[0];
    assert_eq!(
        seen.iter().map(EntityId::index).collect::<Vec<_>>(),
        [0, 1, 2, 3]
    );
}

#[test]
fn targets_are_offered_up_to_six_whatever_the_weapon_reaches() {
    let play = Play::new(
        &[("zealot", [10.0, 16.0])],
        &[("zealot", [16.0, 16.0]), ("zealot", [16.0, 16.75])],
    );
    assert_eq!(play.available(0), [1, 2, 3, 4, 5, 6]);
}

#[test]
fn moves_are_offered_if_the_cell_one_ahead_is_walkable() {
    // The lane is walkable from y = 8 to 24 and from x = 0 to 32.
    let play = Play::new(
        &[
            ("marine", [0.5, 8.5]),
            ("marine", [31.0, 22.9]),
            ("marine", [31.5, 23.5]),
        ],
        &[("marine", [20.0, 16.0])],
    );
    // x = −0.5 truncates to cell 0, as in SMAC, so west is offered at the left edge.
    assert_eq!(play.available(0), [1, 2, 4, 5]);
    assert_eq!(play.available(1), [1, 2, 3, 5]);
    assert_eq!(play.available(2), [1, 3, 5]);
}

#[test]
fn agents_are_ordered_by_type_then_x_then_y() {
    let play = Play::new(
        &[
            ("zealot", [5.0, 16.0]),
            ("stalker", [9.0, 12.0]),
            ("zealot", [4.0, 18.0]),
            ("stalker", [9.0, 10.0]),
        ],
        &[("zealot", [25.0, 16.0])],
    );
    let state = play.skirmish.battle().state();
    assert_eq!(state.x[..4], [9.0, 9.0, 4.0, 5.0]);
    assert_eq!(state.y[..4], [10.0, 12.0, 18.0, 16.0]);
}

#[test]
fn smac_swaps_the_types_of_enemy_stalkers_and_zealots() {
    for (compat, stalker) in [
        (Compatibility::Smac, [0.0, 1.0]),
        (Compatibility::Clean, [1.0, 0.0]),
    ] {
        let settings = SkirmishSettings {
            compat,
            ..SkirmishSettings::default()
        };
        let play = Play::with(
            &[("stalker", [10.0, 16.0]), ("zealot", [11.0, 16.0])],
            &[("stalker", [14.0, 16.0])],
            settings,
        );
        // 4 moves, then the enemy: attackable, distance, x, y, life, shield, type.
        assert_eq!(play.observation(0)[4 + 6..4 + 8], stalker, "{compat:?}");
        let own = play.observation(0).len() - 2;
        assert_eq!(
            play.observation(0)[own..],
            [1.0, 0.0],
            "an ally stalker comes first"
        );
    }
}

#[test]
fn the_state_holds_places_on_the_map_cooldowns_and_last_actions() {
    let mut play = Play::new(&[("stalker", [12.0, 20.0])], &[("zealot", [16.0, 20.0])]);
    assert_eq!(
        play.observations.state(0)[..5],
        [1.0, 0.0, -0.125, 0.125, 1.0]
    );
    assert_eq!(play.observations.state(0)[5..9], [1.0, 0.0, 0.125, 1.0]);
    assert_eq!(
        play.observations.state(0)[9..],
        [0.0; 7],
        "no last action yet"
    );
    play.step(&[6]);
    let cooldown = play.skirmish.battle().state().units[0].cooldown;
    assert!(cooldown > 10.0, "it has shot");
    assert_eq!(play.observations.state(0)[1], cooldown / 35.0);
    assert_eq!(
        play.observations.state(0)[9..],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    );
}

#[test]
fn the_dead_see_nothing_and_can_do_nothing() {
    let mut play = Play::new(
        &[("marine", [10.0, 16.0]), ("marine", [10.0, 23.5])],
        &[
            ("stalker", [11.0, 16.0]),
            ("stalker", [12.0, 16.0]),
            ("stalker", [12.0, 14.0]),
        ],
    );
    while play.skirmish.battle_statistics().dead_allies == 0 {
        play.step(&[1, 1]);
    }
    assert_eq!(play.available(0), [0]);
    assert!(play.observation(0).iter().all(|x| *x == 0.0), "zeros");
    assert!(play.observations.visible(0)[0].is_empty(), "sees nobody");
    assert!(
        !play.observations.visible(0)[1].contains(AgentId::new(0)),
        "is seen by nobody"
    );
    assert_eq!(play.observations.state(0)[..4], [0.0; 4]);
}

#[test]
fn last_actions_of_allies_are_seen_if_the_settings_say_so() {
    let settings = SkirmishSettings {
        obs_last_action: true,
        state_last_action: false,
        ..SkirmishSettings::default()
    };
    let allies = [("marine", [10.0, 16.0]), ("marine", [12.0, 16.0])];
    let mut play = Play::with(&allies, &[("marine", [25.0, 16.0])], settings);
    play.step(&[2, 3]);
    // 4 moves, 5 about the enemy, 5 about the ally, then its last of 7 actions.
    assert_eq!(
        play.observation(0)[14..21],
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    );
    assert_eq!(play.observations.state(0).len(), 2 * 4 + 3);
}

#[test]
fn an_undecided_game_is_truncated_at_its_limit() {
    let mut play = Play::new(&[("marine", [5.0, 16.0])], &[("marine", [25.0, 16.0])]);
    for _ in 0..6 {
        assert_eq!(play.step(&[1]).end, None);
    }
    let last = play.step(&[1]);
    assert_eq!((last.end, last.reward), (Some(EpisodeEnd::Truncated), 0.0));
    assert!(
        !play.skirmish.battle_statistics().battle_won,
        "nobody has won"
    );
}

#[test]
fn rewards_are_damage_kills_and_victory_over_the_greatest_return() {
    let play = Play::new(
        &[("marine", [5.0, 16.0])],
        &[("marine", [25.0, 16.0]), ("zealot", [28.0, 16.0])],
    );
    let settings = SkirmishSettings::default();
    let mut state = play.skirmish.battle().state().clone();
    let mut rewards = Rewards::new(&state, 1, &settings);
    // 45 + 150 hit points, two kills, one victory.
    let scale = 20.0 / (195.0 + 20.0 + 200.0);
    let close = |a: f32, b: f32| (a - b).abs() < 1e-6;
    state.units[1].life = 39.0;
    state.units[2].shield = 42.0;
    assert!(
        close(
            rewards.settle(&state, Outcome::Undecided, &settings),
            14.0 * scale
        ),
        "damage"
    );
    state.units[1].life = 0.0;
    assert!(
        close(
            rewards.settle(&state, Outcome::Undecided, &settings),
            49.0 * scale
        ),
        "a kill"
    );
    assert_eq!(
        rewards.settle(&state, Outcome::Undecided, &settings),
        0.0,
        "the dead pay once"
    );
    (state.units[2].life, state.units[2].shield) = (0.0, 0.0);
    assert!(
        close(
            rewards.settle(&state, Outcome::Won, &settings),
            352.0 * scale
        ),
        "victory"
    );
}

#[test]
fn recharging_shields_pay_in_smac_and_not_otherwise() {
    let play = Play::new(&[("marine", [5.0, 16.0])], &[("zealot", [28.0, 16.0])]);
    let hurt = {
        let mut state = play.skirmish.battle().state().clone();
        state.units[1].shield = 42.0;
        state
    };
    let healed = play.skirmish.battle().state();
    for (compat, pays) in [(Compatibility::Smac, true), (Compatibility::Clean, false)] {
        let settings = SkirmishSettings {
            compat,
            ..SkirmishSettings::default()
        };
        let mut rewards = Rewards::new(healed, 1, &settings);
        rewards.remember(&hurt);
        let reward = rewards.settle(healed, Outcome::Undecided, &settings);
        assert_eq!(reward > 0.0, pays, "{compat:?}: {reward}");
    }
}

#[test]
fn own_losses_count_half_if_asked_for() {
    let settings = SkirmishSettings {
        reward_only_positive: false,
        reward_scale: false,
        ..SkirmishSettings::default()
    };
    let play = Play::new(&[("marine", [5.0, 16.0])], &[("marine", [25.0, 16.0])]);
    let mut state = play.skirmish.battle().state().clone();
    let mut rewards = Rewards::new(&state, 1, &settings);
    state.units[0].life = 0.0;
    state.units[1].life = 39.0;
    let reward = rewards.settle(&state, Outcome::Lost, &settings);
    assert_eq!(reward, 6.0 - 0.5 * 45.0 - 0.5 * 10.0);
}

#[test]
fn sparse_rewards_are_scaled_all_the_same() {
    let settings = SkirmishSettings {
        reward_sparse: true,
        ..SkirmishSettings::default()
    };
    let play = Play::new(&[("marine", [5.0, 16.0])], &[("marine", [25.0, 16.0])]);
    let state = play.skirmish.battle().state();
    let mut rewards = Rewards::new(state, 1, &settings);
    let reward = rewards.settle(state, Outcome::Lost, &settings);
    assert!((reward + 20.0 / 255.0).abs() < 1e-6, "{reward}");
}

#[test]
fn a_medivac_aims_at_friends_by_the_numbers_of_enemies() {
    // Agents in their order: marauder 0, marine 1, marine 2, medivac 3.
    let mut play = Play::new(
        &[
            ("marine", [10.0, 16.0]),
            ("marine", [3.0, 16.0]),
            ("marauder", [10.0, 18.0]),
            ("medivac", [12.0, 16.0]),
        ],
        &[
            ("marine", [16.0, 16.0]),
            ("marine", [16.0, 18.0]),
            ("marine", [16.0, 14.0]),
            ("marine", [30.0, 16.0]),
        ],
    );
    // The marauder and the nearer marine; not the farther one, not itself; whole friends count too.
    assert_eq!(play.available(3), [1, 2, 3, 4, 5, 6, 8]);
    // Rows of enemies have 4 + 1 + 3 entries after the four of moves; each begins with the action of its number.
    let flags: Vec<f32> = (0..4).map(|e| play.observation(3)[4 + 8 * e]).collect();
    assert_eq!(flags, [1.0, 0.0, 1.0, 0.0]);
    // An enemy out of sight has no row, whatever can be healed.
    assert_eq!(play.observation(3)[4 + 8 * 3..4 + 8 * 4], [0.0; 8]);
    let medivac = &play.observation(3)[play.observation(3).len() - 4..];
    assert_eq!(medivac, [1.0, 0.0, 0.0, 1.0], "life and type");
    // In the state its energy stands where others have their cooldown.
    let state = play.observations.state(0);
    assert_eq!(state[3 * 7..3 * 7 + 2], [1.0, 50.0 / 200.0]);
    play.step(&[1, 1, 1, 8]);
}

#[test]
fn a_battle_in_which_only_medivacs_are_left_is_over() {
    let play = |allies: &[usize], enemies: &[usize]| {
        let army = |x: f32| {
            [
                ("marauder", [x, 12.0]),
                ("marine", [x, 16.0]),
                ("medivac", [x, 20.0]),
                ("medivac", [x, 22.0]),
            ]
        };
        let mut play = Play::new(&army(4.0), &army(28.0));
        let mut state = play.skirmish.battle().state().clone();
        for dead in allies.iter().copied().chain(enemies.iter().map(|i| i + 4)) {
            state.units[dead].life = 0.0;
        }
        play.skirmish.encounter.battle.restore(&state);
        let actions: Vec<usize> = (0..4).map(|i| usize::from(!allies.contains(&i))).collect();
        let actions: Vec<Action> = actions.into_iter().map(Action::new).collect();
        play.skirmish
            .face
            .write(&state, &mut play.observations.row_mut(0));
        let step = play
            .skirmish
            .step(&actions, &mut play.observations.row_mut(0))
            .unwrap();
        (
            step.end.is_some(),
            play.skirmish.battle_statistics().battle_won,
        )
    };
    assert_eq!(play(&[0], &[0]), (false, false), "fighters on both sides");
    assert_eq!(play(&[0, 1], &[]), (true, false), "the team's are gone");
    assert_eq!(play(&[], &[0, 1, 2]), (true, true), "one medivac is left");
    assert_eq!(
        play(&[], &[0, 1]),
        (false, false),
        "of two medivacs SMAC says nothing"
    );
    assert_eq!(
        play(&[0, 1], &[0, 1, 2]),
        (true, false),
        "both: the team's are looked at first"
    );
}

#[test]
fn battles_are_counted() {
    let mut play = Play::new(&[("marine", [3.0, 16.0])], &[("marine", [30.0, 16.0])]);
    for _ in 0..7 {
        play.step(&[1]);
    }
    let tally = play.skirmish.tally();
    assert_eq!(
        (tally.battles_game, tally.battles_won, tally.timeouts),
        (1, 0, 1)
    );
    assert_eq!(tally.win_rate(), 0.0);
}

#[test]
fn the_ground_around_an_agent_is_shown_at_twice_a_move() {
    let settings = SkirmishSettings {
        obs_pathing_grid: true,
        obs_terrain_height: true,
        ..SkirmishSettings::default()
    };
    // On the lane (y 8 to 24), at x 1: north, south, east, west at 4, then north-east, south-west, south-east, north-west at 2.
    let play = Play::with(
        &[("marine", [1.5, 9.5])],
        &[("marine", [8.0, 16.0])],
        settings,
    );
    assert_eq!(
        play.observation(0)[4..12],
        [1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0],
        "what lies outside the map counts as open"
    );
    assert_eq!(
        play.observation(0)[12..21],
        [0.5, 0.0, 0.5, 1.0, 0.5, 1.0, 0.0, 1.0, 0.5]
    );
}
