//! Whole episodes: what holds in every step of them, and how scripted teams fare.

use mackrl_env::{Action, Environment, EpisodeEnd, EpisodeKey, Observations, Stream};
use mackrl_skirmish::{
    Compatibility, Skirmish, SkirmishSettings,
    scripted::{ScriptedPolicy, ScriptedTeam},
};

/// Plays an episode; `watch` is called after the start and after every step with the reward.
fn play(
    skirmish: &mut Skirmish,
    policy: ScriptedPolicy,
    episode: u64,
    mut watch: impl FnMut(&Skirmish, &Observations, f32),
) -> EpisodeEnd {
    let spec = skirmish.spec().clone();
    let mut team = ScriptedTeam::new(policy, skirmish);
    let mut observations = Observations::new(&spec, 1);
    let mut actions = vec![Action::default(); spec.agents];
    let key = EpisodeKey::new(5, Stream::Other, episode);
    skirmish.reset(key, &mut observations.row_mut(0));
    watch(skirmish, &observations, 0.0);
    for step in 0..spec.episode_limit {
        team.act(&observations, 0, (key, step), &mut actions);
        let time_step = skirmish
            .step(&actions, &mut observations.row_mut(0))
            .expect("scripted policies choose available actions");
        watch(skirmish, &observations, time_step.reward);
        if let Some(end) = time_step.end {
            return end;
        }
    }
    panic!("an episode ends at its limit");
}

fn make(name: &str, settings: &SkirmishSettings) -> Skirmish {
    mackrl_skirmish::make(name, settings).expect("the map is shipped")
}

/// Battles won of `episodes`, and the mean return.
fn fare(name: &str, policy: ScriptedPolicy, episodes: u64) -> (u64, f64) {
    let mut skirmish = make(name, &SkirmishSettings::default());
    let (mut won, mut total) = (0, 0.0);
    for episode in 0..episodes {
        play(&mut skirmish, policy, episode, |_, _, reward| {
            total += f64::from(reward);
        });
        won += u64::from(skirmish.battle_statistics().battle_won);
    }
    (won, total / episodes as f64)
}

#[test]
fn on_8m_shooting_together_wins_and_standing_or_stumbling_loses() {
    let (focused, focused_return) = fare("8m", ScriptedPolicy::FocusFire, 100);
    let (idle, idle_return) = fare("8m", ScriptedPolicy::Idle, 100);
    let (random, random_return) = fare("8m", ScriptedPolicy::Random, 100);
    assert!(focused >= 50, "focused fire won {focused} of 100");
    assert!(random <= 5, "random actions won {random} of 100");
    assert_eq!((idle, idle_return), (0, 0.0), "nobody shot");
    assert!(
        focused_return > random_return,
        "{focused_return} against {random_return}"
    );
}

/// Battles that the agents win soon, of every race and with healers on either side: allies, enemies, and their races.
const WON: [(&str, &str, [&str; 2]); 6] = [
    ("5 marine", "2 marine", ["terran", "terran"]),
    (
        "7 marine, 1 medivac",
        "2 marine, 1 medivac",
        ["terran", "terran"],
    ),
    ("4 stalker", "1 zealot, 1 stalker", ["protoss", "protoss"]),
    ("1 colossus, 2 zealot", "12 zergling", ["protoss", "zerg"]),
    ("9 zergling, 3 baneling", "1 stalker", ["zerg", "protoss"]),
    ("5 hydralisk", "5 zergling", ["zerg", "zerg"]),
];

fn one_sided(allies: &str, enemies: &str, [ours, theirs]: [&str; 2]) -> String {
    let groups = |army: &str, x: u8| -> String {
        let groups = army.split(", ").map(|group| {
            let (count, unit) = group.split_once(' ').expect("a count and a type");
            format!("{{ unit = \"{unit}\", count = {count}, at = [{x}, 16] }}, ")
        });
        groups.collect()
    };
    format!(
        "terrain = \"lane\"\nepisode_limit = 200\n\
         [allies]\nrace = \"{ours}\"\ngroups = [{}]\n\
         [enemies]\nrace = \"{theirs}\"\norder = {{ attack-move = [12, 16] }}\ngroups = [{}]\n",
        groups(allies, 12),
        groups(enemies, 20)
    )
}

/// What the enemies have left in life and shields.
fn strength(skirmish: &Skirmish) -> f64 {
    let enemies = &skirmish.battle().state().units[skirmish.scenario().agents..];
    let left = enemies.iter().filter(|unit| unit.is_alive());
    left.map(|unit| f64::from(unit.life + unit.shield)).sum()
}

