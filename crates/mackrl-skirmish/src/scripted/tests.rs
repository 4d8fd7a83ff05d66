use mackrl_env::Stream;

use super::*;
use crate::{SkirmishSettings, make};

/// Battles won, and the sum of dead enemies, over `episodes` episodes.
fn play(map: &str, policy: ScriptedPolicy, episodes: u64) -> (u64, usize) {
    let mut skirmish = make(map, &SkirmishSettings::default()).unwrap();
    let mut team = ScriptedTeam::new(policy, &skirmish);
    let mut observations = Observations::new(skirmish.spec(), 1);
    let mut actions = vec![Action::default(); skirmish.spec().agents];
    let (mut won, mut dead_enemies) = (0, 0);
    for episode in 0..episodes {
        let key = EpisodeKey::new(3, Stream::Other, episode);
        skirmish.reset(key, &mut observations.row_mut(0));
        for step in 0.. {
            team.act(&observations, 0, (key, step), &mut actions);
            let time_step = skirmish.step(&actions, &mut observations.row_mut(0));
            if time_step.unwrap().end.is_some() {
                break;
            }
        }
        won += u64::from(skirmish.battle_statistics().battle_won);
        dead_enemies += skirmish.battle_statistics().dead_enemies;
    }
    (won, dead_enemies)
}

#[test]
fn agents_walk_to_an_enemy_that_stays_at_home() {
    let (_, dead_or_hurt) = play("2s_vs_1sc", ScriptedPolicy::Idle, 1);
    assert_eq!(dead_or_hurt, 0, "the idle never fight");
    let mut skirmish = make("2s_vs_1sc", &SkirmishSettings::default()).unwrap();
    let mut team = ScriptedTeam::new(ScriptedPolicy::Nearest, &skirmish);
    let mut observations = Observations::new(skirmish.spec(), 1);
    let mut actions = vec![Action::default(); 2];
    let key = EpisodeKey::new(3, Stream::Other, 0);
    skirmish.reset(key, &mut observations.row_mut(0));
    let full = skirmish.battle().state().units[2].life;
    for step in 0..30 {
        team.act(&observations, 0, (key, step), &mut actions);
        skirmish
            .step(&actions, &mut observations.row_mut(0))
            .unwrap();
    }
    assert!(
        skirmish.battle().state().units[2].life < full,
        "nobody has found the spine crawler"
    );
}

#[test]
fn kiting_stalkers_kill_zealots_that_standing_ones_do_not() {
    let (_, standing) = play("3s_vs_5z", ScriptedPolicy::Nearest, 30);
    let (_, kiting) = play("3s_vs_5z", ScriptedPolicy::Kite, 30);
    assert!(kiting > standing + 5, "{kiting} killed against {standing}");
}

#[test]
fn medivacs_heal_the_wounded() {
    let mut skirmish = make("MMM", &SkirmishSettings::default()).unwrap();
    let mut team = ScriptedTeam::new(ScriptedPolicy::Nearest, &skirmish);
    let mut observations = Observations::new(skirmish.spec(), 1);
    let mut actions = vec![Action::default(); skirmish.spec().agents];
    let key = EpisodeKey::new(3, Stream::Other, 0);
    skirmish.reset(key, &mut observations.row_mut(0));
    let healer = (0..actions.len())
        .position(|agent| {
            let kind = skirmish.scenario().recruits[agent].kind;
            let profiles = &skirmish.scenario().field.profiles;
            profiles[usize::from(kind)].care.is_some()
        })
        .unwrap();
    let mut healed = 0;
    for step in 0.. {
        team.act(&observations, 0, (key, step), &mut actions);
        let action = actions[healer].index();
        if action >= 6 {
            let patient = &skirmish.battle().state().units[action - 6];
            let full = skirmish.scenario().field.profiles[usize::from(patient.kind)].life;
            assert!(
                patient.life < full,
                "step {step}: agent {} is whole",
                action - 6
            );
            healed += 1;
        }
        let time_step = skirmish.step(&actions, &mut observations.row_mut(0));
        if time_step.unwrap().end.is_some() {
            break;
        }
    }
    assert!(healed > 5, "healed in {healed} steps");
}

#[test]
fn random_choice_reaches_every_available_action() {
    let available = [false, true, false, true, true];
    let chosen: Vec<usize> = [0.0, 0.34, 0.99]
        .map(|uniform| nth_available(&available, uniform))
        .to_vec();
    assert_eq!(chosen, [1, 3, 4]);
}

#[test]
fn names_are_what_the_files_say() {
    for policy in ScriptedPolicy::ALL {
        let name = toml::Value::String(policy.name().to_owned());
        assert_eq!(ScriptedPolicy::deserialize(name).unwrap(), policy);
    }
}
