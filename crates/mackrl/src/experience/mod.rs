//! What acting leaves for learning: plain arrays, and nothing else.
//!
//! An [`Experience`] is a value. It can be learnt from at once or epochs later, kept in a memory, written to a file or sent to
//! another device; it names no network and holds no activation. (Activations that were computed while acting are a cache
//! beside it, which belongs to the actor and to one version of the parameters.) The alternative, to hand the learner the
//! actor that still holds half of what happened, needs no copy and admits one learning rule: the one that it was written for.
//!
//! A [`Collector`] plays episodes in many environments at once and fills experiences. Work is cut into shards whose number is a
//! setting of the run, never that of the threads. Shards share nothing that is written, and whatever is summed over them is
//! summed in their order, so a run gives the same bytes on one thread and on eight.

mod collector;
mod episode;
mod memory;
mod rows;
mod shard;

use mackrl_env::EpisodeKey;

pub use collector::Collector;
pub use episode::Episode;
pub use memory::{EpisodeShape, MemoryState, RememberedEpisode, ReplayMemory};
pub use rows::{Instance, Rows, StepRows};
pub(crate) use shard::ATTEMPTS_MAX;
pub use shard::{Piece, Shard};

use crate::policy::{Behaviour, Recording};

/// How a batch of episodes is played.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaySettings {
    /// How choices are made.
    pub behaviour: Behaviour,
    /// Whether the episodes will be learnt from.
    pub recording: Recording,
}

/// Episodes of a few environments that were played side by side, with all that a learner needs of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Experience {
    /// Names of the episodes \[B\], from which all random draws follow.
    pub key_b: Vec<EpisodeKey>,
    /// What happened in each of them \[B\].
    pub episodes: Vec<Episode>,
    /// ε of the bounded softmax that was acted with, in [0, 1].
    pub exploration: f32,
    /// What each bank of controllers read, in the order of the policy's levels. Whoever acts decides what a bank is.
    pub banks: Vec<Rows>,
}

impl Experience {
    /// Forgets everything but the memory; banks are cleared by the actor that fills them.
    pub(crate) fn begin(&mut self, keys: &[EpisodeKey], behaviour: Behaviour) {
        self.key_b.clear();
        self.key_b.extend_from_slice(keys);
        self.episodes.resize_with(keys.len(), Episode::default);
        self.episodes.iter_mut().for_each(Episode::clear);
        self.exploration = behaviour.exploration;
    }

    /// Steps of all episodes together.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.episodes.iter().map(Episode::steps).sum()
    }
}
