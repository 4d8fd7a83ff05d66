//! Random numbers as a pure function of *what they are for*.
//!
//! A stream of random numbers has a hidden state: skip one draw and every later one changes. Agents that share a seed but
//! not a process cannot keep such a stream in step. Here a draw is named by (seed, stream, episode, step, [`Draw`]) and
//! computed by Philox4x32-10 (Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as 1, 2, 3", 2011), a
//! counter-based generator. Both members of a pair therefore derive the pair's draw without exchanging a word, and a draw
//! that one of them skips changes nothing for anybody.

use serde::{Deserialize, Serialize};

const MULTIPLIERS: [u32; 2] = [0xD251_1F53, 0xCD9E_8D57];
const WEYL: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];
const ROUNDS: usize = 10;

/// What an episode is played for; each has its own random numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stream {
    /// Episodes that are learnt from.
    Training,
    /// Periodic greedy tests during training.
    Test,
    /// `mackrl evaluate`.
    Evaluation,
    /// Benchmarks, examples, scripted play and other uses.
    Other,
}

/// What a random number within one step is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Draw {
    /// The pair selector's choice of a partition.
    Selector,
    /// The choice of the pair with this index, shared by its members.
    Pair(usize),
    /// The private choice of the agent with this index.
    Agent(usize),
    /// The world's n-th draw of this step.
    World(usize),
    /// The choice of a larger group, by its level in the hierarchy and its number there, shared by its members.
    Group(usize, usize),
    /// Initial parameters, seeded subsets and other draws made once.
    Setup(usize),
}

/// Names one episode, and with it every random number drawn in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct EpisodeKey {
    /// The run's seed.
    pub seed: u64,
    /// What the episode is for.
    pub stream: Stream,
    /// Number of the episode within its stream.
    pub episode: u64,
}

impl EpisodeKey {
    /// Names episode number `episode` of `stream` in the run seeded with `seed`.
    #[must_use]
    pub const fn new(seed: u64, stream: Stream, episode: u64) -> Self {
        Self {
            seed,
            stream,
            episode,
        }
    }

    /// 64 random bits for `draw` at `step`.
    #[must_use]
    pub fn bits(&self, step: usize, draw: Draw) -> u64 {
        let [low, high, ..] = self.block(step, draw);
        u64::from(high) << 32 | u64::from(low)
    }

    /// A number uniform in [0, 1) with 53 random bits.
    #[must_use]
    pub fn uniform(&self, step: usize, draw: Draw) -> f64 {
        (self.bits(step, draw) >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// A standard normal number (Box–Muller).
    #[must_use]
    pub fn normal(&self, step: usize, draw: Draw) -> f64 {
        let [a, b, c, d] = self.block(step, draw);
        let unit = |high: u32, low: u32| {
            ((u64::from(high) << 32 | u64::from(low)) >> 11) as f64 / (1_u64 << 53) as f64
        };
        let radius = (-2.0 * libm::log(1.0 - unit(a, b))).sqrt();
        radius * libm::cos(std::f64::consts::TAU * unit(c, d))
    }

    /// The generator's four output words for this name.
    fn block(&self, step: usize, draw: Draw) -> [u32; 4] {
        let (kind, index) = match draw {
            Draw::Selector => (0, 0),
            Draw::Pair(index) => (1, index),
            Draw::Agent(index) => (2, index),
            Draw::World(index) => (3, index),
            Draw::Setup(index) => (4, index),
            Draw::Group(level, index) => (5, level << 24 | index),
        };
        debug_assert!(index < 1 << 28, "a draw's index has 28 bits");
        debug_assert!(self.episode < 1 << 56, "an episode's number has 56 bits");
        let stream = match self.stream {
            Stream::Training => 0,
            Stream::Test => 1,
            Stream::Evaluation => 2,
            Stream::Other => 3,
        };
        let episode = split(self.episode | stream << 56);
        let counter = [
            episode[0],
            episode[1],
            low_word(step),
            kind << 28 | low_word(index),
        ];
        philox(counter, split(self.seed))
    }
}

fn split(word: u64) -> [u32; 2] {
    [(word & 0xFFFF_FFFF) as u32, (word >> 32) as u32]
}

fn low_word(value: usize) -> u32 {
    split(value as u64)[0]
}

/// Philox4x32-10.
fn philox(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
    for round in 0..ROUNDS {
        if round > 0 {
            key = [key[0].wrapping_add(WEYL[0]), key[1].wrapping_add(WEYL[1])];
        }
        let [low0, high0] = split(u64::from(counter[0]) * u64::from(MULTIPLIERS[0]));
        let [low1, high1] = split(u64::from(counter[2]) * u64::from(MULTIPLIERS[1]));
        counter = [
            high1 ^ counter[1] ^ key[0],
            low1,
            high0 ^ counter[3] ^ key[1],
            low0,
        ];
    }
    counter
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The known-answer vectors that Salmon and others publish with Random123.
    #[test]
    fn philox_gives_its_published_answers() {
        assert_eq!(
            philox([0; 4], [0; 2]),
            [0x6627_E8D5, 0xE169_C58D, 0xBC57_AC4C, 0x9B00_DBD8]
        );
        assert_eq!(
            philox([0xFFFF_FFFF; 4], [0xFFFF_FFFF; 2]),
            [0x408F_276D, 0x41C8_3B0E, 0xA20B_C7C6, 0x6D54_51FD]
        );
        assert_eq!(
            philox(
                [0x243F_6A88, 0x85A3_08D3, 0x1319_8A2E, 0x0370_7344],
                [0xA409_3822, 0x299F_31D0]
            ),
            [0xD16C_FE09, 0x94FD_CCEB, 0x5001_E420, 0x2412_6EA1]
        );
    }

    #[test]
    fn every_part_of_the_name_changes_the_number() {
        let key = EpisodeKey::new(1, Stream::Training, 0);
        let others = [
            EpisodeKey::new(2, Stream::Training, 0).bits(0, Draw::Selector),
            EpisodeKey::new(1, Stream::Test, 0).bits(0, Draw::Selector),
            EpisodeKey::new(1, Stream::Training, 1).bits(0, Draw::Selector),
            key.bits(1, Draw::Selector),
            key.bits(0, Draw::Pair(0)),
            key.bits(0, Draw::Agent(0)),
            key.bits(0, Draw::World(0)),
        ];
        for other in others {
            assert_ne!(
                key.bits(0, Draw::Selector),
                other,
                "two draws share their bits"
            );
        }
    }

    #[test]
    fn uniform_numbers_fill_the_unit_interval_evenly() {
        let key = EpisodeKey::new(7, Stream::Other, 3);
        let numbers: Vec<f64> = (0..20_000)
            .map(|i| key.uniform(i, Draw::Agent(2)))
            .collect();
        let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
        assert!((mean - 0.5).abs() < 0.01, "mean {mean}");
        assert!(
            numbers.iter().all(|x| (0.0..1.0).contains(x)),
            "a number left [0, 1)"
        );
    }

    #[test]
    fn normal_numbers_have_unit_variance() {
        let key = EpisodeKey::new(7, Stream::Other, 3);
        let count = 20_000;
        let square: f64 = (0..count)
            .map(|i| key.normal(0, Draw::Setup(i)).powi(2))
            .sum();
        assert!(
            (square / count as f64 - 1.0).abs() < 0.05,
            "variance {}",
            square / count as f64
        );
    }
}
