//! A run at one moment, as bytes from which it continues.
//!
//! Arrays are safetensors, numbers are JSON: both can be read from any language, and reading them runs no code. Random draws need
//! no place here, because they are functions of seed, episode and step (see `mackrl_env::random`). What is written where, and
//! how it survives a crash, is the business of whoever owns the run folder.
//!
//! | tensors | what they hold |
//! |---|---|
//! | `NAME` | a parameter of the policy or the critic, as in the final weights |
//! | `target.NAME` | the same parameter of the target critic |
//! | `opt.adam.m.NAME`, `opt.adam.v.NAME` | Adam's averages of gradients and of their squares |
//! | `opt.rmsprop.v.NAME` | `RMSprop`'s averages of squared gradients |
//!
//! Learners that remember episodes have a replay memory beside them, whose episodes are encoded by `mackrl::experience`.

use std::collections::BTreeMap;

use mackrl::{
    Error,
    algorithms::{AlgorithmState, StoredState},
    experience::MemoryState,
    nn::ParameterLayout,
    policy::Tally,
};
use serde::{Deserialize, Serialize};

use super::{Score, read_weights, teams::Best, write_weights};

/// Version of the format; it changes when an older program could not continue from a checkpoint.
///
/// 3: without the best weights, which are not known then.
const FORMAT: u64 = 4;
/// The first version that is read.
const FORMAT_LEAST: u64 = 3;
/// The largest count that every reader of JSON can hold: 2⁵³.
const COUNT_MAX: u64 = 1 << 53;

/// A run at one moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checkpoint {
    /// Parameters and moments, as safetensors.
    pub tensors: Vec<u8>,
    /// Counters and sums, as JSON.
    pub counters: Vec<u8>,
    /// The weights that did best in a test so far, as a file that describes itself.
    pub best: Option<Vec<u8>>,
    /// What a replay memory holds, if the algorithm has one and the run goes on.
    pub memory: Option<MemoryState>,
}

/// The trainer's own part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Counters {
    pub(super) steps_env: u64,
    pub(super) episodes: u64,
    pub(super) tests: u64,
    /// Hash of all that was learnt from, in 16 hexadecimal digits: not every reader of JSON can hold 64 bits.
    #[serde(with = "hexadecimal")]
    pub(super) experience_hash: u64,
    /// Environment steps at which the next test is due.
    pub(super) next_test: u64,
    /// Environment steps at which the next row of metrics is due.
    pub(super) next_row: u64,
    /// Environment steps at the latest row of metrics.
    pub(super) interval_steps_env: u64,
    /// What was seen since.
    pub(super) interval: Tally,
    /// How the best weights so far did in their test.
    #[serde(default)]
    pub(super) best: Option<Score>,
}

/// The JSON object.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Numbers {
    format: u64,
    /// What the algorithm counts.
    algorithm: BTreeMap<String, u64>,
    trainer: Counters,
}

/// A checkpoint that was read: the trainer's part, and what the algorithm finds its own in.
#[derive(Debug)]
pub(super) struct Opened<'a> {
    tensors: &'a [u8],
    memory: Option<&'a MemoryState>,
    /// Whether the run ended here, and needs no replay memory any more.
    pub(super) is_last: bool,
    algorithm: BTreeMap<String, u64>,
    pub(super) trainer: Counters,
    pub(super) best: Option<Best>,
}

impl StoredState for Opened<'_> {
    fn tensors(&self, layout: &ParameterLayout) -> Result<Vec<f32>, Error> {
        read_weights(layout, self.tensors)
    }

    fn counter(&self, name: &str) -> Result<u64, Error> {
        let count = self.algorithm.get(name).copied();
        count.ok_or_else(|| Error::Data(format!("checkpoint has no count `{name}`")))
    }

    fn memory(&self) -> Result<MemoryState, Error> {
        match self.memory {
            Some(memory) => Ok(memory.clone()),
            None if self.is_last => Ok(MemoryState {
                first: self.trainer.episodes,
                episodes: Vec::new(),
            }),
            None => Err(Error::Data("checkpoint has no replay memory".to_owned())),
        }
    }
}

/// The part of the JSON object that every version has.
#[derive(Debug, Deserialize)]
struct Format {
    format: u64,
}

impl Checkpoint {
    /// Of an algorithm and a trainer, whose counters say how `best` did.
    pub(super) fn write(
        algorithm: &AlgorithmState,
        trainer: &Counters,
        best: Option<&Best>,
    ) -> Self {
        let tensors = algorithm.tensors.iter();
        let models: Vec<(&ParameterLayout, &[f32])> = tensors
            .map(|(layout, values)| (layout, values.as_slice()))
            .collect();
        let numbers = Numbers {
            format: FORMAT,
            algorithm: algorithm.counters.clone(),
            trainer: trainer.clone(),
        };
        let mut json = serde_json::to_vec_pretty(&numbers).expect("numbers can be written");
        json.push(b'\n');
        Self {
            tensors: write_weights(&models),
            counters: json,
            best: best.map(|best| best.weights.clone()),
            memory: algorithm.memory.clone(),
        }
    }

