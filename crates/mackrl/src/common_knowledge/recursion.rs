//! Common knowledge as it is defined: a tower of "a knows that b knows that …" (eqs. (1) and (2)).
//!
//! Far slower than Lemma 1 and without any cleverness, so that the lemma can be tested against it. The paper proves that
//! the tower is complete from level 3 on; [`Limit::stable_from`] shows that it is complete at level 2 at the latest, and at
//! level 1 where there is any common knowledge.

use mackrl_env::{AgentId, EntitySet};

/// The limit of the recursion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limit {
    /// 𝓘^𝒢: what the group commonly knows.
    pub known: EntitySet,
    /// The lowest m with 𝓘^{a,m} = 𝓘^𝒢 for every member a, and likewise for all levels above.
    pub stable_from: usize,
}

/// The recursion with its working memory, to be used many times.
#[derive(Debug, Clone, Default)]
pub struct Recursion {
    /// 𝓘^{a,m} for each member a, in the order of the group.
    level: Vec<EntitySet>,
    next: Vec<EntitySet>,
}

impl Recursion {
    /// Climbs the tower until a level equals the one below it; above, nothing can change any more.
    ///
    /// # Shapes
    /// `visible_n` \[N\].
    ///
    /// # Equation
    /// 𝓘^{a,0} = 𝓜^a; 𝓘^{a,m} = ∩_{b ∈ 𝒢} { e ∈ 𝓘^{b,m−1} | μ^a(s^a, s^b) } for a ∈ 𝒢.
    ///
    /// # Panics
    /// If the members' limits differ, which would refute that the definition gives *common* knowledge.
    pub fn limit(&mut self, group: &[AgentId], visible_n: &[EntitySet]) -> Limit {
        self.level.clear();
        self.level
            .extend(group.iter().map(|agent| visible_n[agent.index()]));
        let mut stable_from = 0;
        loop {
            self.climb(group, visible_n);
            if self.next == self.level {
                break;
            }
            std::mem::swap(&mut self.level, &mut self.next);
            stable_from += 1;
        }
        let known = self.level.first().copied().unwrap_or(EntitySet::EMPTY);
        assert!(
            self.level.iter().all(|&other| other == known),
            "the members of a group differ in what they commonly know"
        );
        Limit { known, stable_from }
    }

    /// Computes the level above `level` into `next`.
    fn climb(&mut self, group: &[AgentId], visible_n: &[EntitySet]) {
        self.next.clear();
        for a in group {
            let mut known = EntitySet::from_bits(u128::MAX);
            for (&b, &known_to_b) in group.iter().zip(&self.level) {
                let a_sees_b = visible_n[a.index()].contains(b);
                known = known.intersection(if a_sees_b {
                    known_to_b
                } else {
                    EntitySet::EMPTY
                });
            }
            self.next.push(known);
        }
    }
}
