use std::io::{Read, Write};

use flate2::{Compression, read::GzDecoder, write::GzEncoder};
use mackrl::{common_knowledge::common_knowledge, policy::GroupChoice};
use mackrl_env::{AgentId, EntityId, EntitySet, EpisodeKey, Stream};
use mackrl_skirmish::SIMULATOR_VERSION;

use super::*;
use crate::{
    config::{Config, ConfigBuilder, Registry},
    training::{Trainer, evaluate},
};

fn config(overrides: &[&str]) -> Config {
    let own = ["run.steps_env=100", "algorithm.name=mackrl"];
    Config::with(&[&own[..], overrides].concat()).unwrap()
}

/// An episode of an untrained team that explores.
fn sampled(overrides: &[&str]) -> Replay {
    let config = config(overrides);
    let weights = Trainer::new(&config, 1).unwrap().weights();
    let key = EpisodeKey::new(3, Stream::Other, 5);
    record_policy(&config, &weights, Behaviour::sampled(0.3), key).unwrap()
}

fn unpacked(bytes: &[u8]) -> String {
    let mut text = String::new();
    GzDecoder::new(bytes).read_to_string(&mut text).unwrap();
    text
}

fn packed(text: &str) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(text.as_bytes()).unwrap();
    encoder.finish().unwrap()
}

/// The error that `change` of the file's text leads to, on reading or on playing.
fn error_after(replay: &Replay, change: impl Fn(String) -> String) -> ReplayError {
    let bytes = packed(&change(unpacked(&replay.to_bytes())));
    match Replay::from_bytes(&bytes) {
        Ok(replay) => replay.play().map(|_| ()).unwrap_err(),
        Err(error) => error,
    }
}

#[test]
fn a_replay_comes_back_from_its_bytes_and_plays_as_recorded() {
    for overrides in [
        &["env.map=2s3z"][..],
        &["algorithm.name=central-v"],
        &["algorithm.partitions=round-robin"],
    ] {
        let replay = sampled(overrides);
        let read = Replay::from_bytes(&replay.to_bytes()).unwrap();
        assert_eq!(read, replay, "{overrides:?}");
        let playback = read.play().unwrap();
        assert_eq!(playback.steps(), replay.steps.len());
        assert_eq!(playback.moments.len(), replay.steps.len() + 1);
        assert!(playback.end.is_some(), "{overrides:?}");
    }
}

#[test]
fn a_watched_greedy_episode_is_that_of_the_evaluation() {
    let config = config(&[]);
    let weights = Trainer::new(&config, 1).unwrap().weights();
    let evaluation = evaluate(&config, &weights, 1, 7, 1).unwrap();
    let key = EpisodeKey::new(7, Stream::Evaluation, 0);
    let replay = record_policy(&config, &weights, Behaviour::GREEDY, key).unwrap();
    let rewards = replay.play().unwrap().reward_t;
    let total: f64 = rewards.iter().map(|reward| f64::from(*reward)).sum();
    assert_eq!(Some(total), evaluation.mean("return"));
    assert_eq!(
        Some(replay.steps.len() as f64),
        evaluation.mean("ep_length")
    );
}

#[test]
fn the_probability_of_the_way_is_the_product_of_its_choices() {
    let replay = sampled(&[]);
    let mut joint = 0;
    for step in &replay.steps {
        let thought = step.thought.as_ref().unwrap();
        let solo = |agent: AgentId| {
            let row = thought.agents.iter().find(|row| row.agent == agent);
            let taken = step.actions[agent.index()];
            let options = row.into_iter().flat_map(|row| &row.options);
            let option = options.into_iter().find(|option| option.action == taken);
            // The dead have one choice.
            option.map_or(1.0, |option| f64::from(option.probability))
        };
        let chosen = &thought.partitions[thought.chosen.unwrap()];
        let mut probability = f64::from(chosen.probability);
        for group in &chosen.groups {
            let pair = thought
                .pairs
                .iter()
                .find(|pair| pair.members[..] == group[..]);
            let actions: Vec<Action> = group.iter().map(|a| step.actions[a.index()]).collect();
            probability *= match pair {
                Some(pair) if pair.choice == Some(GroupChoice::Joint) => {
                    joint += 1;
                    let mut options = pair.joint.iter();
                    let option = options.find(|option| option.actions[..] == actions[..]);
                    f64::from(option.unwrap().probability)
                }
                pair => {
                    let delegate = pair.map_or(1.0, |pair| f64::from(pair.delegate));
                    delegate * group.iter().copied().map(solo).product::<f64>()
                }
            };
        }
        assert!(
            (probability / thought.log_p_path.exp() - 1.0).abs() < 1e-4,
            "{probability} of the choices, {} recorded",
            thought.log_p_path.exp()
        );
        assert!(
            thought.log_p_path <= thought.log_p + 1e-5,
            "one of many ways"
        );
        let posterior: f32 = thought.partitions.iter().map(|p| p.posterior).sum();
        assert!((posterior - 1.0).abs() < 1e-4, "{posterior}");
    }
    assert!(joint > 0, "some pair acts jointly");
}

