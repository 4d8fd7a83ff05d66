//! What recorded runs of the real game say: numbers, in `reference.toml`, with where they were read.

use serde::{Deserialize, Serialize};

use crate::{SkirmishError, fidelity::Policy};

/// What is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Mean steps of an episode.
    Length,
    /// Standard deviation of the steps of one episode.
    LengthSd,
    /// Median of the steps of an episode.
    MedianLength,
    /// Mean sum of rewards.
    Return,
    /// Mean number of enemies killed.
    Killed,
    /// Mean number of agents lost.
    Lost,
    /// Share of episodes in which all agents are lost.
    AllLost,
    /// Share of battles won.
    Won,
}

/// One quantity of the real game.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Number of the check that it belongs to.
    pub check: u8,
    /// The map.
    pub map: String,
    /// The policy that played, if it is one that can be played without learning. Without, the row is about trained teams and
    /// is not judged here.
    pub policy: Option<Policy>,
    /// What was measured.
    pub quantity: Quantity,
    /// Its value in the real game.
    pub real: f64,
    /// Standard error of that value, where the logs tell.
    pub error: Option<f64>,
    /// By how much the simulator may differ.
    pub tolerance: f64,
    /// Episodes behind the value.
    pub episodes: usize,
    /// Whether rules were chosen by it; otherwise it is kept for testing them.
    pub fitted: bool,
}

/// Episode lengths of the real game under random play.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lengths {
    /// The map.
    pub map: String,
    /// Episodes behind the quantiles.
    pub episodes: usize,
    /// Lengths at [`crate::fidelity::QUANTILES`].
    pub quantiles: [f64; 5],
}

/// A public repository with logs of runs on the real game.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// The maps whose rows use it.
    pub maps: Vec<String>,
    /// Owner and name on GitHub.
    pub repository: String,
    /// A commit that holds the logs.
    pub commit: String,
}

/// All that is known of the real game.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct References {
    /// The quantities, check by check.
    pub references: Vec<Reference>,
    /// Distributions of length.
    pub lengths: Vec<Lengths>,
    /// Where the numbers were read.
    pub sources: Vec<Source>,
}

impl References {
    /// Reads the numbers that this crate carries.
    ///
    /// # Errors
    /// [`SkirmishError::ReferenceFile`] if the file in the crate is broken.
    pub fn load() -> Result<Self, SkirmishError> {
        toml::from_str(include_str!("reference.toml"))
            .map_err(|error| SkirmishError::ReferenceFile(error.to_string()))
    }

    /// Repositories and commits that rows of `map` were read from, as text.
    #[must_use]
    pub fn source_of(&self, map: &str) -> String {
        let of_map = |source: &&Source| source.maps.iter().any(|name| name == map);
        let sources = self.sources.iter().filter(of_map);
        let texts: Vec<String> = sources
            .map(|source| format!("{}@{}", source.repository, source.commit))
            .collect();
        texts.join(" ")
    }
}
