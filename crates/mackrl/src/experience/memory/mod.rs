//! A memory of whole episodes, from which learners that need not be on policy draw batches.
//!
//! Episodes are kept [encoded](codec): what a step shows mostly repeats the step before, so that five thousand episodes take a
//! fraction of what their arrays would, in memory as in a checkpoint, and come back to the bit. An encoded episode never changes,
//! so a [`MemoryState`] shares its bytes with the memory, and whoever stores one can tell what was stored before.

mod codec;

use std::{
    collections::{BTreeSet, VecDeque},
    sync::Arc,
};

use mackrl_env::{Draw, EnvironmentSpec, EpisodeKey};

use super::Episode;
use crate::Error;

/// The latest episodes, at most as many as there is room for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReplayMemory {
    shape: EpisodeShape,
    capacity: usize,
    /// Episodes that were forgotten.
    first: u64,
    episodes: VecDeque<Arc<[u8]>>,
}

/// Sizes of an episode's arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EpisodeShape {
    /// N
    pub agents: usize,
    /// A
    pub actions: usize,
    /// O: numbers that an agent observes.
    pub observation: usize,
    /// G: numbers of a state.
    pub state: usize,
}

/// What a memory holds, for a checkpoint.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MemoryState {
    /// Number of the first episode, counted from the first that was ever added.
    pub first: u64,
    /// The episodes, encoded.
    pub episodes: Vec<Arc<[u8]>>,
}

/// An episode as it comes out of a memory.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RememberedEpisode {
    /// Actions, \[T, N\].
    pub action_tn: Vec<u16>,
    /// Rewards \[T\].
    pub reward_t: Vec<f32>,
    /// Which actions each agent had \[T + 1, N, A\].
    pub available_tna: Vec<bool>,
    /// What each agent observed, and behind it the state \[T + 1, N · O + G\].
    number_tw: Vec<f32>,
    /// Whether the game would have gone on, had time not run out.
    pub ends_by_time_limit: bool,
}

impl EpisodeShape {
    /// Of the episodes of such a world.
    #[must_use]
    pub const fn of(spec: &EnvironmentSpec) -> Self {
        Self {
            agents: spec.agents,
            actions: spec.actions,
            observation: spec.observation_size,
            state: spec.state_size,
        }
    }

    /// Numbers that one step shows.
    const fn numbers(self) -> usize {
        self.agents * self.observation + self.state
    }
}

impl RememberedEpisode {
    /// T: the number of steps.
    #[must_use]
    pub const fn steps(&self) -> usize {
        self.reward_t.len()
    }

    /// What each agent observed before step `t`, or after the last for t = T \[N, O\].
    #[must_use]
    pub fn observations(&self, shape: EpisodeShape, t: usize) -> &[f32] {
        &self.number_tw[t * shape.numbers()..][..shape.agents * shape.observation]
    }

    /// The state before step `t`, or after the last for t = T \[G\].
    #[must_use]
    pub fn state(&self, shape: EpisodeShape, t: usize) -> &[f32] {
        &self.number_tw[(t + 1) * shape.numbers() - shape.state..][..shape.state]
    }
}

impl ReplayMemory {
    /// An empty memory with room for `capacity` episodes.
    #[must_use]
    pub const fn new(shape: EpisodeShape, capacity: usize) -> Self {
        Self {
            shape,
            capacity,
            first: 0,
            episodes: VecDeque::new(),
        }
    }

    /// Sizes of the episodes.
    #[must_use]
    pub const fn shape(&self) -> EpisodeShape {
        self.shape
    }

    /// Episodes that it holds.
    #[must_use]
    pub fn len(&self) -> usize {
        self.episodes.len()
    }

    /// Whether it holds none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.episodes.is_empty()
    }

    /// Episodes that were ever added.
    #[must_use]
    pub fn added(&self) -> u64 {
        self.first + self.episodes.len() as u64
    }

    /// Bytes of the episodes that it holds.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.episodes.iter().map(|episode| episode.len()).sum()
    }

    /// Adds an episode, and forgets the oldest if there is no room for it.
    ///
    /// # Errors
    /// [`Error::Data`] if the episode does not hold what each agent observed, or has no step.
    pub fn add(&mut self, episode: &Episode) -> Result<(), Error> {
        let encoded = codec::encode(self.shape, episode)?;
        self.episodes.push_back(encoded.into());
        while self.episodes.len() > self.capacity {
            self.episodes.pop_front();
            self.first += 1;
        }
        Ok(())
    }

    /// Draws `count` different episodes, each as likely as any other, or all if there are fewer; ascending. The draw is named by
    /// `key` and `step`.
    #[must_use]
    pub fn draw(&self, count: usize, key: &EpisodeKey, step: usize) -> Vec<usize> {
        // Floyd's sampling: Bentley and Floyd, "A sample of brilliance", 1987.
        let total = self.len();
        let mut chosen = BTreeSet::new();
        for last in total.saturating_sub(count)..total {
            let bits = u128::from(key.bits(step, Draw::Setup(last)));
            // Of 64 random bits and last + 1, the part above 64 bits: uniform in 0..=last.
            let index = usize::try_from((bits * (last as u128 + 1)) >> 64).unwrap_or(last);
            if !chosen.insert(index) {
                chosen.insert(last);
            }
        }
        chosen.into_iter().collect()
    }

    /// Writes the episode with this index, 0 for the oldest, into `to`.
    ///
    /// # Panics
    /// If there is no such episode.
    pub fn read(&self, index: usize, to: &mut RememberedEpisode) {
        codec::decode(self.shape, &self.episodes[index], to)
            .expect("what is kept was encoded here, or read when it was restored");
    }

    /// Everything that it holds.
    #[must_use]
    pub fn state(&self) -> MemoryState {
        MemoryState {
            first: self.first,
            episodes: self.episodes.iter().cloned().collect(),
        }
    }

    /// The same memory with what a checkpoint holds.
    ///
    /// # Errors
    /// [`Error::Data`] if there are more episodes than there is room for, or one cannot be read as one of this shape.
    pub fn restored(&self, state: MemoryState) -> Result<Self, Error> {
        if state.episodes.len() > self.capacity {
            return Err(Error::Data(format!(
                "the replay memory holds {} episodes, expected at most {}",
                state.episodes.len(),
                self.capacity
            )));
        }
        let mut episode = RememberedEpisode::default();
        for (index, encoded) in state.episodes.iter().enumerate() {
            codec::decode(self.shape, encoded, &mut episode).map_err(|what| {
                let number = state.first.saturating_add(index as u64);
                Error::Data(format!("episode {number} of the replay memory: {what}"))
            })?;
        }
        Ok(Self {
            shape: self.shape,
            capacity: self.capacity,
            first: state.first,
            episodes: state.episodes.into(),
        })
    }
}

#[cfg(test)]
mod tests;
