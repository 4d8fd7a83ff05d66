//! What is reported of the hierarchy's choices: who delegated, knowing how much.

use mackrl_env::EntitySet;

use super::Path;
use crate::{
    Real,
    policy::{PolicyTable, Tally},
};

/// Sums over the steps of the latest episodes.
#[derive(Debug, Clone)]
pub(crate) struct HierarchyStatistics {
    enemies: usize,
    /// Chosen pairs of living agents with common knowledge, by the number of commonly known enemies: how many delegated,
    /// and how many there were. Figure 7 plots their ratio.
    delegated_by_enemies: Vec<Count>,
    /// Chosen pairs without common knowledge, which can only delegate.
    without_common_knowledge: Count,
    known_entities: Count,
    selector_entropy: Count,
    pair_entropy: Count,
    agent_entropy: Count,
}

/// A sum and the number of its terms.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    sum: f64,
    terms: f64,
}

impl Count {
    fn add(&mut self, term: f64) {
        self.sum += term;
        self.terms += 1.0;
    }
}

impl HierarchyStatistics {
    pub(crate) fn new(enemies: usize) -> Self {
        Self {
            enemies,
            delegated_by_enemies: vec![Count::default(); enemies + 1],
            without_common_knowledge: Count::default(),
            known_entities: Count::default(),
            selector_entropy: Count::default(),
            pair_entropy: Count::default(),
            agent_entropy: Count::default(),
        }
    }

    pub(crate) fn clear(&mut self) {
        *self = Self::new(self.enemies);
    }

    /// Notes one step of one environment. `alive_n` \[N\]; `known_k` \[K\] is the common knowledge of every pair.
    pub(crate) fn observe(
        &mut self,
        table: &PolicyTable<'_, f32>,
        path: &Path,
        known_k: &[EntitySet],
        alive_n: &[bool],
    ) {
        let agents = EntitySet::first(alive_n.len());
        self.selector_entropy.add(entropy(table.selector()));
        let partition = &table.partitions()[path.partition];
        for (place, pair) in partition.pairs().iter().enumerate() {
            if !pair
                .agents()
                .into_iter()
                .all(|agent| alive_n[agent.index()])
            {
                continue;
            }
            let known = known_k[pair.index()];
            let delegated = f64::from(u8::from(path.delegated[place]));
            self.known_entities.add(known.len() as f64);
            if known.is_empty() {
                self.without_common_knowledge.add(delegated);
            } else {
                self.delegated_by_enemies[known.difference(agents).len()].add(delegated);
                self.pair_entropy.add(entropy(table.pair(pair.index())));
            }
        }
        let living = (0..alive_n.len()).filter(|&agent| alive_n[agent]);
        living.for_each(|agent| self.agent_entropy.add(entropy(table.agent(agent))));
    }

    /// Adds the sums to `tally` under the names that `training::metrics` explains.
    pub(crate) fn report(&self, tally: &mut Tally) {
        let mut add = |name: &str, count: Count| tally.add(name, count.sum, count.terms);
        let with_knowledge =
            self.delegated_by_enemies
                .iter()
                .fold(Count::default(), |all, some| Count {
                    sum: all.sum + some.sum,
                    terms: all.terms + some.terms,
                });
        add("mackrl/delegation_rate", with_knowledge);
        for (enemies, &count) in self.delegated_by_enemies.iter().enumerate() {
            add(
                &format!("mackrl/delegation_rate_ck_enemies_{enemies}"),
                count,
            );
        }
        let all_pairs = with_knowledge.terms + self.without_common_knowledge.terms;
        add(
            "mackrl/common_knowledge_rate",
            Count {
                sum: with_knowledge.terms,
                terms: all_pairs,
            },
        );
        add("mackrl/ck_entities_mean", self.known_entities);
        add("mackrl/entropy_l1", self.selector_entropy);
        add("mackrl/entropy_l2", self.pair_entropy);
        add("mackrl/entropy_l3", self.agent_entropy);
    }
}

/// −Σ p log p in nats.
pub(crate) fn entropy<F: Real>(log_p: &[F]) -> f64 {
    let terms = log_p
        .iter()
        .map(|&log_p| log_p.to_f64())
        .filter(|log_p| log_p.is_finite());
    -terms.map(|log_p| log_p.exp() * log_p).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entropy_of_a_uniform_choice_is_the_logarithm_of_its_size() {
        let log_p = [
            f64::NEG_INFINITY,
            -(3.0_f64).ln(),
            -(3.0_f64).ln(),
            -(3.0_f64).ln(),
        ];
        assert!((entropy(&log_p) - 3.0_f64.ln()).abs() < 1e-12);
        assert!(entropy(&[0.0, f64::NEG_INFINITY]).abs() < 1e-12);
    }
}
