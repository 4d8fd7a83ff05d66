//! Every configuration that is accepted can be trained with, and no text, however spoilt, makes reading it panic.

use std::ops::Bound::{self, Excluded, Included, Unbounded};

use mackrl::Error;
use mackrl_env::settings::Accepts;
use mackrl_run::{
    config::{Config, ConfigBuilder, ConfigError, Registry, Setting},
    training::Trainer,
};
use proptest::prelude::*;

/// Settings that decide how long a run takes, with the most that a test can wait for.
const COSTLY: &[(&str, u64)] = &[
    ("algorithm.hidden", 5),
    ("algorithm.critic_hidden", 5),
    ("algorithm.epochs", 3),
    ("algorithm.environments", 3),
    ("algorithm.mixing_hidden", 5),
    ("algorithm.hypernetwork_hidden", 5),
    ("algorithm.minibatches", 3),
    ("algorithm.minibatch_episodes", 3),
    ("test.episodes", 2),
    ("run.steps_env", 3),
];

/// Settings whose values have to go with those of others.
const COMBINED: &[&str] = &[
    "algorithm.exploration_start",
    "algorithm.exploration_finish",
    "env.shoot_range",
    "env.sight_range",
    "algorithm.partitions",
    "algorithm.levels",
    "algorithm.hold_steps_env",
    "algorithm.private_weight",
    "algorithm.minibatches",
    "algorithm.shards",
    "algorithm.memory_episodes",
    "algorithm.minibatch_episodes",
];

/// Values of settings that are words of another kind.
fn words(key: &str) -> &'static [&'static str] {
    match key {
        "env.map" => &["3m", "2s3z", "2m_vs_1z"],
        // Without them, a run begins untrained.
        "env.scenario" | "run.initial_weights" => &[""],
        "algorithm.partitions" => &["all", "round-robin", "sampled:1"],
        other => panic!("no values of {other} are known here"),
    }
}

/// A value that the setting takes, its ends included, as TOML.
fn value(key: &str, accepts: Accepts) -> BoxedStrategy<String> {
    let quoted = |word: &&str| format!("{word:?}");
    match accepts {
        Accepts::Flag => any::<bool>().prop_map(|flag| flag.to_string()).boxed(),
        Accepts::Integer { least, greatest } => {
            let costly = COSTLY.iter().find(|(costly, _)| *costly == key);
            let greatest = costly.map_or(greatest, |(_, most)| *most);
            let within = (least..=greatest).prop_map(|value| value.to_string());
            prop_oneof![Just(least.to_string()), Just(greatest.to_string()), within].boxed()
        }
        Accepts::Number { least, greatest } => {
            let [least, greatest] = [inner(least, 1.0), inner(greatest, -1.0)];
            let within = (0.0..=1.0).prop_map(move |share| least + share * (greatest - least));
            prop_oneof![Just(least), Just(greatest), within]
                .prop_map(move |value: f64| format!("{:?}", value.clamp(least, greatest)))
                .boxed()
        }
        Accepts::OneOf(words) => prop::sample::select(words)
            .prop_map(move |word| quoted(&word))
            .boxed(),
        _ => prop::sample::select(words(key))
            .prop_map(move |word| quoted(&word))
            .boxed(),
    }
}

/// The last number within a bound; `direction` leads inside.
fn inner(bound: Bound<f64>, direction: f64) -> f64 {
    match bound {
        Included(end) => end,
        // In single precision, in which worlds keep their settings, it must not become the end itself.
        Excluded(end) => end + direction * 1e-6,
        Unbounded => -direction * 1e30,
    }
}

