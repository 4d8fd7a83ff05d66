//! The same episodes, to the bit, on every machine and in every build profile; and nothing that is not in the state matters.
//!
//! A difference means that trained agents will see different values: regenerate only with an entry in the changelog, by
//! `cargo test -p mackrl-env --test skirmish_golden -- --ignored`.

use std::fmt::Write;

use mackrl_env::{Action, AgentId, Draw, Environment, EpisodeKey, Observations, Stream};
use mackrl_skirmish::{SIMULATOR_VERSION, Skirmish, SkirmishSettings, UnitData, rules::Chance};

/// State hashes of each map after 40 and 120 random steps, with either set of statistics.
const GOLDEN: &str = include_str!("golden/skirmish_hashes.txt");
const MARKS: [usize; 2] = [40, 120];
/// What the recording was made with, whatever the default is: wide enough that all rules of a start are met.
const SPAWN_SCATTER: f32 = 0.5;
/// The version of the simulator, and a hash of what it recorded.
const RECORDED: (u32, u64) = (3, 0x6256_B6B4_7D88_5F3E);

/// Plays random available actions, episode after episode; `watch` is called after every step, counted from 1.
fn play(skirmish: &mut Skirmish, steps: usize, mut watch: impl FnMut(&Skirmish, usize)) {
    let spec = skirmish.spec().clone();
    let mut observations = Observations::new(&spec, 1);
    let mut actions = vec![Action::default(); spec.agents];
    let (mut episode, mut step) = (0, 0);
    let key = |episode| EpisodeKey::new(17, Stream::Other, episode);
    skirmish.reset(key(0), &mut observations.row_mut(0));
    for count in 1..=steps {
        for (agent, action) in actions.iter_mut().enumerate() {
            let available = observations.local_view(0, AgentId::new(agent)).available();
            let choices: Vec<usize> = (0..spec.actions).filter(|a| available[*a]).collect();
            let bits = key(episode).bits(step, Draw::Agent(agent));
            let choice = bits % choices.len() as u64;
            let choice = usize::try_from(choice).expect("there are few actions");
            *action = Action::new(choices[choice]);
        }
        step += 1;
        let time_step = skirmish
            .step(&actions, &mut observations.row_mut(0))
            .expect("only available actions are chosen");
        watch(skirmish, count);
        if time_step.end.is_some() {
            (episode, step) = (episode + 1, 0);
            skirmish.reset(key(episode), &mut observations.row_mut(0));
        }
    }
}

fn make(name: &str, units: UnitData) -> Skirmish {
    let settings = SkirmishSettings {
        units,
        spawn_scatter: SPAWN_SCATTER,
        ..SkirmishSettings::default()
    };
    mackrl_skirmish::make(name, &settings).expect("the map is shipped")
}

fn hashes() -> String {
    let mut text = String::from("map units after-40-steps after-120-steps\n");
    for name in mackrl_skirmish::map_names() {
        for (label, units) in [("liberty", UnitData::Liberty), ("lotv", UnitData::Lotv)] {
            let mut skirmish = make(name, units);
            write!(text, "{name} {label}").expect("a string takes all");
            play(&mut skirmish, MARKS[1], |skirmish, count| {
                if MARKS.contains(&count) {
                    write!(text, " {:016x}", skirmish.state_hash()).expect("a string takes all");
                }
            });
            text.push('\n');
        }
    }
    text
}

#[test]
fn every_map_plays_as_recorded() {
    for (found, recorded) in hashes().lines().zip(GOLDEN.lines()) {
        assert_eq!(found, recorded);
    }
    assert_eq!(
        GOLDEN.lines().count(),
        1 + 2 * mackrl_skirmish::map_names().len()
    );
}

#[test]
fn a_new_recording_is_a_new_version_of_the_simulator() {
    let fingerprint = GOLDEN.bytes().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01B3)
    });
    assert_eq!(
        (SIMULATOR_VERSION, fingerprint),
        RECORDED,
        "a new recording: raise SIMULATOR_VERSION, so that replays of the old one are refused, and note both here"
    );
}

#[test]
#[ignore = "writes the recording"]
fn record() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/golden/skirmish_hashes.txt"
    );
    std::fs::write(path, hashes()).expect("the folder is there");
}

#[test]
fn a_battle_put_back_into_its_own_state_at_every_step_goes_on_the_same() {
    for name in mackrl_skirmish::map_names() {
        let mut skirmish = make(name, UnitData::Liberty);
        let mut battle = skirmish.battle().clone();
        play(&mut skirmish, 60, |skirmish, count| {
            // The copy has forgotten all but the state: no buffer, no list of neighbours.
            battle.restore(skirmish.battle().state());
            let mut kept = skirmish.battle().clone();
            let key = EpisodeKey::new(18, Stream::Other, 0);
            for _ in 0..8 {
                battle.advance(&mut Chance::new(key, count));
                kept.advance(&mut Chance::new(key, count));
            }
            assert!(
                battle.state() == kept.state(),
                "{name}: step {count} is not its state alone"
            );
        });
    }
}
