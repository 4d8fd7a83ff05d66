//! Means of what was seen while acting, summed over steps and shards.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Named sums with their counts.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Tally {
    sums: BTreeMap<String, (f64, f64)>,
}

impl Tally {
    /// Adds `count` observations of `name` whose sum is `sum`.
    pub fn add(&mut self, name: impl Into<String>, sum: f64, count: f64) {
        let entry = self.sums.entry(name.into()).or_default();
        entry.0 += sum;
        entry.1 += count;
    }

    /// Adds all that `other` holds.
    pub fn merge(&mut self, other: &Self) {
        for (name, &(sum, count)) in &other.sums {
            self.add(name.clone(), sum, count);
        }
    }

    /// Every name, in alphabetical order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.sums.keys().map(String::as_str)
    }

    /// The mean of each name that was observed at least once, in alphabetical order.
    pub fn means(&self) -> impl Iterator<Item = (&str, f64)> {
        let observed = self.sums.iter().filter(|(_, (_, count))| *count > 0.0);
        observed.map(|(name, (sum, count))| (name.as_str(), sum / count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_weighs_every_observation_alike() {
        let mut tally = Tally::default();
        tally.add("rate", 1.0, 1.0);
        let mut other = Tally::default();
        other.add("rate", 0.0, 3.0);
        other.add("never seen", 0.0, 0.0);
        tally.merge(&other);
        assert_eq!(tally.means().collect::<Vec<_>>(), [("rate", 0.25)]);
    }
}
