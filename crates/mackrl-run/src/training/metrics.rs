//! Names and meanings of everything that training reports, and the rows that it reports them in.
//!
//! Names without a prefix are PyMARL's, so that people's scripts find them. `mackrl/` is our own, `sys/` depends on the machine
//! and the clock and is left out when runs are compared.

use serde::{Serialize, Serializer, ser::SerializeMap};

/// A metric's name (or the part before a number) and what it means.
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
    ("epsilon", "ε of the bounded softmax in the latest batch"),
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
        "pg_loss",
        "−mean of A_t log p(u_t), divided by the number of agents",
    ),
    (
        "agent_grad_norm",
        "norm of the policy's gradient before clipping",
    ),
    (
        "advantage_mean",
        "mean of A_t = r_t + γ V(s_{t+1}) − V(s_t)",
    ),
    (
        "critic_loss",
        "mean squared error of V to its λ-returns over a sweep",
    ),
    (
        "critic_grad_norm",
        "mean norm of the critic's gradients before clipping",
    ),
    ("td_error_abs", "mean |λ-return − V|"),
    ("target_mean", "mean λ-return"),
    (
        "mackrl/delegation_rate",
        "share of chosen pairs with common knowledge that delegated",
    ),
    (
        "mackrl/delegation_rate_ck_enemies_",
        "the same, for pairs that commonly know this many enemies (Figure 7)",
    ),
    (
        "mackrl/common_knowledge_rate",
        "share of chosen pairs of living agents with common knowledge",
    ),
    (
        "mackrl/ck_entities_mean",
        "entities that a chosen pair of living agents commonly knows",
    ),
    ("mackrl/entropy_l1", "entropy of the pair selector, in nats"),
    (
        "mackrl/entropy_l2",
        "entropy of chosen pair controllers with common knowledge, in nats",
    ),
    (
        "mackrl/entropy_l3",
        "entropy of living agents' controllers, in nats",
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
        "test_mackrl/delegation_rate",
        "as `mackrl/delegation_rate`, in greedy test episodes",
    ),
    (
        "test_mackrl/delegation_rate_ck_enemies_",
        "as `mackrl/delegation_rate_ck_enemies_`, in greedy test episodes",
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
    /// Appends a number under a name that [`METRICS`] explains.
    pub fn push(&mut self, name: impl Into<String>, value: f64) {
        let name = name.into();
        debug_assert!(
            is_explained(&name),
            "metric `{name}` is not explained in METRICS"
        );
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

pub(super) fn is_explained(name: &str) -> bool {
    METRICS.iter().any(|(explained, _)| {
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
        assert!(is_explained("mackrl/delegation_rate_ck_enemies_12"));
        assert!(!is_explained("mackrl/delegation_rate_ck_enemies_x"));
        assert!(!is_explained("t_envy"));
    }
}