/// Worlds and algorithms that need nothing but this program.
const CHOICES: [[&str; 2]; 12] = [
    ["env.name=skirmish", "algorithm.name=mackrl"],
    ["env.name=skirmish", "algorithm.name=central-v"],
    ["env.name=matrix-game", "algorithm.name=mackrl"],
    ["env.name=matrix-game", "algorithm.name=central-v"],
    ["env.name=skirmish", "algorithm.name=mackrl-ppo"],
    ["env.name=skirmish", "algorithm.name=ippo"],
    ["env.name=matrix-game", "algorithm.name=mackrl-ppo"],
    ["env.name=skirmish", "algorithm.name=iql"],
    ["env.name=skirmish", "algorithm.name=qmix"],
    ["env.name=matrix-game", "algorithm.name=vdn"],
    ["env.name=skirmish", "algorithm.name=mackrl-coma"],
    ["env.name=matrix-game", "algorithm.name=mackrl-coma"],
];

/// The settings of a choice, its names aside.
fn settings(choice: [&str; 2]) -> Vec<Setting> {
    let config = Config::with(&choice).expect("names of built-in kinds");
    let settings = config.settings().into_iter();
    settings
        .filter(|setting| !setting.key.ends_with(".name"))
        .collect()
}

prop_compose! {
    /// Any value for any setting of this choice, each set or left alone.
    fn assignments_of(choice: [&'static str; 2])(
        values in settings(choice)
            .into_iter()
            .map(|setting| prop::option::of(value(&setting.key, setting.accepts).prop_map({
                let key = setting.key.clone();
                move |value| format!("{key}={value}")
            })))
            .collect::<Vec<_>>(),
    ) -> Vec<String> {
        let settings = settings(choice);
        let has = |key: &str| settings.iter().any(|setting| setting.key == key);
        let short = COSTLY.iter().filter(|(key, _)| has(key));
        let short = short.map(|(key, most)| format!("{key}={most}"));
        let choice = choice.map(str::to_owned).into_iter();
        choice.chain(short).chain(values.into_iter().flatten()).collect()
    }
}

fn assignments() -> impl Strategy<Value = Vec<String>> {
    prop::sample::select(&CHOICES[..]).prop_flat_map(assignments_of)
}

/// The configuration of these assignments, without those that do not go with others: the error says which.
fn configuration(mut assignments: Vec<String>) -> Result<Config, ConfigError> {
    loop {
        let layers = assignments
            .iter()
            .try_fold(ConfigBuilder::new(&Registry::built_in()), |builder, one| {
                builder.set(one)
            })?;
        let key = match layers.build() {
            Err(ConfigError::WrongValue { key, .. })
                if COMBINED.contains(&&*key) && layers.written(&key).is_some() =>
            {
                key
            }
            other => return other,
        };
        assignments.retain(|assignment| !assignment.starts_with(&format!("{key}=")));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 80, ..ProptestConfig::default() })]

    #[test]
    fn every_valid_configuration_runs(assignments in assignments()) {
        let config = configuration(assignments).map_err(|error| TestCaseError::fail(error.to_string()))?;
        let mut trainer = Trainer::new(&config, 1).map_err(|error| TestCaseError::fail(error.to_string()))?;
        while !trainer.finished() {
            match trainer.update() {
                Ok(_) => {}
                // Rewards of 10⁹ and steps of 1 may leave the numbers that a machine can hold, and are told so.
                Err(Error::NotFinite { .. }) => break,
                Err(error) => return Err(TestCaseError::fail(error.to_string())),
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 800, ..ProptestConfig::default() })]

    #[test]
    fn no_spoilt_preset_makes_reading_panic(
        preset in prop::sample::select(Registry::built_in().presets().collect::<Vec<_>>()),
        spoils in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0..4_u8), 1..5),
    ) {
        let mut text: Vec<char> = preset.text.chars().collect();
        for (place, other, kind) in spoils {
            let (place, other) = (place.index(text.len()), other.index(text.len()));
            match kind {
                0 => { text.remove(place); }
                1 => text.insert(place, text[other]),
                2 => text.swap(place, other),
                _ => { text.drain(place.min(other)..place.max(other)); }
            }
            if text.is_empty() { break; }
        }
        let text: String = text.into_iter().collect();
        if let Ok(builder) = ConfigBuilder::new(&Registry::built_in()).file("spoilt.toml", &text) {
            let _ = builder.build();
        }
    }
}
