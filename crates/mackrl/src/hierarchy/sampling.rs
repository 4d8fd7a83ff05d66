//! Algorithm 1 for the pairwise hierarchy: from the tables of one step to an action for every agent.
//!
//! Each controller's choice is a function of its own row and of a random number that is named by what it is for
//! ([`Draw`]), so an agent that runs only its own controllers makes the choices that the central run makes. The draws of
//! controllers that are not asked are skipped without any effect on the others.

use mackrl_env::{Action, AgentId, Draw, EpisodeKey};

use crate::{
    Real,
    nn::{Element, elementary::exponentials},
    partition::Pair,
    policy::{DELEGATE, Mode, PolicyShape, PolicyTable},
};

/// What a pair controller chose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PairChoice {
    /// Each member acts on its own policy.
    Delegate,
    /// The actions of the lower and the higher member.
    Joint([Action; 2]),
}

/// The choices that led to a joint action. Reports may read it; controllers and learners never do.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Path {
    /// Index of the chosen partition among those in force.
    pub partition: usize,
    /// Whether each pair of that partition delegated, in the partition's order.
    pub delegated: Vec<bool>,
}

/// The choices of all controllers at one step of one episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampler {
    /// The episode.
    pub key: EpisodeKey,
    /// The step within the episode, from 0.
    pub step: usize,
    /// How every controller chooses.
    pub mode: Mode,
}

impl Sampler {
    /// The pair selector's choice among the partitions in force.
    ///
    /// # Shapes
    /// `log_p_p` \[P\].
    ///
    /// # Panics
    /// If no entry of the row is available.
    #[must_use]
    pub fn choose_partition<F: Element>(&self, log_p_p: &[F]) -> usize {
        self.choose(log_p_p, Draw::Selector)
    }

    /// One of `partitions` partitions, each as likely as any other; drawn from the shared seed in greedy mode too.
    #[must_use]
    pub fn draw_partition(&self, partitions: usize) -> usize {
        let uniform = self.key.uniform(self.step, Draw::Selector);
        let reached = |partition: &usize| uniform * (partitions as f64) < (partition + 1) as f64;
        (0..partitions).find(reached).unwrap_or(partitions - 1)
    }

    /// The choice of the controller of `pair`; the same for both members.
    ///
    /// # Shapes
    /// `log_p_c` \[1 + A·A\].
    ///
    /// # Panics
    /// If no entry of the row is available.
    #[must_use]
    pub fn choose_pair<F: Element>(
        &self,
        pair: Pair,
        shape: PolicyShape,
        log_p_c: &[F],
    ) -> PairChoice {
        debug_assert_eq!(log_p_c.len(), shape.columns(), "a pair's row is [1 + A*A]");
        match self.choose(log_p_c, Draw::Pair(pair.index())) {
            DELEGATE => PairChoice::Delegate,
            column => shape
                .joint_action(column)
                .map_or(PairChoice::Delegate, PairChoice::Joint),
        }
    }

    /// The choice of the controller of `agent` alone.
    ///
    /// # Shapes
    /// `log_p_a` \[A\].
    ///
    /// # Panics
    /// If no entry of the row is available.
    #[must_use]
    pub fn choose_action<F: Element>(&self, agent: AgentId, log_p_a: &[F]) -> Action {
        Action::new(self.choose(log_p_a, Draw::Agent(agent.index())))
    }

    /// Walks down the hierarchy: a partition, then for each of its pairs a joint action or *delegate*, then an action for
    /// every agent that is alone. Allocates nothing once `path` has held as many pairs.
    ///
    /// # Shapes
    /// `actions_n` \[N\].
    ///
    /// # Panics
    /// If `actions_n` has not N elements, or a row that is asked has no available entry.
    pub fn sample<F: Element>(
        &self,
        table: &PolicyTable<'_, F>,
        actions_n: &mut [Action],
        path: &mut Path,
    ) {
        let partition = self.choose_partition(table.selector());
        self.sample_within(partition, table, actions_n, path);
    }

    /// As [`Self::sample`], with the partition number `partition` of those in force.
    ///
    /// # Panics
    /// As [`Self::sample`], or if there is no such partition.
    pub fn sample_within<F: Element>(
        &self,
        partition: usize,
        table: &PolicyTable<'_, F>,
        actions_n: &mut [Action],
        path: &mut Path,
    ) {
        assert_eq!(
            actions_n.len(),
            table.shape().agents,
            "one action per agent"
        );
        let alone = |agent: AgentId| self.choose_action(agent, table.agent(agent.index()));
        path.partition = partition;
        path.delegated.clear();
        let partition = &table.partitions()[path.partition];
        for &pair in partition.pairs() {
            let choice = self.choose_pair(pair, table.shape(), table.pair(pair.index()));
            let members = pair.agents();
            let actions = match choice {
                PairChoice::Joint(actions) => actions,
                PairChoice::Delegate => members.map(alone),
            };
            path.delegated.push(choice == PairChoice::Delegate);
            for (member, action) in members.into_iter().zip(actions) {
                actions_n[member.index()] = action;
            }
        }
        if let Some(agent) = partition.singleton() {
            actions_n[agent.index()] = alone(agent);
        }
    }

