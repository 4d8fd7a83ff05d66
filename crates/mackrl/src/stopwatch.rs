//! Where the time of training goes, for whoever wants to make it faster.
//!
//! Time is booked in laps: a call says what everything since the call before was spent on, so nothing is counted twice and
//! nothing is forgotten. A stopwatch that was never started costs a branch a lap; one that runs reads the clock a dozen times
//! in a step of a shard, which is less than a hundredth of that step. No result depends on it.

use std::time::{Duration, Instant};

/// What training spends its time on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Stepping and resetting environments, observations and states included.
    Simulate,
    /// Finding what groups commonly know, and encoding it as their controllers' inputs and masks.
    CommonKnowledge,
    /// Evaluating controllers, sampling from them, and noting statistics of their choices.
    Act,
    /// The marginal probability of the joint action, with its gradient.
    Marginal,
    /// The critic's sweep: its own updates, λ-returns and advantages.
    Critic,
    /// Remembering new episodes, and drawing remembered ones.
    Memory,
    /// The backward pass through the controllers; where remembered episodes are learnt from, the forward passes as well.
    Backward,
    /// Clipping, the optimiser's step and preparing the new weights.
    Optimiser,
    /// Greedy test episodes.
    Test,
    /// Everything else.
    Other,
}

/// Adds up the time of each phase.
#[derive(Debug, Clone, Default)]
pub struct Stopwatch {
    /// When the lap began; `None` until the stopwatch is started.
    began: Option<Instant>,
    spent: [Duration; Phase::ALL.len()],
}

impl Phase {
    /// Every phase, in the order in which a step meets them.
    pub const ALL: [Self; 10] = [
        Self::Simulate,
        Self::CommonKnowledge,
        Self::Act,
        Self::Marginal,
        Self::Critic,
        Self::Memory,
        Self::Backward,
        Self::Optimiser,
        Self::Test,
        Self::Other,
    ];

    /// The phase in snake case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Simulate => "simulate",
            Self::CommonKnowledge => "common_knowledge",
            Self::Act => "act",
            Self::Marginal => "marginal",
            Self::Critic => "critic",
            Self::Memory => "memory",
            Self::Backward => "backward",
            Self::Optimiser => "optimiser",
            Self::Test => "test",
            Self::Other => "other",
        }
    }
}

impl Stopwatch {
    /// Begins the first lap.
    pub fn start(&mut self) {
        self.began = Some(Instant::now());
    }

    /// Begins the lap anew, if the stopwatch was started: the time since the last lap belongs to nobody.
    pub fn skip(&mut self) {
        self.end_lap();
    }

    /// Books the time since the last lap.
    pub fn lap(&mut self, phase: Phase) {
        if let Some(time) = self.end_lap() {
            self.spent[phase as usize] += time;
        }
    }

    /// Books the time since the last lap in the proportions of what `parts`, which ran side by side in it, have booked
    /// themselves, and empties their books.
    pub fn lap_shared_by<'a>(&mut self, parts: impl Iterator<Item = &'a mut Self>) {
        let Some(time) = self.end_lap() else {
            return;
        };
        let mut working = [0.0; Phase::ALL.len()];
        for part in parts {
            for (sum, spent) in working.iter_mut().zip(std::mem::take(&mut part.spent)) {
                *sum += spent.as_secs_f64();
            }
        }
        let total: f64 = working.iter().sum();
        if total > 0.0 {
            for (spent, working) in self.spent.iter_mut().zip(working) {
                *spent += time.mul_f64(working / total);
            }
        }
    }

    /// The time booked for a phase.
    #[must_use]
    pub const fn spent(&self, phase: Phase) -> Duration {
        self.spent[phase as usize]
    }

    fn end_lap(&mut self) -> Option<Duration> {
        let began = self.began.as_mut()?;
        let now = Instant::now();
        let time = now - *began;
        *began = now;
        Some(time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAUSE: Duration = Duration::from_millis(2);

    #[test]
    fn a_stopwatch_that_was_not_started_books_nothing() {
        let mut stopwatch = Stopwatch::default();
        std::thread::sleep(PAUSE);
        stopwatch.lap(Phase::Act);
        assert!(Phase::ALL.iter().all(|&p| stopwatch.spent(p).is_zero()));
    }

    #[test]
    fn laps_follow_each_other_and_what_is_skipped_is_nobodys() {
        let mut stopwatch = Stopwatch::default();
        stopwatch.start();
        std::thread::sleep(PAUSE);
        stopwatch.lap(Phase::Critic);
        std::thread::sleep(50 * PAUSE);
        stopwatch.skip();
        stopwatch.lap(Phase::Test);
        assert!(stopwatch.spent(Phase::Critic) >= PAUSE, "{stopwatch:?}");
        assert!(stopwatch.spent(Phase::Test) < 50 * PAUSE, "{stopwatch:?}");
    }

    #[test]
    fn a_lap_is_shared_out_in_the_proportions_of_its_parts() {
        let [mut whole, mut first, mut second] = std::array::from_fn(|_| Stopwatch::default());
        first.spent[Phase::Act as usize] = 3 * PAUSE;
        second.spent[Phase::Act as usize] = 2 * PAUSE;
        second.spent[Phase::Simulate as usize] = 15 * PAUSE;
        whole.start();
        std::thread::sleep(PAUSE);
        whole.lap_shared_by([&mut first, &mut second].into_iter());
        let spent = |phase| whole.spent(phase).as_secs_f64();
        assert!(spent(Phase::Act) + spent(Phase::Simulate) >= PAUSE.as_secs_f64());
        assert!((spent(Phase::Simulate) / spent(Phase::Act) - 3.0).abs() < 1e-3);
        assert!(second.spent(Phase::Simulate).is_zero(), "{second:?}");
    }
}
