//! Names and meanings of everything that training reports, and the rows that it reports them in.
//!
//! Names without a prefix are PyMARL's, so that people's scripts find them. `mackrl/` is our own, `sys/` depends on the machine
//! and the clock and is left out when runs are compared.

use serde::{Serialize, Serializer, ser::SerializeMap};

/// A metric's name (or the part before a number) and what it means, of everything that does not depend on the algorithm.
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
        "battle_won_mean",
        "share of training episodes that were won",
    ),
    (
        "dead_allies_mean",
        "mean number of agents lost in an episode",
    ),
    (
        "dead_enemies_mean",
        "mean number of enemies defeated in an episode",
    ),
    (
        "test_battle_won_mean",
        "share of greedy test episodes that were won",
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
        "test_dead_allies_mean",
        "mean number of agents lost in a greedy test episode",
    ),
    (
        "test_dead_enemies_mean",
        "mean number of enemies defeated in a greedy test episode",
    ),
    (
        "sys/episodes_discarded",
        "episodes so far that were played in vain because a game failed under them or beside them; nothing of them is learnt or counted",
    ),
    ("sys/game_launches", "processes of the game started so far"),
    (
        "sys/game_faults_launch",
        "games so far that did not start or did not listen",
    ),
    (
        "sys/game_faults_version",
        "games so far that were not the version that was asked for",
    ),
    (
        "sys/game_faults_late",
        "games so far that did not answer in time",
    ),
    ("sys/game_faults_closed", "games so far that went away"),
    (
        "sys/game_faults_garbage",
        "games so far whose answer made no sense",
    ),
    (
        "sys/game_faults_refused",
        "games so far that refused what was asked",
    ),
    (
        "sys/sps",
        "environment steps per second of training since the last row, tests included",
    ),
];

/// One row of metrics: names and numbers in the order in which they are written.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MetricRow {
    entries: Vec<(String, f64)>,
    experience_hash: Option<u64>,
}

impl MetricRow {
    /// Appends a number under a name that [`METRICS`] or the algorithm explains.
    pub fn push(&mut self, name: impl Into<String>, value: f64) {
        let name = name.into();
        self.entries.push((name, value));
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
            .map(|(_, value)| *value)
    }

    /// All entries, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        self.entries
            .iter()
            .map(|(name, value)| (name.as_str(), *value))
    }
}

/// A row is a JSON object; whole numbers are written without a fraction, the hash as a string of digits.
impl Serialize for MetricRow {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (name, value) in &self.entries {
            if is_count(name) {
                map.serialize_entry(name, &as_count(*value))?;
            } else {
                map.serialize_entry(name, value)?;
            }
        }
        if let Some(hash) = self.experience_hash {
            map.serialize_entry("experience_hash", &format_args!("{hash:016x}"))?;
        }
        map.end()
    }
}

/// Whether a number counts things.
fn is_count(name: &str) -> bool {
    matches!(
        name,
        "t_env" | "episode" | "update" | "sys/episodes_discarded"
    ) || name.starts_with("sys/game_")
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "counts are whole, not negative and far below 2^53"
)]
const fn as_count(value: f64) -> u64 {
    value as u64
}

/// Whether [`METRICS`] or the metrics of an algorithm, which may begin with `test_` for greedy episodes, explain a name.
#[must_use]
pub fn is_explained(name: &str, of_algorithm: &[(&str, &str)]) -> bool {
    let own = name.strip_prefix("test_").unwrap_or(name);
    explains(METRICS, name) || explains(of_algorithm, own)
}

fn explains(metrics: &[(&str, &str)], name: &str) -> bool {
    metrics.iter().any(|(explained, _)| {
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
        row.push("t_env", 240.0);
        row.push("battle_won_mean", 0.125);
        assert_eq!(
            serde_json::to_string(&row).unwrap(),
            r#"{"t_env":240,"battle_won_mean":0.125}"#
        );
        assert_eq!(row.get("battle_won_mean"), Some(0.125));
    }

    #[test]
    fn only_explained_names_and_numbered_ones_are_known() {
        let own = [("rate_by_enemies_", ""), ("loss", "")];
        for name in [
            "rate_by_enemies_12",
            "test_rate_by_enemies_0",
            "loss",
            "t_env",
        ] {
            assert!(is_explained(name, &own), "{name}");
        }
        for name in ["rate_by_enemies_x", "t_envy", "losses"] {
            assert!(!is_explained(name, &own), "{name}");
        }
    }
}
