//! What is reported of a battle.

use mackrl_env::Statistic;
use serde::{Deserialize, Serialize};

/// How an episode stands, for reports; agents never see it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BattleStatistics {
    /// Whether the team has won.
    pub battle_won: bool,
    /// Agents that have died.
    pub dead_allies: usize,
    /// Enemies that have died.
    pub dead_enemies: usize,
    /// Whether the limit of steps has ended the episode, undecided.
    pub timed_out: bool,
}

impl BattleStatistics {
    /// S: how many numbers these are.
    pub const COUNT: usize = 4;

    /// The names and meanings of [`values`](Self::values).
    #[must_use]
    pub fn declared() -> [Statistic; Self::COUNT] {
        [
            Statistic::new("battle_won", "1 if the battle was won, else 0"),
            Statistic::new("dead_allies", "number of agents lost"),
            Statistic::new("dead_enemies", "number of enemies defeated"),
            Statistic::new(
                "timed_out",
                "1 if the limit of steps ended the episode undecided, else 0",
            ),
        ]
    }

    /// The same as plain numbers, in the order in which they are declared.
    #[must_use]
    pub fn values(self) -> [f64; Self::COUNT] {
        [
            f64::from(u8::from(self.battle_won)),
            self.dead_allies as f64,
            self.dead_enemies as f64,
            f64::from(u8::from(self.timed_out)),
        ]
    }
}