#[test]
fn the_knowledge_of_a_group_falls_into_parts_that_are_all_of_it() {
    // Figure 1: A and B see each other and both see C, e0 (3); C sees B alone. A sees e1 (4) too.
    let visible_n = [0b1_1111, 0b0_1111, 0b0_1110].map(EntitySet::from_bits);
    let group = |members: &[usize]| -> Vec<AgentId> {
        members.iter().map(|member| AgentId::new(*member)).collect()
    };
    let pair = GroupKnowledge::of(&group(&[0, 1]), &visible_n);
    assert_eq!(pair.common.bits(), 0b0_1111);
    assert!(pair.mutual.is_empty() && pair.unseen.is_empty(), "{pair:?}");
    assert_eq!(pair.private.len(), 1);
    assert_eq!(pair.private[0].seen_by, group(&[0]));
    assert!(pair.private[0].entities.contains(EntityId::new(4)), "e1");

    let team = GroupKnowledge::of(&group(&[0, 1, 2]), &visible_n);
    assert!(team.common.is_empty(), "C does not see A");
    assert_eq!(team.mutual.bits(), 0b0_1110);
    assert_eq!(team.unseen, [(AgentId::new(2), AgentId::new(0))]);
    assert_eq!(team.private.len(), 2);
    for members in [vec![0], vec![1, 2], vec![0, 1, 2], vec![]] {
        let members = group(&members);
        let knowledge = GroupKnowledge::of(&members, &visible_n);
        assert_eq!(knowledge.common, common_knowledge(&members, &visible_n));
        assert_eq!(
            knowledge.unseen.is_empty(),
            members.is_empty() || !knowledge.common.is_empty()
        );
    }
}

#[test]
fn a_replay_of_another_simulator_is_refused_with_the_version_that_plays_it() {
    let replay = sampled(&[]);
    let own = format!("\"simulator\":{SIMULATOR_VERSION}");
    let error = error_after(&replay, |text| {
        let other = text.replacen(&own, "\"simulator\":904", 1);
        other.replacen(
            "\"program\":\"0.1.0\"",
            "\"program\":\"8.7.6\\u001b[2J\"",
            1,
        )
    });
    assert_eq!(
        error.to_string(),
        format!(
            "recorded by mackrl 8.7.6[2J with simulator version 904, this program has version {SIMULATOR_VERSION}"
        )
    );
}

#[test]
fn what_a_stranger_changed_is_found_out() {
    let replay = sampled(&[]);
    let hash = replay.steps[2].state_hash.clone();
    let error = error_after(&replay, |text| text.replacen(&hash, "0123456789abcdef", 1));
    assert!(
        matches!(error, ReplayError::Differs { step: 3, .. }),
        "{error}"
    );
    let cases: [(&str, &str, &str); 7] = [
        (
            "\"actions\":[",
            "\"actions\":[77,",
            "step 1: 4 actions, expected one for each of 3",
        ),
        (
            "\"known\":[0,1",
            "\"known\":[1",
            "step 1: common knowledge of agents 0 and 1",
        ),
        (
            "\"version\":1",
            "\"version\":2",
            "version 2, expected \"mackrl-replay\" version 1",
        ),
        (
            "\"sight_range\":9.0",
            "\"sight_range\":-1.0",
            "damaged replay: env: ",
        ),
        (
            "\"agent\":0",
            "\"agent\":60000",
            "step 1: agent 60000, expected less than 3",
        ),
        ("\"steps\":", "\"steps\":1", "expected 1"),
        (
            "\"delegate\":",
            "\"delegate\":7",
            "expected a number in [0, 1]",
        ),
    ];
    for (from, to, expected) in cases {
        let error = error_after(&replay, |text| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, 1)
        });
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn the_joint_action_of_a_team_is_told_of_the_living_and_checked() {
    let replay = sampled(&["algorithm.name=jal", "env.sight_range=64"]);
    let playback = Replay::from_bytes(&replay.to_bytes()).and_then(|read| read.play());
    let playback = playback.unwrap();
    let mut sizes = std::collections::BTreeSet::new();
    for (step, moment) in replay.steps.iter().zip(&playback.moments) {
        let thought = step.thought.as_ref().expect("an acting team");
        let [team] = &thought.groups[..] else {
            panic!("one group: {:?}", thought.groups);
        };
        sizes.insert(team.members.len());
        let alive = |agent: &AgentId| !moment.visible_n[agent.index()].is_empty();
        assert!(team.members.iter().all(alive), "the dead take no part");
        let taken: Vec<_> = team
            .members
            .iter()
            .map(|a| step.actions[a.index()])
            .collect();
        let option = team.joint.iter().find(|option| option.actions == taken);
        let p = f64::from(option.expect("what was done is told").probability);
        assert!(
            (p.ln() - thought.log_p).abs() < 1e-4,
            "{p} {}",
            thought.log_p
        );
        assert_eq!(thought.log_p, thought.log_p_path);
    }
    assert!(sizes.len() > 1, "nobody dies: {sizes:?}");
    for (from, to, expected) in [
        (
            "\"joint\":[{\"actions\":[",
            "\"joint\":[{\"actions\":[1,",
            "one of each member",
        ),
        (
            "\"joint\":[{\"actions\":[",
            "\"joint\":[{\"actions\":[1",
            "expected less than 9",
        ),
        (
            "\"members\":[0",
            "\"members\":[99",
            "agent 99, expected less than 3",
        ),
    ] {
        let error = error_after(&replay, |text| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, 1)
        });
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    let bytes = sampled(&[]).to_bytes();
    for end in (0..bytes.len()).step_by(97) {
        Replay::from_bytes(&bytes[..end]).unwrap_err();
    }
    Replay::from_bytes(b"not gzip at all").unwrap_err();
}