#[test]
fn a_won_battle_returns_20_and_what_grew_back_besides() {
    let mut regenerated = 0;
    for (allies, enemies, races) in WON {
        for (compat, weight) in [(Compatibility::Smac, 2.0), (Compatibility::Clean, 1.0)] {
            let settings = SkirmishSettings {
                compat,
                ..SkirmishSettings::default()
            };
            let text = one_sided(allies, enemies, races);
            let mut skirmish =
                mackrl_skirmish::make_custom("won.toml", &text, &settings).expect("valid");
            let scale = 20.0 / f64::from(skirmish.max_reward());
            let mut wins = 0;
            for episode in 0..6 {
                let (mut total, mut grown) = (0.0, 0.0);
                let (mut before, mut dead) = (f64::INFINITY, 0);
                play(
                    &mut skirmish,
                    ScriptedPolicy::FocusFire,
                    episode,
                    |skirmish, _, reward| {
                        total += f64::from(reward);
                        let (left, killed) = (
                            strength(skirmish),
                            skirmish.battle_statistics().dead_enemies,
                        );
                        let gain = before - left + 10.0 * (killed - dead) as f64;
                        // SMAC takes the absolute value, so that what grows back in a step pays too, and is paid for again when
                        // it is shot off; the clean reward is paid for that alone.
                        grown += (-gain).max(0.0);
                        (before, dead) = (left, killed);
                    },
                );
                if skirmish.battle_statistics().battle_won {
                    wins += 1;
                    regenerated += usize::from(grown > 0.0);
                    // A battle is won too when a medivac is all that is left.
                    let spared = before + 10.0 * (skirmish.scenario().enemies() - dead) as f64;
                    let expected = 20.0 + (weight * grown - spared) * scale;
                    assert!(
                        (total - expected).abs() < 1e-4,
                        "{allies} against {enemies}, {compat:?}: {total}, not {expected}"
                    );
                }
            }
            assert!(
                wins > 0,
                "{allies} never beat {enemies}, so nothing was shown"
            );
        }
    }
    assert!(regenerated > 3, "hardly anything grew back: {regenerated}");
}

#[test]
fn nothing_impossible_happens_in_any_step_on_any_map() {
    for name in mackrl_skirmish::map_names() {
        let mut skirmish = mackrl_skirmish::make(name, &SkirmishSettings::default()).unwrap();
        for (episode, policy) in ScriptedPolicy::ALL.into_iter().enumerate() {
            let mut was_alive = vec![true; skirmish.spec().entities];
            play(&mut skirmish, policy, episode as u64, |skirmish, _, _| {
                check_bodies(skirmish, &mut was_alive);
            });
        }
    }
}

/// Life, shields and energy in range, the dead stay dead, everybody off the walls.
fn check_bodies(skirmish: &Skirmish, was_alive: &mut [bool]) {
    let (state, field) = (skirmish.battle().state(), skirmish.battle().field());
    let name = &skirmish.spec().name;
    for (index, unit) in state.units.iter().enumerate() {
        let profile = &field.profiles[usize::from(unit.kind)];
        assert!(
            (0.0..=profile.life).contains(&unit.life),
            "{name}: life {}",
            unit.life
        );
        assert!(
            (0.0..=profile.shield).contains(&unit.shield),
            "{name}: shield {}",
            unit.shield
        );
        assert!(
            (0.0..=profile.greatest_energy).contains(&unit.energy),
            "{name}: energy {}",
            unit.energy
        );
        assert!(
            was_alive[index] || !unit.is_alive(),
            "{name}: unit {index} rose from the dead"
        );
        was_alive[index] = unit.is_alive();
        let (x, y) = (state.x[index], state.y[index]);
        let Some(terrain) = field.terrain.for_layer(profile.layer) else {
            continue;
        };
        let (free_x, free_y) = terrain.pushed_out_of_walls(x, y, profile.inner_radius - 0.01);
        assert!(
            (free_x - x).abs() + (free_y - y).abs() < 1e-4,
            "{name}: unit {index} is in a wall at {x}, {y}"
        );
    }
}

#[test]
fn episodes_of_one_key_are_the_same_in_every_step_and_others_differ() {
    for name in ["3m", "2s3z"] {
        let hashes = |episode| {
            let mut hashes = Vec::new();
            let mut skirmish = make(name, &SkirmishSettings::default());
            play(
                &mut skirmish,
                ScriptedPolicy::Nearest,
                episode,
                |skirmish, _, _| {
                    hashes.push(skirmish.state_hash());
                },
            );
            hashes
        };
        assert_eq!(hashes(1), hashes(1), "{name}");
        assert_ne!(
            hashes(1),
            hashes(2),
            "{name}: the cooldown jitter makes episodes differ"
        );
    }
}

#[test]
fn an_episode_does_not_depend_on_those_before_it() {
    let mut used = make("2s3z", &SkirmishSettings::default());
    play(&mut used, ScriptedPolicy::Random, 0, |_, _, _| {});
    let mut observed = [Vec::new(), Vec::new()];
    for (skirmish, observed) in [used, make("2s3z", &SkirmishSettings::default())]
        .iter_mut()
        .zip(&mut observed)
    {
        play(skirmish, ScriptedPolicy::Random, 9, |_, observations, _| {
            observed.push(observations.clone());
        });
    }
    assert!(
        observed[0] == observed[1],
        "the second episode remembers the first"
    );
}
