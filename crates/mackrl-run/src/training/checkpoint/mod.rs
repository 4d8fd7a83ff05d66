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

use mackrl::{
    Error,
    central_critic::CriticState,
    learner::LearnerState,
    nn::{Moments, OptimiserKind, ParameterLayout},
    policy::Tally,
};
use mackrl_env::Statistic;
use serde::{Deserialize, Serialize};

use super::{metrics::is_explained, read_weights, write_weights};

/// Version of the format; it changes when an older program could not continue from a checkpoint.
const FORMAT: u64 = 2;
/// The largest count that every reader of JSON can hold: 2⁵³.
const COUNT_MAX: u64 = 1 << 53;

/// A run at one moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checkpoint {
    /// Parameters and moments, as safetensors.
    pub tensors: Vec<u8>,
    /// Counters and sums, as JSON.
    pub counters: Vec<u8>,
}

/// What a checkpoint holds, in memory.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct State {
    pub(super) learner: LearnerState,
    pub(super) counters: Counters,
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
}

/// How the arrays of a checkpoint are called.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layouts<'a> {
    pub(super) policy: &'a ParameterLayout,
    pub(super) critic: &'a ParameterLayout,
    pub(super) optimiser: OptimiserKind,
    /// What the world declares.
    pub(super) statistics: &'a [Statistic],
}

/// The JSON object.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Numbers {
    format: u64,
    learner: Updates,
    critic: Updates,
    /// Critic updates when the target critic was refreshed.
    critic_updates_at_refresh: u64,
    trainer: Counters,
}

/// How often a model changed.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Updates {
    updates: u64,
    optimiser_steps: u64,
}

/// The part of the JSON object that every version has.
#[derive(Debug, Deserialize)]
struct Format {
    format: u64,
}

impl Checkpoint {
    pub(super) fn write(layouts: &Layouts<'_>, state: &State) -> Self {
        let State { learner, counters } = state;
        let critic = &learner.critic;
        let target = layouts.critic.prefixed("target.");
        let [policy_first, policy_second] = layouts.moments(layouts.policy);
        let [critic_first, critic_second] = layouts.moments(layouts.critic);
        let mut models: Vec<(&ParameterLayout, &[f32])> = vec![
            (layouts.policy, &learner.parameters),
            (layouts.critic, &critic.parameters),
            (&target, &critic.target_parameters),
            (&policy_second, &learner.moments.second),
            (&critic_second, &critic.moments.second),
        ];
        if layouts.has_first_moments() {
            models.push((&policy_first, &learner.moments.first));
            models.push((&critic_first, &critic.moments.first));
        }
        let numbers = Numbers {
            format: FORMAT,
            learner: Updates {
                updates: learner.updates,
                optimiser_steps: learner.moments.steps,
            },
            critic: Updates {
                updates: critic.updates,
                optimiser_steps: critic.moments.steps,
            },
            critic_updates_at_refresh: critic.updates_at_refresh,
            trainer: counters.clone(),
        };
        let mut json = serde_json::to_vec_pretty(&numbers).expect("numbers can be written");
        json.push(b'\n');
        Self {
            tensors: write_weights(&models),
            counters: json,
        }
    }

    pub(super) fn read(&self, layouts: &Layouts<'_>) -> Result<State, Error> {
        let numbers = self.numbers(layouts.statistics)?;
        let read = |layout: &ParameterLayout| read_weights(layout, &self.tensors);
        let moments = |layout: &ParameterLayout, steps| {
            let [first, second] = layouts.moments(layout);
            let first = if layouts.has_first_moments() {
                read(&first)?
            } else {
                Vec::new()
            };
            let second = read(&second)?;
            Ok::<_, Error>(Moments {
                steps,
                first,
                second,
            })
        };
        let critic = CriticState {
            parameters: read(layouts.critic)?,
            target_parameters: read(&layouts.critic.prefixed("target."))?,
            moments: moments(layouts.critic, numbers.critic.optimiser_steps)?,
            updates: numbers.critic.updates,
            updates_at_refresh: numbers.critic_updates_at_refresh,
        };
        let learner = LearnerState {
            parameters: read(layouts.policy)?,
            moments: moments(layouts.policy, numbers.learner.optimiser_steps)?,
            updates: numbers.learner.updates,
            critic,
        };
        Ok(State {
            learner,
            counters: numbers.trainer,
        })
    }

    fn numbers(&self, statistics: &[Statistic]) -> Result<Numbers, Error> {
        let broken = |error| Error::Data(format!("counters of the checkpoint: {error}"));
        let Format { format } = serde_json::from_slice(&self.counters).map_err(broken)?;
        if format != FORMAT {
            return Err(Error::Data(format!(
                "checkpoint has format {format}, expected {FORMAT}"
            )));
        }
        let numbers: Numbers = serde_json::from_slice(&self.counters).map_err(broken)?;
        numbers.check(statistics)?;
        Ok(numbers)
    }
}

impl Numbers {
    /// Refuses what no run can have counted.
    fn check(&self, statistics: &[Statistic]) -> Result<(), Error> {
        let Counters {
            steps_env,
            episodes,
            tests,
            experience_hash: _,
            next_test,
            next_row,
            interval_steps_env,
            interval,
        } = &self.trainer;
        let counts = [
            ("steps_env", *steps_env, COUNT_MAX),
            ("episodes", *episodes, COUNT_MAX),
            // Times the episodes of a test, at most a million, this stays below 2⁶⁴.
            ("tests", *tests, COUNT_MAX >> 10),
            ("next_test", *next_test, 2 * COUNT_MAX),
            ("next_row", *next_row, 2 * COUNT_MAX),
            ("interval_steps_env", *interval_steps_env, *steps_env),
            ("learner.updates", self.learner.updates, COUNT_MAX),
            ("critic.updates", self.critic.updates, COUNT_MAX),
            (
                "critic_updates_at_refresh",
                self.critic_updates_at_refresh,
                self.critic.updates,
            ),
            (
                "learner.optimiser_steps",
                self.learner.optimiser_steps,
                COUNT_MAX,
            ),
            (
                "critic.optimiser_steps",
                self.critic.optimiser_steps,
                COUNT_MAX,
            ),
        ];
        if let Some((name, found, most)) = counts.into_iter().find(|(_, found, most)| found > most)
        {
            return Err(Error::Data(format!(
                "checkpoint counts {found} as `{name}`, expected at most {most}"
            )));
        }
        let unknown = interval
            .names()
            .find(|name| !is_explained(name, statistics));
        match unknown {
            Some(name) => Err(Error::Data(format!(
                "checkpoint holds an unknown metric `{name}`"
            ))),
            None => Ok(()),
        }
    }
}

impl Layouts<'_> {
    /// The names of the first and the second moments.
    fn moments(&self, layout: &ParameterLayout) -> [ParameterLayout; 2] {
        let name = match self.optimiser {
            OptimiserKind::Adam { .. } => "adam",
            OptimiserKind::RmsProp { .. } => "rmsprop",
        };
        ["m", "v"].map(|moment| layout.prefixed(&format!("opt.{name}.{moment}.")))
    }

    const fn has_first_moments(&self) -> bool {
        matches!(self.optimiser, OptimiserKind::Adam { .. })
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