    /// Reads the counters and checks them; `is_explained` says whether a metric has this name.
    pub(super) fn open(&self, is_explained: impl Fn(&str) -> bool) -> Result<Opened<'_>, Error> {
        let numbers = self.numbers()?;
        numbers.check(is_explained)?;
        let best = match (numbers.trainer.best, &self.best) {
            (Some(test), Some(weights)) => Some(Best {
                test,
                weights: weights.clone(),
            }),
            (None, None) => None,
            _ => {
                let problem =
                    "checkpoint has best weights without their test, or a test without them";
                return Err(Error::Data(problem.to_owned()));
            }
        };
        Ok(Opened {
            tensors: &self.tensors,
            memory: self.memory.as_ref(),
            is_last: false,
            algorithm: numbers.algorithm,
            trainer: numbers.trainer,
            best,
        })
    }

    /// Environment steps that had been played.
    ///
    /// # Errors
    /// [`Error::Data`] if it is damaged.
    pub(crate) fn steps_env(&self) -> Result<u64, Error> {
        Ok(self.numbers()?.trainer.steps_env)
    }

    /// Whether it was taken before the test at the end of a run of `planned` environment steps, so that a longer run has it as well.
    ///
    /// # Errors
    /// [`Error::Data`] if it is damaged.
    pub(crate) fn is_before_end(&self, planned: u64) -> Result<bool, Error> {
        let Counters {
            steps_env,
            next_test,
            interval_steps_env,
            ..
        } = self.numbers()?.trainer;
        // Once, versions of this program put that test forward in the state itself.
        let is_untested = interval_steps_env < steps_env && next_test != steps_env;
        Ok(steps_env < planned || is_untested)
    }

    fn numbers(&self) -> Result<Numbers, Error> {
        let broken = |error| Error::Data(format!("counters of the checkpoint: {error}"));
        let Format { format } = serde_json::from_slice(&self.counters).map_err(broken)?;
        if !(FORMAT_LEAST..=FORMAT).contains(&format) {
            return Err(Error::Data(format!(
                "checkpoint has format {format}, expected {FORMAT_LEAST} to {FORMAT}"
            )));
        }
        serde_json::from_slice(&self.counters).map_err(broken)
    }
}

impl Numbers {
    /// Refuses what no run can have counted.
    fn check(&self, is_explained: impl Fn(&str) -> bool) -> Result<(), Error> {
        let Counters {
            steps_env,
            episodes,
            tests,
            experience_hash: _,
            next_test,
            next_row,
            interval_steps_env,
            interval,
            best,
        } = &self.trainer;
        let counts = [
            ("steps_env", *steps_env, COUNT_MAX),
            ("episodes", *episodes, COUNT_MAX),
            // Times the episodes of a test, at most a million, this stays below 2⁶⁴.
            ("tests", *tests, COUNT_MAX >> 10),
            ("next_test", *next_test, 2 * COUNT_MAX),
            ("next_row", *next_row, 2 * COUNT_MAX),
            ("interval_steps_env", *interval_steps_env, *steps_env),
            (
                "best.steps_env",
                best.map_or(0, |best| best.steps_env),
                *steps_env,
            ),
        ];
        let own = self
            .algorithm
            .iter()
            .map(|(name, count)| (name.as_str(), *count, COUNT_MAX));
        let mut counts = counts.into_iter().chain(own);
        if let Some((name, found, most)) = counts.find(|(_, found, most)| found > most) {
            return Err(Error::Data(format!(
                "checkpoint counts {found} as `{name}`, expected at most {most}"
            )));
        }
        let unknown = interval.names().find(|name| !is_explained(name));
        match unknown {
            Some(name) => Err(Error::Data(format!(
                "checkpoint holds an unknown metric `{name}`"
            ))),
            None => Ok(()),
        }
    }
}

/// 64 bits as hexadecimal digits.
mod hexadecimal {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub(super) fn serialize<S: Serializer>(bits: &u64, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{bits:016x}"))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<u64, D::Error> {
        let digits = String::deserialize(from)?;
        u64::from_str_radix(&digits, 16)
            .map_err(|_| D::Error::custom(format!("`{digits}`, expected 16 hexadecimal digits")))
    }
}

#[cfg(test)]
mod tests;
