//! Names and meanings of everything that training reports, and the rows that it reports them in.
//!
//! Names without a prefix are PyMARL's, so that people's scripts find them. `mackrl/` is our own, `sys/` depends on the machine
//! and the clock and is left out when runs are compared.

use mackrl::{Error, algorithms::Algorithm};
use mackrl_env::{EnvironmentSpec, Statistic};
use serde::{Serialize, Serializer, ser::SerializeMap};

use super::assembly;
use crate::config::Config;

/// A metric's name (or the part before a number) and what it means, of everything that depends neither on the algorithm,
/// which explains its own, nor on the world: [`of_statistics`] and [`mackrl_env::Counter`] say what those mean.
///
/// Means are over the interval since the last row, weighted by how often the thing occurred.
pub const METRICS: &[(&str, &str)] = &[
    (
        "t_env",
        "environment steps so far, summed over the parallel environments",
    ),
    ("episode", "training episodes so far"),
    ("update", "policy updates so far"),
    (
        "experience_hash",
        "hash of all states and rewards of the training episodes so far, in 16 hexadecimal digits",
    ),
    (
        "return_mean",
        "mean undiscounted return of training episodes",
    ),
    (
        "ep_length_mean",
        "mean length of training episodes, in environment steps",
    ),
    (
        "test_return_mean",
        "mean undiscounted return of greedy test episodes",
    ),
    (
        "test_ep_length_mean",
        "mean length of greedy test episodes, in environment steps",
    ),
    (
        "test_distinct_openings",
        "share of different openings among the test's episodes, an opening being the joint actions of the first 10 steps: near 0, the team plays one script whatever it sees; 1, no two episodes begin alike",
    ),
    (
        "sys/episodes_discarded",
        "episodes so far that were played in vain because a game failed under them or beside them; nothing of them is learnt or counted",
    ),
    (
        "sys/sps",
        "environment steps per second of training since the last row, tests included",
    ),
];

/// Names and meanings of the metrics that come from the statistics of a world, in training episodes and in greedy tests.
#[must_use]
pub fn of_statistics(spec: &EnvironmentSpec) -> Vec<(String, String)> {
    let of = |statistic: &Statistic, prefix: &str, episodes: &str| {
        let name = format!("{prefix}{}_mean", statistic.name);
        (
            name,
            format!("mean over {episodes} of: {}", statistic.meaning),
        )
    };
    let metrics = spec.statistics.iter().flat_map(|statistic| {
        [
            of(statistic, "", "training episodes"),
            of(statistic, "test_", "greedy test episodes"),
        ]
    });
    metrics.collect()
}

/// The metric that says best how well a team plays in a world: its success in greedy tests, or, if it declares none, the
/// return.
#[must_use]
pub fn headline(spec: &EnvironmentSpec) -> String {
    let name = spec.success().map_or("return", |success| &success.name);
    format!("test_{name}_mean")
}

/// A number of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Number {
    /// How many there are of something, written without a fraction.
    Count(u64),
    /// Anything else.
    Real(f64),
}

/// One row of metrics: names and numbers in the order in which they are written.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MetricRow {
    entries: Vec<(String, Number)>,
    experience_hash: Option<u64>,
}

impl MetricRow {
    /// Appends a number.
    pub fn push(&mut self, name: impl Into<String>, value: f64) {
        self.entries.push((name.into(), Number::Real(value)));
    }

    /// Appends how many there are of something.
    pub fn push_count(&mut self, name: impl Into<String>, count: u64) {
        self.entries.push((name.into(), Number::Count(count)));
    }

    /// Notes the hash of the training episodes so far.
    pub(super) const fn set_experience_hash(&mut self, hash: u64) {
        self.experience_hash = Some(hash);
    }

    /// The number called `name`, if the row has it.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<f64> {
        self.entries
            .iter()
            .find(|(own, _)| own == name)
            .map(|(_, number)| number.value())
    }

    /// All entries, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        self.entries
            .iter()
            .map(|(name, number)| (name.as_str(), number.value()))
    }
}

impl Number {
    const fn value(self) -> f64 {
        match self {
            Self::Count(count) => count as f64,
            Self::Real(value) => value,
        }
    }
}

/// A row is a JSON object; counts are written without a fraction, the hash as a string of digits.
impl Serialize for MetricRow {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (name, number) in &self.entries {
            match number {
                Number::Count(count) => map.serialize_entry(name, count)?,
                Number::Real(value) => map.serialize_entry(name, value)?,
            }
        }
        if let Some(hash) = self.experience_hash {
            map.serialize_entry("experience_hash", &format_args!("{hash:016x}"))?;
        }
        map.end()
    }
}

