//! Files that the libraries read: configuration, scenarios, weights, checkpoints, replays.

use std::io::{Read, Write};

use fastrand::Rng;
use flate2::{Compression, read::GzDecoder, write::GzEncoder};
use mackrl_env::{EpisodeKey, Stream, random_play::RandomPlay};
use mackrl_run::{
    config::{Config, ConfigBuilder, Registry},
    replay::{Replay, record_script},
    training::{Checkpoint, Trainer, assembly, read_weights},
};
use mackrl_skirmish::{SkirmishSettings, scripted::ScriptedPolicy};

use crate::{Target, mutation};

/// The commented example of a scenario.
fn example() -> String {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/scenarios/sniper-alley.toml"
    );
    std::fs::read_to_string(file).expect("the example is in the repository")
}

/// The text of a configuration.
pub(crate) struct Configuration;

impl Target for Configuration {
    fn name(&self) -> &'static str {
        "configuration"
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        let registry = Registry::built_in();
        let presets = registry.presets().map(|preset| preset.text.to_owned());
        let complete = [Config::default().to_toml()];
        presets.chain(complete).map(String::into_bytes).collect()
    }

    fn words(&self) -> Vec<String> {
        let settings = Registry::built_in()
            .settings()
            .into_iter()
            .map(|setting| setting.key);
        let values = [
            "true",
            "\"sampled:9999\"",
            "\"matrix-game\"",
            "\"27m_vs_30m\"",
            "\"a.toml\"",
        ];
        settings.chain(values.map(str::to_owned)).collect()
    }

    fn read(&mut self, input: &[u8]) -> Result<(), String> {
        let text = String::from_utf8_lossy(input);
        let built = ConfigBuilder::new(&Registry::built_in())
            .file("stranger.toml", &text)
            .and_then(|builder| builder.build());
        let assigned = ConfigBuilder::new(&Registry::built_in())
            .set(&text)
            .and_then(|builder| builder.build());
        for result in [built, assigned] {
            match result {
                Ok(config) => {
                    let again =
                        ConfigBuilder::new(&Registry::built_in()).file("again", &config.to_toml());
                    if again.and_then(|builder| builder.build()) != Ok(config) {
                        return Err(
                            "a configuration that is accepted cannot be read again".to_owned()
                        );
                    }
                }
                Err(error) if error.to_string().len() > 1000 => {
                    return Err(format!("a message of {} bytes", error.to_string().len()));
                }
                Err(_) => {}
            }
        }
        Ok(())
    }
}

/// The text of a scenario.
pub(crate) struct Scenario;

impl Target for Scenario {
    fn name(&self) -> &'static str {
        "scenario"
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        vec![example().into_bytes()]
    }

    fn words(&self) -> Vec<String> {
        let example = example();
        let words = example.split(|c: char| c.is_whitespace() || "=[]{},".contains(c));
        words
            .filter(|word| word.len() > 2)
            .map(str::to_owned)
            .collect()
    }

    fn read(&mut self, input: &[u8]) -> Result<(), String> {
        let text = String::from_utf8_lossy(input);
        match mackrl_skirmish::make_custom("stranger.toml", &text, &SkirmishSettings::default()) {
            Ok(world) => {
                let mut play = RandomPlay::new(Box::new(world), 1);
                (0..3).try_for_each(|_| play.step().map(drop).map_err(|error| error.to_string()))
            }
            // However long the message is, the program shows the beginning of it.
            Err(_) => Ok(()),
        }
    }
}

/// The smallest team that can be trained.
fn small() -> Config {
    let settings = [
        "algorithm.hidden=2",
        "algorithm.environments=1",
        "test.episodes=1",
        "run.steps_env=300",
    ];
    Config::with(&settings).expect("settings that there are")
}

/// Words of the formats in which weights and counters are kept.
fn words() -> Vec<String> {
    [
        "F32",
        "F64",
        "I8",
        "BF16",
        "dtype",
        "shape",
        "data_offsets",
        "__metadata__",
        "target.",
        "null",
        "[]",
        "{}",
    ]
    .map(str::to_owned)
    .to_vec()
}

/// A safetensors file of which the header is spoilt and its length made right, or which is spoilt anywhere.
fn spoilt_tensors(seeds: &[Vec<u8>], words: &[String], rng: &mut Rng) -> Vec<u8> {
    let Some((length, rest)) = mutation::pick(seeds, rng).and_then(|seed| seed.split_first_chunk())
    else {
        return Vec::new();
    };
    let length = usize::try_from(u64::from_le_bytes(*length)).unwrap_or(0);
    if rng.u8(..3) == 0 || length > rest.len() {
        return mutation::mutated(seeds, words, rng);
    }
    let (header, data) = rest.split_at(length);
    let header = mutation::mutated(&[header.to_vec()], words, rng);
    let length = (header.len() as u64).to_le_bytes();
    [&length[..], &header, data].concat()
}

/// Weights as safetensors.
#[derive(Default)]
pub(crate) struct Weights {
    layout: Option<mackrl::nn::ParameterLayout>,
}

