//! What a step counts for in the policy's loss, when some episodes of a batch are longer than others.

use mackrl_env::declare_words;

declare_words! {
    /// How the policy's loss is averaged over a batch of episodes.
    pub enum LossAverage {
        /// Over all steps that were played, each alike.
        #[default]
        Steps = "steps",
        /// At each time over the episodes that are still played, then over all times up to the time limit: late steps of long episodes
        /// count for more, and a batch of short episodes for less. So does the authors' code.
        Slots = "slots",
    }
}

impl LossAverage {
    /// What a step counts for, for each time step up to the end of the longest episode; `steps_b` are the episodes' lengths and
    /// `limit` the world's time limit, all in steps. Over all steps of all episodes the numbers sum to 1, but for `Slots` to
    /// T / (limit + 1), where T is the longest episode: the authors' code takes the mean over a buffer with a slot for every step
    /// that an episode may have, and one more.
    #[must_use]
    pub fn weight_t(self, steps_b: &[usize], limit: usize) -> Vec<f32> {
        let longest = steps_b.iter().copied().max().unwrap_or(0);
        let all: usize = steps_b.iter().sum();
        let weight = |t: usize| match self {
            Self::Steps => 1.0 / all as f32,
            Self::Slots => {
                let playing = steps_b.iter().filter(|&&steps| steps > t).count();
                1.0 / (playing * (limit + 1)) as f32
            }
        };
        (0..longest).map(weight).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_counts_for_one_of_all_or_for_one_of_those_of_its_time() {
        let steps_b = [1, 3, 3];
        assert_eq!(LossAverage::Steps.weight_t(&steps_b, 9), [1.0 / 7.0; 3]);
        let slots = LossAverage::Slots.weight_t(&steps_b, 9);
        assert_eq!(slots, [1.0 / 30.0, 1.0 / 20.0, 1.0 / 20.0]);
    }

    #[test]
    fn episodes_of_one_length_count_alike_either_way_but_for_the_length() {
        let [steps, slots] =
            [LossAverage::Steps, LossAverage::Slots].map(|average| average.weight_t(&[4, 4], 9));
        for (steps, slots) in steps.into_iter().zip(slots) {
            assert!((slots - steps * 4.0 / 10.0).abs() < 1e-8, "{slots} {steps}");
        }
        assert_eq!(LossAverage::Slots.weight_t(&[], 9), [0.0; 0]);
    }
}
