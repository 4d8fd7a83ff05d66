//! Games that are shared by all environments of a run.
//!
//! Training and testing take turns, so their environments can use the same processes: an environment takes a game when an
//! episode begins and gives it back when the episode has ended well. There are never more processes than episodes under way.

use std::{
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use super::{
    Installation,
    fault::{FaultKind, GameFault},
    game::Game,
    process::Launcher,
};

/// How games are started and how long they are waited for.
#[derive(Debug, Clone, PartialEq)]
pub struct GameSettings {
    /// Which game.
    pub installation: Installation,
    /// How it is started.
    pub launcher: Launcher,
    /// How long a starting game may take to listen.
    pub launch_patience: Duration,
    /// How long any answer may take.
    pub patience: Duration,
    /// Failures in a row of one environment, without an episode that ended in between, after which it gives up; ≥ 1.
    pub failures_max: u32,
}

/// Games of one map.
#[derive(Debug)]
pub struct GamePool {
    settings: GameSettings,
    idle: Mutex<Vec<Game>>,
    launches: AtomicU64,
    faults: [AtomicU64; FaultKind::ALL.len()],
}

/// What has happened in a pool.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FaultCounts {
    /// Processes that were started.
    pub launches: u64,
    /// Faults of each kind, by its name.
    pub faults: Vec<(&'static str, u64)>,
}

impl FaultCounts {
    /// Faults of all kinds.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.faults.iter().map(|(_, count)| count).sum()
    }
}

impl GamePool {
    /// No game yet.
    #[must_use]
    pub fn new(settings: GameSettings) -> Self {
        Self {
            settings,
            idle: Mutex::new(Vec::new()),
            launches: AtomicU64::new(0),
            faults: Default::default(),
        }
    }

    /// How games are started.
    #[must_use]
    pub const fn settings(&self) -> &GameSettings {
        &self.settings
    }

    /// What has happened so far.
    #[must_use]
    pub fn counts(&self) -> FaultCounts {
        let faults = FaultKind::ALL.iter().zip(&self.faults);
        FaultCounts {
            launches: self.launches.load(Ordering::Relaxed),
            faults: faults
                .map(|((_, name), count)| (*name, count.load(Ordering::Relaxed)))
                .collect(),
        }
    }

    /// A game that somebody has given back.
    pub(super) fn take(&self) -> Option<Game> {
        self.idle
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop()
    }

    /// Keeps a healthy game for the next who needs one.
    pub(super) fn give_back(&self, game: Game) {
        self.idle
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(game);
    }

    pub(super) fn count_launch(&self) {
        self.launches.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn count_fault(&self, fault: &GameFault) {
        let place = FaultKind::ALL
            .iter()
            .position(|(kind, _)| *kind == fault.kind());
        if let Some(count) = place.and_then(|place| self.faults.get(place)) {
            count.fetch_add(1, Ordering::Relaxed);
        }
    }
}
