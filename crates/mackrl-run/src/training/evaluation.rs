//! Greedy episodes with fixed weights.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, atomic::AtomicBool},
};

use mackrl::{
    Error,
    experience::{Collector, Episode, PlaySettings},
    policy::{Behaviour, Parameters, Policy, Recording, Tally},
};
use mackrl_env::{Action, EnvironmentSpec, EpisodeKey, Stream};
use serde::{Serialize, Serializer, ser::SerializeMap};

use super::assembly;
use crate::config::Config;

/// Episodes that are played at once.
const PARALLEL_EPISODES: usize = 32;
/// Steps of an opening.
const OPENING: usize = 10;
/// Environments of a shard.
const SHARD_SIZE: usize = 8;

/// How a team plays: means over episodes, each with its standard error.
///
/// As JSON it is an object of numbers: for every quantity `test_NAME_mean` and `test_NAME_sem`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Evaluation {
    /// Episodes played.
    pub episodes: usize,
    /// The world's success, if it declares one, then `return`, undiscounted, and `ep_length`, in environment steps, then the
    /// other statistics that it declares.
    pub quantities: Vec<Quantity>,
    /// What the controllers did, under the names that `METRICS` explains.
    pub controllers: BTreeMap<String, f64>,
    /// The number of different openings (the joint actions of the first 10 steps) over that of episodes: a team that plays one
    /// script whatever it sees has few.
    pub distinct_openings: f64,
}

/// Something measured in every episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Name, such as `return`.
    pub name: String,
    /// Mean over the episodes.
    pub mean: f64,
    /// Its standard error.
    pub standard_error: f64,
}

impl Evaluation {
    /// The mean over the episodes of the quantity called `name`, such as `return` or a statistic of the world.
    #[must_use]
    pub fn mean(&self, name: &str) -> Option<f64> {
        let quantity = self
            .quantities
            .iter()
            .find(|quantity| quantity.name == name);
        quantity.map(|quantity| quantity.mean)
    }
}

impl Serialize for Evaluation {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("episodes", &self.episodes)?;
        for quantity in &self.quantities {
            let name = &quantity.name;
            map.serialize_entry(&format!("test_{name}_mean"), &quantity.mean)?;
            map.serialize_entry(&format!("test_{name}_sem"), &quantity.standard_error)?;
        }
        for (name, mean) in &self.controllers {
            map.serialize_entry(name, mean)?;
        }
        map.end()
    }
}

/// Plays `episodes` greedy episodes with the weights of a safetensors file. `threads` changes no result.
///
/// # Errors
/// [`Error::Config`] or [`Error::Data`] if configuration and weights cannot be used together.
pub fn evaluate(
    config: &Config,
    weights: &[u8],
    episodes: usize,
    seed: u64,
    threads: usize,
) -> Result<Evaluation, Error> {
    evaluate_in(
        &assembly::RunWorld::new(config)?,
        config,
        weights,
        Episodes {
            count: episodes,
            seed,
        },
        threads,
    )
}

/// Which episodes are played.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Episodes {
    /// How many.
    pub count: usize,
    /// The seed that names them.
    pub seed: u64,
}

/// As [`evaluate`], in a world that need not be the built-in simulator's.
///
/// # Errors
/// As [`evaluate`], and [`Error::Step`] if the world cannot be played in any more.
pub fn evaluate_in(
    world: &assembly::RunWorld,
    config: &Config,
    weights: &[u8],
    episodes: Episodes,
    threads: usize,
) -> Result<Evaluation, Error> {
    evaluate_each(world, config, weights, episodes, threads, &mut |_| ())
}

