//! What `run.json` tells: where the result comes from, how far the run has come, and what it ended with.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{
    RUN,
    extension::{FormerPlan, InitialSource},
    manifest::Fingerprint,
    untrusted,
};
use crate::{folder::Folder, provenance::Provenance, training::Teams};

/// How far a run has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Training goes on, or was interrupted without a chance to say so.
    Running,
    /// Training reached its end.
    Finished,
    /// Training stopped because it was asked to.
    Interrupted,
    /// Training stopped with an error.
    Failed,
}

/// What `run.json` tells: where the result comes from, and facts that do not determine it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct RunRecord {
    /// The command line, word by word.
    pub(super) command: Vec<String>,
    /// Where the weights come from that the run began with, if it did not begin untrained.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) initial_weights: Option<InitialSource>,
    /// Lengths that were planned before the run was extended, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) former_plans: Vec<FormerPlan>,
    /// Where the run's results come from: one entry, or one for each version of this program that went on with it, in their
    /// order.
    #[serde(default)]
    pub(super) provenance: Vec<Provenance>,
    /// Threads in use, which change no result.
    pub(super) threads: usize,
    /// Instruction set in use, which changes no result.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) simd: Option<String>,
    /// How the program was built, which changes no result: `release` or `debug`, and what it was compiled for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) build: Option<String>,
    pub(super) status: Status,
    /// Of a run that failed, why.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) failure: Option<String>,
    /// Files of metrics that were found damaged and put aside; what they held is missing in `metrics.jsonl`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) metrics_put_aside: Vec<String>,
    /// Of a finished run, how its last and its best weights play.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) teams: Option<Teams>,
    /// Of a finished run, length and hash of its configuration, metrics and weights; runs of mackrl 0.1.0 do not say.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) files: BTreeMap<String, Fingerprint>,
}

/// Reads it; a damaged one is as good as none.
pub(super) fn read_record(folder: &Folder) -> Option<RunRecord> {
    let json = folder.read(RUN, untrusted::TEXT_MAX).ok()??;
    serde_json::from_slice(&json).ok()
}

/// The command line of this process, word by word.
pub(super) fn command_line() -> Vec<String> {
    let words = std::env::args_os();
    words
        .map(|word| word.to_string_lossy().into_owned())
        .collect()
}

/// How this program was built.
pub(super) fn build() -> String {
    let profile = if cfg!(debug_assertions) {
        "debug"
    } else {
        "release"
    };
    let features = [
        (cfg!(target_feature = "avx512f"), "avx512f"),
        (cfg!(target_feature = "avx2"), "avx2"),
        (cfg!(target_feature = "fma"), "fma"),
        (cfg!(target_feature = "neon"), "neon"),
    ];
    let present = features.iter().filter(|(is_present, _)| *is_present);
    let present = present.map(|(_, name)| format!(" {name}"));
    format!(
        "{profile}, {}{}",
        std::env::consts::ARCH,
        present.collect::<String>()
    )
}
