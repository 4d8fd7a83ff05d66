//! How a recorded episode went, in one line or one object.

use std::fmt;

use mackrl_skirmish::BattleStatistics;
use serde::Serialize;

use super::{Playback, Replay};

/// How an episode went.
#[derive(Debug, Serialize)]
pub struct Summary {
    map: String,
    policy: String,
    seed: u64,
    episode: u64,
    battle_won: bool,
    #[serde(rename = "return")]
    total: f64,
    ep_length: usize,
    dead_allies: usize,
    dead_enemies: usize,
    timed_out: bool,
    state_hash: String,
}

/// How an episode ended, in words.
#[must_use]
pub const fn outcome_in_words(battle_won: bool, timed_out: bool) -> &'static str {
    match (battle_won, timed_out) {
        (true, _) => "won",
        (false, true) => "out of time",
        (false, false) => "not won",
    }
}

impl Summary {
    /// Of a replay that was played again.
    #[must_use]
    pub fn of(replay: &Replay, playback: &Playback) -> Self {
        let BattleStatistics {
            battle_won,
            dead_allies,
            dead_enemies,
            timed_out,
        } = playback.statistics;
        Self {
            map: replay.env.map().to_owned(),
            policy: replay.player.name(),
            seed: replay.key.seed,
            episode: replay.key.episode,
            battle_won,
            total: (playback.reward_t.iter()).fold(0.0, |total, reward| total + f64::from(*reward)),
            ep_length: playback.steps(),
            dead_allies,
            dead_enemies,
            timed_out,
            state_hash: format!("{:016x}", playback.skirmish.state_hash()),
        }
    }
}

impl Summary {
    /// How it ended.
    #[must_use]
    pub fn outcome(&self) -> String {
        format!(
            "{} after {} steps, return {:.2}, allies lost: {}, enemies lost: {}",
            outcome_in_words(self.battle_won, self.timed_out),
            self.ep_length,
            self.total,
            self.dead_allies,
            self.dead_enemies
        )
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            map,
            policy,
            state_hash,
            ..
        } = self;
        let outcome = self.outcome();
        write!(
            formatter,
            "{map} by {policy}, {outcome}, state {state_hash}"
        )
    }
}