/// As [`evaluate_in`]; gives `each` what was measured of every episode, in the order of their numbers.
///
/// # Errors
/// As [`evaluate_in`].
pub fn evaluate_each(
    world: &assembly::RunWorld,
    config: &Config,
    weights: &[u8],
    episodes: Episodes,
    threads: usize,
    each: &mut dyn FnMut(&EpisodeResult<'_>),
) -> Result<Evaluation, Error> {
    let algorithm = assembly::trained(config, world, weights)?;
    let mut evaluator = Evaluator::new(algorithm.policy(), world, episodes.count, threads);
    let key = |episode| EpisodeKey::new(episodes.seed, Stream::Evaluation, episode);
    evaluator.play_each(algorithm.parameters(), episodes.count, key, each)
}

/// What was measured of one episode.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeResult<'a> {
    /// Its number, from 0.
    pub episode: u64,
    /// Names and values, as [`Evaluation::quantities`] has their means.
    pub values: Vec<(&'a str, f64)>,
}

/// Environments in which greedy episodes are played.
#[derive(Debug)]
pub(super) struct Evaluator {
    collector: Collector,
    samples: Samples,
}

impl Evaluator {
    /// Room for playing some of `episodes` episodes at once.
    pub(super) fn new(
        policy: &dyn Policy,
        world: &assembly::RunWorld,
        episodes: usize,
        threads: usize,
    ) -> Self {
        let parallel_max = world.source().parallel_max().unwrap_or(PARALLEL_EPISODES);
        let environments = world.environments(episodes.clamp(1, parallel_max.max(1)));
        let shards = environments.len().div_ceil(SHARD_SIZE);
        Self {
            collector: Collector::new(policy, environments, shards, threads),
            samples: Samples::of(world.spec()),
        }
    }

    /// Gives up playing as soon as `stop` is set.
    pub(super) fn stop_when(&mut self, stop: &Arc<AtomicBool>) {
        self.collector.stop_when(stop);
    }

    /// Episodes that were played in vain because a world failed.
    pub(super) fn discarded(&self) -> u64 {
        self.collector.discarded()
    }

    /// Plays `episodes` greedy episodes, of which number `i` is named `key(i)`.
    pub(super) fn play(
        &mut self,
        parameters: &Parameters,
        episodes: usize,
        key: impl Fn(u64) -> EpisodeKey,
    ) -> Result<Evaluation, Error> {
        self.play_each(parameters, episodes, key, &mut |_| ())
    }

    /// As [`Self::play`]; gives `each` what was measured of every episode.
    fn play_each(
        &mut self,
        parameters: &Parameters,
        episodes: usize,
        key: impl Fn(u64) -> EpisodeKey,
        each: &mut dyn FnMut(&EpisodeResult<'_>),
    ) -> Result<Evaluation, Error> {
        let settings = PlaySettings {
            behaviour: Behaviour::GREEDY,
            recording: Recording::Off,
        };
        self.samples.clear();
        let mut tally = Tally::default();
        let mut keys = Vec::with_capacity(self.collector.environments());
        let mut openings = BTreeSet::new();
        let (mut next, mut played) = (0, 0);
        while next < episodes as u64 {
            let end = (next + self.collector.environments() as u64).min(episodes as u64);
            keys.clear();
            keys.extend((next..end).map(&key));
            next = end;
            self.collector.play(parameters, &keys, settings)?;
            tally.merge(&self.collector.tally());
            let pieces = self.collector.pieces();
            for episode in pieces.flat_map(|piece| &piece.experience.episodes) {
                each(&self.samples.of_episode(played, episode));
                played += 1;
                self.samples.add(episode);
                openings.insert(opening(episode));
            }
        }
        Ok(Evaluation {
            episodes,
            quantities: self.samples.quantities(),
            controllers: tally
                .means()
                .map(|(name, mean)| (name.to_owned(), mean))
                .collect(),
            distinct_openings: openings.len() as f64 / episodes.max(1) as f64,
        })
    }
}

/// What a team did at first.
fn opening(episode: &Episode) -> Vec<Action> {
    let steps = 0..episode.steps().min(OPENING);
    steps.flat_map(|t| episode.actions(t)).copied().collect()
}

/// What is measured of an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Measure {
    Return,
    Length,
    /// The statistic at this index of those that the world declares.
    Statistic(usize),
}

impl Measure {
    fn of(self, episode: &Episode) -> f64 {
        match self {
            Self::Return => episode.total_reward(),
            Self::Length => episode.steps() as f64,
            Self::Statistic(index) => episode.statistics_s[index],
        }
    }
}

/// What was measured in every episode, by names and in the order of [`Evaluation::quantities`]. Its size does not depend on how
/// many episodes there are.
#[derive(Debug)]
struct Samples {
    measured: Vec<(String, Measure, Sample)>,
}

/// Sums over a sample whose members are not kept.
#[derive(Debug, Clone, Copy)]
struct Sample {
    count: u64,
    sum: f64,
    /// The mean so far, and the sum of squared distances from it (Welford, "Note on a method for calculating corrected sums of
    /// squares and products", 1962).
    running_mean: f64,
    squares: f64,
}

/// Of no members: a sum begins with -0, which no member changes the sign of.
impl Default for Sample {
    fn default() -> Self {
        Self {
            count: 0,
            sum: -0.0,
            running_mean: 0.0,
            squares: 0.0,
        }
    }
}

impl Sample {
    fn add(&mut self, value: f64) {
        self.count += 1;
        self.sum += value;
        let before = value - self.running_mean;
        self.running_mean += before / self.count as f64;
        self.squares += before * (value - self.running_mean);
    }

    /// Mean and standard error; of one member 0, of none not a number.
    fn mean_and_standard_error(&self) -> (f64, f64) {
        let count = self.count as f64;
        let mean = self.sum / count;
        if self.count < 2 {
            return (mean, 0.0);
        }
        (mean, (self.squares / (count - 1.0) / count).sqrt())
    }
}

impl Samples {
    fn of(spec: &EnvironmentSpec) -> Self {
        let own = |index: usize| {
            let name = &spec.statistics[index].name;
            (
                name.to_string(),
                Measure::Statistic(index),
                Sample::default(),
            )
        };
        let others = (0..spec.statistics.len()).filter(|index| spec.success != Some(*index));
        let always = [
            ("return".to_owned(), Measure::Return, Sample::default()),
            ("ep_length".to_owned(), Measure::Length, Sample::default()),
        ];
        let success = spec.success.map(own);
        Self {
            measured: success
                .into_iter()
                .chain(always)
                .chain(others.map(own))
                .collect(),
        }
    }

    fn clear(&mut self) {
        for (_, _, sample) in &mut self.measured {
            *sample = Sample::default();
        }
    }

    fn add(&mut self, episode: &Episode) {
        for (_, measure, sample) in &mut self.measured {
            sample.add(measure.of(episode));
        }
    }

    fn of_episode(&self, number: u64, episode: &Episode) -> EpisodeResult<'_> {
        let values = self.measured.iter();
        let values = values.map(|(name, measure, _)| (name.as_str(), measure.of(episode)));
        EpisodeResult {
            episode: number,
            values: values.collect(),
        }
    }

    fn quantities(&self) -> Vec<Quantity> {
        let quantity = |(name, _, sample): &(String, Measure, Sample)| {
            let (mean, standard_error) = sample.mean_and_standard_error();
            Quantity {
                name: name.clone(),
                mean,
                standard_error,
            }
        };
        self.measured.iter().map(quantity).collect()
    }
}

#[cfg(test)]
mod tests {
    use mackrl::statistics::mean_and_standard_error;

    use super::*;

    #[test]
    fn a_sample_that_is_not_kept_has_the_statistics_of_one_that_is() {
        for length in [1, 2, 3, 97] {
            let kept: Vec<f64> = (0..length).map(|i| f64::from(i * i % 11) / 3.0).collect();
            let mut sample = Sample::default();
            kept.iter().for_each(|&value| sample.add(value));
            let (mean, error) = sample.mean_and_standard_error();
            let (expected_mean, expected_error) = mean_and_standard_error(&kept);
            assert_eq!(mean, expected_mean, "the same sum, to the bit");
            assert!((error - expected_error).abs() < 1e-12, "{length}");
        }
    }
}
