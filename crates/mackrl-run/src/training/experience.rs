//! A hash of everything that a run has learnt from, by which two runs can be told apart at any row of metrics.

use mackrl::experience::Episode;

/// An odd number without a pattern: 2⁶⁴ divided by the golden ratio.
const MULTIPLIER: u64 = 0x9E37_79B9_7F4A_7C15;

/// The hash of all states and rewards of the training episodes so far. Each episode's follows from all before it, so two runs that
/// have once differed stay apart.
///
/// Quick rather than secure: a multiplication for two numbers is below a hundredth of what playing a step costs, and nobody
/// gains by forging it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct ExperienceHash(pub(super) u64);

impl ExperienceHash {
    /// Adds an episode.
    pub(super) fn add(&mut self, episode: &Episode) {
        self.mix(episode.steps() as u64);
        for numbers in [&episode.state_tg, &episode.reward_t] {
            let (pairs, rest) = numbers.as_chunks::<2>();
            for [low, high] in pairs {
                self.mix(u64::from(low.to_bits()) | u64::from(high.to_bits()) << 32);
            }
            for last in rest {
                self.mix(u64::from(last.to_bits()));
            }
        }
    }

    fn mix(&mut self, word: u64) {
        // The rotation lets high bits, where products end up, meet the low bits of the next word.
        self.0 = (self.0.rotate_left(29) ^ word).wrapping_mul(MULTIPLIER);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash(episodes: &[Episode]) -> u64 {
        let mut hash = ExperienceHash::default();
        episodes.iter().for_each(|episode| hash.add(episode));
        hash.0
    }

    #[test]
    fn every_number_and_the_order_of_episodes_count() {
        let episode = Episode {
            state_tg: vec![0.0, 1.0, -1.0, 0.5, 0.25, 7.0, 3.0, 2.0, 1.5],
            reward_t: vec![1.0, 0.0],
            ..Episode::default()
        };
        let mut hashes = vec![hash(&[]), hash(std::slice::from_ref(&episode))];
        for place in 0..11 {
            let mut other = episode.clone();
            let mut numbers = other.state_tg.iter_mut().chain(&mut other.reward_t);
            let number = numbers.nth(place).unwrap();
            *number = f32::from_bits(number.to_bits() ^ 1);
            hashes.push(hash(&[episode.clone(), other.clone()]));
            hashes.push(hash(&[other, episode.clone()]));
        }
        let count = hashes.len();
        hashes.sort_unstable();
        hashes.dedup();
        assert_eq!(hashes.len(), count);
    }
}
