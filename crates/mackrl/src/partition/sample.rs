//! A few partitions of a team that has too many to list.

use std::collections::BTreeSet;

use mackrl_env::{AgentId, Draw, EpisodeKey, Stream};

use super::{Partition, partition_count};
use crate::Error;

/// The number under which a run's sample is drawn: the last one, which no episode of any length of training reaches.
const EPISODE_OF_SAMPLE: u64 = (1 << 56) - 1;

/// Draws `count` distinct partitions of `agents`, each set equally likely, by shuffling the team and pairing neighbours.
///
/// Nothing is enumerated: repeated partitions are drawn again, so the time is proportional to `count` unless almost all
/// partitions are asked for.
///
/// # Errors
/// [`Error::Config`] if `count` is 0 or there are fewer partitions than that.
pub fn sample_partitions(agents: usize, count: usize, seed: u64) -> Result<Vec<Partition>, Error> {
    let most = partition_count(agents);
    if count == 0 || count as u128 > most {
        return Err(Error::Config(format!(
            "a sample of {count} partitions was asked for, expected 1 to {most} for {agents} agents"
        )));
    }
    let key = EpisodeKey::new(seed, Stream::Other, EPISODE_OF_SAMPLE);
    let mut order: Vec<AgentId> = (0..agents).map(AgentId::new).collect();
    let mut seen = BTreeSet::new();
    let mut partitions = Vec::with_capacity(count);
    for attempt in 0.. {
        if partitions.len() == count {
            break;
        }
        shuffle(&mut order, &key, attempt);
        let partition = Partition::from_order(&order);
        if seen.insert(partition.clone()) {
            partitions.push(partition);
        }
    }
    Ok(partitions)
}

/// Shuffles `order` (Fisher and Yates) with the draws named by `key`, `step` and [`Draw::Setup`].
pub(super) fn shuffle(order: &mut [AgentId], key: &EpisodeKey, step: usize) {
    for last in (1..order.len()).rev() {
        let bits = u128::from(key.bits(step, Draw::Setup(last)));
        let chosen = (bits * (last as u128 + 1)) >> 64;
        order.swap(
            last,
            usize::try_from(chosen).expect("the chosen place is at most `last`"),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::all_partitions;

    #[test]
    fn a_sample_of_a_large_team_is_distinct_and_repeatable() {
        let sample = sample_partitions(27, 101, 7).expect("27 agents have enough partitions");
        let distinct: BTreeSet<_> = sample.iter().collect();
        assert_eq!(distinct.len(), 101);
        assert!(
            sample.iter().all(|partition| partition.agents() == 27),
            "a partition lacks an agent"
        );
        assert_eq!(sample, sample_partitions(27, 101, 7).expect("as before"));
        assert_ne!(sample, sample_partitions(27, 101, 8).expect("as before"));
    }

    #[test]
    fn a_sample_as_large_as_the_set_is_the_set() {
        let mut sample = sample_partitions(7, 105, 3).expect("7 agents have 105 partitions");
        let mut all = all_partitions(7);
        sample.sort();
        all.sort();
        assert_eq!(sample, all);
    }

    #[test]
    fn every_partition_is_equally_likely() {
        let all = all_partitions(5);
        let draws = 15_000_u64;
        let mut counts = vec![0.0; all.len()];
        for seed in 0..draws {
            let partition = &sample_partitions(5, 1, seed).expect("one of 15")[0];
            let index = all.iter().position(|other| other == partition);
            counts[index.expect("the sample is a partition")] += 1.0;
        }
        let expected = draws as f64 / all.len() as f64;
        let chi_square: f64 = counts
            .iter()
            .map(|count: &f64| (count - expected).powi(2) / expected)
            .sum();
        // Mean 14, standard deviation √28.
        assert!(
            chi_square < 14.0 + 5.0 * 28.0_f64.sqrt(),
            "χ² = {chi_square}"
        );
    }

    #[test]
    fn an_impossible_size_is_refused() {
        for count in [0, 16] {
            let error = sample_partitions(5, count, 1).expect_err("5 agents have 15 partitions");
            assert!(error.to_string().contains("expected 1 to 15"), "{error}");
        }
    }
}
