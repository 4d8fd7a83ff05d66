//! What is known of SMAC's maps beyond their sizes: how hard they are said to be, and the best results in this repository.
//!
//! `known.json` is a copy of what committed results say, so that the program has it wherever it lies; `tests/maps.rs` compares it
//! with them. A map without a result has none here.

use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

/// How hard the maps are on the real game: the classes of Yu and others, "The Surprising Effectiveness of PPO in Cooperative
/// Multi-Agent Games", 2021.
const DIFFICULTIES: [(&str, &[&str]); 3] = [
    (
        "easy",
        &[
            "2m_vs_1z",
            "3m",
            "2s_vs_1sc",
            "2s3z",
            "3s_vs_3z",
            "3s_vs_4z",
            "so_many_baneling",
            "8m",
            "MMM",
            "1c3s5z",
            "bane_vs_bane",
        ],
    ),
    (
        "hard",
        &[
            "3s_vs_5z",
            "2c_vs_64zg",
            "8m_vs_9m",
            "25m",
            "5m_vs_6m",
            "3s5z",
            "10m_vs_11m",
        ],
    ),
    (
        "super hard",
        &["MMM2", "3s5z_vs_3s6z", "27m_vs_30m", "6h_vs_8z", "corridor"],
    ),
];

static RESULTS: LazyLock<Vec<Results>> = LazyLock::new(|| {
    let text = include_str!("known.json");
    serde_json::from_str(text).expect("tests/maps.rs reads it")
});

/// What is known of a map.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Known {
    /// Easy, hard or super hard.
    pub(super) difficulty: &'static str,
    #[serde(flatten)]
    pub(super) results: Option<Results>,
}

/// The best results on a map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Results {
    #[serde(skip_serializing)]
    map: String,
    /// Of the scripted teams.
    pub(super) scripted: Option<Result>,
    /// Of trained teams.
    pub(super) trained: Option<Result>,
}

/// A measured share of battles won.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Result {
    /// Of a scripted team, its name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) policy: Option<String>,
    /// In [0, 1].
    pub(super) won: f64,
    pub(super) episodes: u64,
    /// Where it is committed.
    pub(super) source: String,
}

impl Known {
    /// Of the map of SMAC with this name.
    pub(super) fn of(name: &str) -> Option<Self> {
        let mut classes = DIFFICULTIES.iter();
        let (difficulty, _) = classes.find(|(_, maps)| maps.contains(&name))?;
        Some(Self {
            difficulty,
            results: RESULTS.iter().find(|results| results.map == name).cloned(),
        })
    }

    pub(super) fn scripted(&self) -> Option<&Result> {
        self.results.as_ref()?.scripted.as_ref()
    }

    pub(super) fn trained(&self) -> Option<&Result> {
        self.results.as_ref()?.trained.as_ref()
    }

    /// Both results, for a person.
    pub(super) fn words(&self) -> String {
        let trained = match self.trained() {
            Some(result) => format!("{} by the team in {}", result.words(), result.source),
            None => "no trained team measured".to_owned(),
        };
        let scripted = match self.scripted() {
            Some(result) if result.won > 0.0 => {
                let policy = result.policy.as_deref().unwrap_or("a script");
                format!("{} by {policy}, a script", result.words())
            }
            Some(result) => format!("none of {} by any script", result.episodes),
            None => "no script measured".to_owned(),
        };
        format!("{trained}; {scripted}")
    }
}

impl Result {
    fn words(&self) -> String {
        format!("{:.1} % of {} battles", 100.0 * self.won, self.episodes)
    }

    /// "100.0 %"
    pub(super) fn share(&self) -> String {
        format!("{:.1} %", 100.0 * self.won)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_map_has_a_difficulty_and_nothing_else_has() {
        for name in mackrl_skirmish::map_names() {
            assert!(Known::of(name).is_some(), "{name}");
        }
        let named: usize = DIFFICULTIES.iter().map(|(_, maps)| maps.len()).sum();
        assert_eq!(named, mackrl_skirmish::map_names().len());
        assert_eq!(Known::of("matrix-game"), None);
    }

    #[test]
    fn results_are_told_with_their_source() {
        let known = Known::of("3m").unwrap();
        let words = known.words();
        assert!(words.contains("battles by the team in zoo/3m; "), "{words}");
        let words = Known::of("5m_vs_6m").unwrap().words();
        assert!(words.ends_with("none of 1000 by any script"), "{words}");
    }
}
