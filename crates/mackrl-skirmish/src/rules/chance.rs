//! The dice of a battle.

use mackrl_env::{Draw, EpisodeKey};

/// Numbers a step's draws, so that each is a pure function of the episode, the step and its place in the step.
#[derive(Debug, Clone, PartialEq)]
pub struct Chance {
    key: EpisodeKey,
    step: usize,
    draws: usize,
}

impl Chance {
    /// Dice for step number `step` of the episode `key`.
    #[must_use]
    pub const fn new(key: EpisodeKey, step: usize) -> Self {
        Self {
            key,
            step,
            draws: 0,
        }
    }

    /// A number uniform in \[0, 1).
    pub fn uniform(&mut self) -> f32 {
        let draw = Draw::World(self.draws);
        self.draws += 1;
        (self.key.bits(self.step, draw) >> 40) as f32 * (1.0 / (1_u32 << 24) as f32)
    }

    /// A number uniform in \[`least`, `greatest`).
    pub fn between(&mut self, least: f32, greatest: f32) -> f32 {
        least + (greatest - least) * self.uniform()
    }
}