#[test]
fn a_bomb_is_not_unpacked() {
    // A hundred million bytes on one line, in a hundred thousand.
    let mut text = String::from("{\"format\":\"mackrl-replay\",\"version\":1,\"simulator\":");
    text.extend(std::iter::repeat_n(' ', 300 << 20));
    let error = Replay::from_bytes(&packed(&text)).unwrap_err();
    assert!(error.to_string().contains("no replay of mackrl"), "{error}");
}

#[test]
fn whatever_a_stranger_changes_nothing_panics() {
    let replay = sampled(&[]);
    let text = unpacked(&replay.to_bytes());
    let key = EpisodeKey::new(1, Stream::Other, 0);
    let mut refused = 0;
    for trial in 0..200 {
        let [place, byte] = [0, 1].map(|draw| key.bits(trial, mackrl_env::Draw::World(draw)));
        let mut bytes = text.clone().into_bytes();
        let place = usize::try_from(place % bytes.len() as u64).unwrap();
        bytes[place] = b"0123456789-,:[]{}\"x"[usize::try_from(byte % 19).unwrap()];
        let changed = String::from_utf8(bytes).unwrap();
        let outcome = Replay::from_bytes(&packed(&changed)).and_then(|replay| replay.play());
        refused += usize::from(outcome.is_err());
    }
    assert!(refused > 50, "{refused} of 200 are refused");
}

#[test]
fn in_figure_1_two_agents_commonly_know_what_both_see_and_the_third_stands_apart() {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/scenarios/figure1.toml"
    );
    let env = ConfigBuilder::new(&Registry::built_in())
        .set("env.map=folder/figure1.toml")
        .and_then(|builder| builder.set("env.sight_range=6"))
        .and_then(|builder| builder.set("env.shoot_range=4"))
        .unwrap()
        .scenario(&std::fs::read_to_string(file).unwrap())
        .build_environment()
        .unwrap();
    let key = EpisodeKey::new(1, Stream::Other, 0);
    let replay = record_script(&env, ScriptedPolicy::Idle, key).unwrap();
    assert_eq!(
        replay.env.map(),
        "figure1.toml",
        "no folder of this machine"
    );
    let playback = replay.play().unwrap();
    let names = Names::new(&playback.skirmish);
    let known = |set: EntitySet| -> Vec<String> { set.iter().map(|e| names.entity(e)).collect() };
    let [a, b, c] = [0, 1, 2].map(AgentId::new);
    let pair = playback.knowledge(0, &[a, b]);
    assert_eq!(known(pair.common), ["A", "B", "e0", "e1"]);
    let private: Vec<_> = pair.private.iter().map(|p| known(p.entities)).collect();
    assert_eq!(private, [["e2"], ["e4"]]);
    let apart = playback.knowledge(0, &[b, c]);
    assert!(apart.common.is_empty(), "{apart:?}");
    assert_eq!(known(apart.mutual), ["e1", "e2"]);
}