    fn choose<E: Element>(&self, log_p: &[E], draw: Draw) -> usize {
        match self.mode {
            Mode::Sampled => invert(log_p, self.key.uniform(self.step, draw)),
            Mode::Greedy => most_probable(log_p),
        }
    }
}

/// The first index at which the cumulative probability exceeds `uniform`, over available entries only; the last available
/// one if rounding keeps the total below it.
///
/// The sum runs in `f64` and in the order of indices, so it is the same for all who hold the same row.
fn invert<E: Element>(log_p: &[E], uniform: f64) -> usize {
    const PART: usize = 16;
    let mut cumulative = 0.0;
    let mut last_available = None;
    for (part, log_p) in log_p.chunks(PART).enumerate() {
        let mut p = [E::ZERO; PART];
        exponentials(log_p, &mut p[..log_p.len()]);
        for (place, (&log_p, p)) in log_p.iter().zip(p).enumerate() {
            if log_p > E::NEG_INFINITY {
                cumulative += p.to_f64();
                last_available = Some(part * PART + place);
                if cumulative > uniform {
                    return part * PART + place;
                }
            }
        }
    }
    last_available.expect("every row has an available entry")
}

/// The index of the largest entry, the lowest among equals.
fn most_probable<F: Real>(log_p: &[F]) -> usize {
    let mut best = None;
    for (index, &candidate) in log_p.iter().enumerate() {
        if candidate > best.map_or(F::NEG_INFINITY, |(_, log_p)| log_p) {
            best = Some((index, candidate));
        }
    }
    best.expect("every row has an available entry").0
}

#[cfg(test)]
mod tests {
    use mackrl_env::Stream;

    use super::*;

    const MASKED: f64 = f64::NEG_INFINITY;

    #[test]
    fn a_masked_entry_is_never_chosen_whatever_the_number() {
        let log_p = [MASKED, 0.25_f64.ln(), MASKED, 0.75_f64.ln(), MASKED];
        assert_eq!(invert(&log_p, 0.0), 1);
        assert_eq!(invert(&log_p, 0.249_999), 1);
        assert_eq!(invert(&log_p, 0.25), 3);
        assert_eq!(invert(&log_p, 1.0 - f64::EPSILON), 3);
    }

    #[test]
    fn a_row_whose_total_rounds_below_the_number_gives_its_last_available_entry() {
        let third = (1.0_f32 / 3.0 - 1e-4).ln();
        let log_p = [third, third, third, f32::NEG_INFINITY];
        assert_eq!(invert(&log_p, 0.999_9), 2);
    }

    #[test]
    fn an_entry_that_underflows_is_passed_over() {
        assert_eq!(invert(&[-1e4, 0.0], 0.0), 1);
    }

    #[test]
    fn greedy_ties_go_to_the_lowest_index() {
        assert_eq!(most_probable(&[MASKED, -1.0, -0.5, -0.5, MASKED]), 2);
        assert_eq!(most_probable(&[MASKED, MASKED, -900.0]), 2);
    }

    #[test]
    fn partitions_are_drawn_evenly_and_in_both_modes_alike() {
        let mut counts = [0; 3];
        for step in 0..3_000 {
            let drawn = [Mode::Sampled, Mode::Greedy].map(|mode| {
                let key = EpisodeKey::new(5, Stream::Training, 2);
                Sampler { key, step, mode }.draw_partition(3)
            });
            assert_eq!(drawn[0], drawn[1]);
            counts[drawn[0]] += 1;
        }
        // Five standard deviations: 5·√(3000·⅓·⅔) = 129.
        for count in counts {
            assert!((871..=1129).contains(&count), "{counts:?}");
        }
    }

    #[test]
    fn each_controller_reads_the_draw_that_bears_its_name() {
        let sampler = Sampler {
            key: EpisodeKey::new(3, Stream::Training, 5),
            step: 7,
            mode: Mode::Sampled,
        };
        let row = [(1.0_f64 / 17.0).ln(); 17];
        let shape = PolicyShape {
            agents: 3,
            actions: 4,
        };
        let pair = Pair::among(3, AgentId::new(0), AgentId::new(2));
        let drawn = |draw| invert(&row, sampler.key.uniform(7, draw));
        assert_eq!(sampler.choose_partition(&row), drawn(Draw::Selector));
        assert_eq!(
            sampler.choose_action(AgentId::new(2), &row).index(),
            drawn(Draw::Agent(2))
        );
        let expected = shape
            .joint_action(drawn(Draw::Pair(1)))
            .map_or(PairChoice::Delegate, PairChoice::Joint);
        assert_eq!(sampler.choose_pair(pair, shape, &row), expected);
    }
}
