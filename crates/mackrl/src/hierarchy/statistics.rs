//! What is reported of the hierarchy's choices: who delegated, knowing how much.

use mackrl_env::EntitySet;

use super::{Parts, metrics::OfLevel, tables::Decision};
use crate::{
    Real,
    policy::{Level, Part, Tally},
};

/// Sums over the steps of the latest episodes.
#[derive(Debug, Clone)]
pub(crate) struct HierarchyStatistics {
    /// Chosen groups of living agents that could act jointly, by the number of commonly known enemies: how many divided
    /// instead, and how many there were. Figure 7 plots their ratio.
    delegated_by_enemies: Vec<Count>,
    /// Chosen groups without common knowledge, which can only divide.
    without_common_knowledge: Count,
    known_entities: Count,
    /// Of each level; nothing where there is no network.
    entropies: Vec<Option<Entropies>>,
    /// Whether some level may act jointly or delegate.
    delegates: bool,
}

/// How undecided a level is.
#[derive(Debug, Clone)]
struct Entropies {
    names: [String; 2],
    in_nats: Count,
    /// In shares of the greatest entropy that a mask allows, where it allows two choices or more.
    share: Count,
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

    const fn plus(self, other: Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            terms: self.terms + other.terms,
        }
    }
}

impl HierarchyStatistics {
    pub(crate) fn new(parts: &Parts) -> Self {
        let enemies = parts.spec.entities - parts.spec.agents;
        let levels = parts.declaration.levels();
        let entropies = levels.iter().map(|level| {
            let names = || [OfLevel::Entropy, OfLevel::EntropyShare].map(|of| of.name(level));
            level.is_learned().then(|| Entropies {
                names: names(),
                in_nats: Count::default(),
                share: Count::default(),
            })
        });
        Self {
            delegated_by_enemies: vec![Count::default(); enemies + 1],
            without_common_knowledge: Count::default(),
            known_entities: Count::default(),
            entropies: entropies.collect(),
            delegates: levels.iter().any(Level::delegates),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.delegated_by_enemies.fill(Count::default());
        self.without_common_knowledge = Count::default();
        self.known_entities = Count::default();
        for own in self.entropies.iter_mut().flatten() {
            (own.in_nats, own.share) = Default::default();
        }
    }

    /// Notes one step of one environment.
    pub(crate) fn observe(&mut self, decision: &Decision<'_>) {
        let declaration = decision.table.declaration();
        let agents = EntitySet::first(declaration.agents());
        let alone = declaration.alone();
        for &(part, column) in &decision.path.choices {
            let level = &declaration.levels()[part.level];
            if part.level == alone || level.is_forced_by_death() && !decision.lives(part) {
                continue;
            }
            let mut chooses = true;
            if level.acts.is_some() {
                let known = decision.known(part);
                let delegated = f64::from(u8::from(column < level.divisions));
                self.known_entities.add(known.len() as f64);
                if known.is_empty() {
                    self.without_common_knowledge.add(delegated);
                    chooses = false;
                } else {
                    self.delegated_by_enemies[known.difference(agents).len()].add(delegated);
                }
            }
            if chooses {
                self.note_entropy(decision, part);
            }
        }
        let last = &declaration.levels()[alone];
        for group in 0..last.groups.len() {
            let part = Part {
                level: alone,
                group,
            };
            if last.survives || decision.lives(part) {
                self.note_entropy(decision, part);
            }
        }
    }

    fn note_entropy(&mut self, decision: &Decision<'_>, part: Part) {
        let Some(own) = &mut self.entropies[part.level] else {
            return;
        };
        let row = decision.table.row(part);
        let entropy = entropy(row);
        own.in_nats.add(entropy);
        let choices = row.iter().filter(|log_p| log_p.is_finite()).count();
        if choices > 1 {
            own.share.add(entropy / (choices as f64).ln());
        }
    }

    /// Adds the sums to `tally`.
    pub(crate) fn report(&self, tally: &mut Tally) {
        let mut add = |name: &str, count: Count| tally.add(name, count.sum, count.terms);
        for own in self.entropies.iter().flatten() {
            add(&own.names[0], own.in_nats);
            add(&own.names[1], own.share);
        }
        if !self.delegates {
            return;
        }
        let by_enemies = self.delegated_by_enemies.iter().copied();
        let with_knowledge = by_enemies.fold(Count::default(), Count::plus);
        add("mackrl/delegation_rate", with_knowledge);
        for (enemies, &count) in self.delegated_by_enemies.iter().enumerate() {
            add(
                &format!("mackrl/delegation_rate_ck_enemies_{enemies}"),
                count,
            );
            let cases = Count {
                sum: count.terms,
                terms: with_knowledge.terms,
            };
            add(
                &format!("mackrl/delegation_cases_ck_enemies_{enemies}"),
                cases,
            );
        }
        let known = Count {
            sum: with_knowledge.terms,
            terms: with_knowledge.terms + self.without_common_knowledge.terms,
        };
        add("mackrl/common_knowledge_rate", known);
        add("mackrl/ck_entities_mean", self.known_entities);
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