/// Names (or the parts before a number) and meanings of all that a run of `config` reports, the counters of its world aside, in the
/// order: of every run, of its world, of its algorithm, of its controllers.
///
/// # Errors
/// [`Error::Config`] if the configuration describes nothing that can be trained.
pub fn explained(config: &Config) -> Result<Vec<(String, String)>, Error> {
    let world = assembly::RunWorld::new(config)?;
    let algorithm = assembly::algorithm(config, &world, 1)?;
    let owned = |metrics: &[(&str, &str)]| -> Vec<(String, String)> {
        let metrics = metrics.iter();
        metrics
            .map(|(name, meaning)| ((*name).to_owned(), (*meaning).to_owned()))
            .collect()
    };
    Ok([
        owned(METRICS),
        of_statistics(world.spec()),
        owned(algorithm.metrics()),
        algorithm.policy().metrics(),
    ]
    .concat())
}

/// Whether a metric is one that every run has, one of the algorithm's or its policy's own (which may begin with `test_` for greedy
/// episodes), or the mean of a statistic of the world over training episodes.
#[must_use]
pub fn is_explained(name: &str, algorithm: &dyn Algorithm, statistics: &[Statistic]) -> bool {
    let own = name.strip_prefix("test_").unwrap_or(name);
    let of_world = |statistic: &Statistic| name.strip_suffix("_mean") == Some(&*statistic.name);
    explains(METRICS, name)
        || explains(algorithm.metrics(), own)
        || explains(&algorithm.policy().metrics(), own)
        || statistics.iter().any(of_world)
}

fn explains<S: AsRef<str>>(metrics: &[(S, S)], name: &str) -> bool {
    metrics.iter().any(|(explained, _)| {
        let explained = explained.as_ref();
        name.strip_prefix(explained).is_some_and(|rest| {
            rest.is_empty() || explained.ends_with('_') && rest.bytes().all(|b| b.is_ascii_digit())
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_a_json_object_in_its_own_order() {
        let mut row = MetricRow::default();
        row.push_count("t_env", 240);
        row.push("battle_won_mean", 0.125);
        assert_eq!(
            serde_json::to_string(&row).unwrap(),
            r#"{"t_env":240,"battle_won_mean":0.125}"#
        );
        assert_eq!(row.get("battle_won_mean"), Some(0.125));
    }

    #[test]
    fn only_explained_names_and_numbered_ones_are_known() {
        let config = Config::default();
        let world = assembly::RunWorld::new(&config).unwrap();
        let own = assembly::algorithm(&config, &world, 1).unwrap();
        for name in [
            "mackrl/delegation_rate_ck_enemies_12",
            "test_mackrl/delegation_rate_ck_enemies_0",
            "saturation_pair_controller",
            "pg_loss",
            "t_env",
        ] {
            assert!(is_explained(name, &*own, &[]), "{name}");
        }
        for name in [
            "mackrl/delegation_rate_ck_enemies_x",
            "saturation_four_controller",
            "t_envy",
            "pg_losses",
        ] {
            assert!(!is_explained(name, &*own, &[]), "{name}");
        }
        let explained = explained(&config).unwrap();
        assert!(explained.iter().all(|(_, meaning)| !meaning.is_empty()));
        for name in [
            "t_env",
            "test_battle_won_mean",
            "pg_loss",
            "logit_spread_pair_controller",
        ] {
            assert!(explained.iter().any(|(own, _)| own == name), "{name}");
        }
    }

    #[test]
    fn statistics_of_a_world_are_metrics_under_its_own_names() {
        let skirmish = mackrl_skirmish::make("3m", &mackrl_skirmish::SkirmishSettings::default());
        let spec = mackrl_env::Environment::spec(&skirmish.unwrap()).clone();
        let names: Vec<String> = of_statistics(&spec)
            .into_iter()
            .map(|(name, _)| name)
            .collect();
        let expected = [
            "battle_won_mean",
            "test_battle_won_mean",
            "dead_allies_mean",
            "test_dead_allies_mean",
            "dead_enemies_mean",
            "test_dead_enemies_mean",
            "timed_out_mean",
            "test_timed_out_mean",
        ];
        assert_eq!(names, expected);
        assert_eq!(headline(&spec), "test_battle_won_mean");
        let unsuccessful = EnvironmentSpec {
            success: None,
            ..spec
        };
        assert_eq!(headline(&unsuccessful), "test_return_mean");
    }
}