impl Target for Weights {
    fn name(&self) -> &'static str {
        "weights"
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        let trainer = Trainer::new(&small(), 1).expect("a small team can be trained");
        vec![trainer.weights(), trainer.checkpoint().tensors]
    }

    fn words(&self) -> Vec<String> {
        words()
    }

    fn input(&self, seeds: &[Vec<u8>], words: &[String], rng: &mut Rng) -> Vec<u8> {
        spoilt_tensors(seeds, words, rng)
    }

    fn read(&mut self, input: &[u8]) -> Result<(), String> {
        let layout = self.layout.get_or_insert_with(|| {
            let world = assembly::RunWorld::new(&small()).expect("a shipped map");
            let team = assembly::algorithm(&small(), &world, 1).expect("a small team");
            team.policy().layout().clone()
        });
        match read_weights(layout, input) {
            Ok(weights) if weights.iter().any(|weight| !weight.is_finite()) => {
                Err("a weight is not finite".to_owned())
            }
            Ok(_) | Err(mackrl::Error::Data(_)) => Ok(()),
            Err(error) => Err(format!("another kind of error: {error}")),
        }
    }
}

/// Checkpoints: tensors, a zero byte if they end there, and counters. The first byte tells which of the two is spoilt.
#[derive(Default)]
pub(crate) struct Checkpoints {
    trainer: Option<Trainer>,
    sound: Option<Checkpoint>,
}

impl Checkpoints {
    fn sound(&mut self) -> Checkpoint {
        let trainer = self
            .trainer
            .get_or_insert_with(|| Trainer::new(&small(), 1).expect("a small team can be trained"));
        self.sound
            .get_or_insert_with(|| {
                for _ in 0..3 {
                    trainer.update().expect("a small team learns");
                }
                trainer.checkpoint()
            })
            .clone()
    }
}

impl Target for Checkpoints {
    fn name(&self) -> &'static str {
        "checkpoint"
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        let Checkpoint {
            tensors, counters, ..
        } = Self::default().sound();
        vec![tensors, counters]
    }

    fn words(&self) -> Vec<String> {
        words()
    }

    fn input(&self, seeds: &[Vec<u8>], words: &[String], rng: &mut Rng) -> Vec<u8> {
        let (tensors, counters) = seeds.split_at(1);
        if rng.bool() {
            spoilt_tensors(tensors, words, rng)
        } else {
            mutation::mutated(counters, words, rng)
        }
    }

    /// Takes text for counters and anything else for tensors; the other half is sound.
    fn read(&mut self, input: &[u8]) -> Result<(), String> {
        let mut checkpoint = self.sound();
        if input.first().is_some_and(|byte| *byte == b'{') {
            checkpoint.counters = input.to_vec();
        } else {
            checkpoint.tensors = input.to_vec();
        }
        let trainer = self.trainer.as_mut().ok_or("the trainer was made above")?;
        match trainer.restore(&checkpoint) {
            Err(mackrl::Error::Data(_)) => Ok(()),
            Err(error) => Err(format!("another kind of error: {error}")),
            Ok(()) if trainer.finished() => Ok(()),
            Ok(()) => match trainer.update() {
                Ok(_) | Err(mackrl::Error::NotFinite { .. }) => Ok(()),
                Err(error) => Err(format!("a restored run cannot go on: {error}")),
            },
        }
    }
}

/// Replays: packed lines of JSON.
pub(crate) struct Replays;

fn unpacked(packed: &[u8]) -> Vec<u8> {
    let mut text = Vec::new();
    // What a spoilt archive held before it broke is as good.
    let _ = GzDecoder::new(packed).read_to_end(&mut text);
    text
}

fn packed(text: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(text).expect("memory takes all");
    encoder.finish().expect("memory takes all")
}

impl Target for Replays {
    fn name(&self) -> &'static str {
        "replay"
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        let config = Config::default();
        let key = EpisodeKey::new(1, Stream::Evaluation, 1);
        let replay = record_script(&config.env, ScriptedPolicy::FocusFire, key);
        vec![replay.expect("a scripted battle").to_bytes()]
    }

    fn words(&self) -> Vec<String> {
        [
            "env",
            "map",
            "scenario",
            "\"27m_vs_30m\"",
            "actions",
            "steps",
            "key",
            "null",
            "\\u0000",
            "[]",
            "thought",
        ]
        .map(str::to_owned)
        .to_vec()
    }

    fn input(&self, seeds: &[Vec<u8>], words: &[String], rng: &mut Rng) -> Vec<u8> {
        if rng.u8(..4) == 0 {
            return mutation::mutated(seeds, words, rng);
        }
        let texts: Vec<Vec<u8>> = seeds.iter().map(|seed| unpacked(seed)).collect();
        packed(&mutation::mutated(&texts, words, rng))
    }

    fn read(&mut self, input: &[u8]) -> Result<(), String> {
        let Ok(replay) = Replay::from_bytes(input) else {
            return Ok(());
        };
        match replay.play() {
            Ok(playback) if playback.steps() != replay.steps.len() => {
                Err("not all steps were played".to_owned())
            }
            _ => Ok(()),
        }
    }
}
