//! Algorithm 1: from the tables of one step to an action for every agent.
//!
//! Each controller's choice is a function of its own row and of a random number that is named by what it is for
//! ([`Draw`]), so an agent that runs only its own controllers makes the choices that the central run makes. The draws of
//! controllers that are not asked are skipped without any effect on the others. The walk is written once: the central run
//! follows all groups of a division, one agent alone only those that it belongs to.

use mackrl_env::{Action, AgentId, Draw, EpisodeKey};

use super::{
    Mode,
    declaration::{Part, Selection, TEAM},
    table::PolicyTable,
};
use crate::nn::{Element, elementary::exponentials};

/// The choices that led to a joint action, in the order of the walk: groups before their parts. Reports may read it;
/// controllers and learners never do.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Path {
    /// The groups that were asked, each with the column of its choice.
    pub choices: Vec<(Part, usize)>,
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

impl Path {
    /// What a group chose, if it was asked.
    #[must_use]
    pub fn choice(&self, part: Part) -> Option<usize> {
        let mut choices = self.choices.iter();
        choices
            .find(|(asked, _)| *asked == part)
            .map(|&(_, column)| column)
    }

    /// The number of the team's division among those in force.
    ///
    /// # Panics
    /// If no walk was recorded.
    #[must_use]
    pub fn division(&self) -> usize {
        self.choice(Part {
            level: TEAM,
            group: 0,
        })
        .expect("a walk begins with the team")
    }
}

impl Sampler {
    /// Walks down the hierarchy: a group divides or acts jointly, and the groups that it divides into choose in turn, until
    /// every agent has an action. `follow` restricts the walk to the groups of one agent. Allocates nothing once `path` has
    /// held as many choices.
    ///
    /// # Shapes
    /// `action_n` \[N\]; actions of agents that the walk does not come to are not touched.
    ///
    /// # Panics
    /// If `action_n` has not N elements, or a row that is asked has no available entry.
    pub fn walk<E: Element>(
        &self,
        table: &PolicyTable<'_, E>,
        follow: Option<AgentId>,
        action_n: &mut [Action],
        path: &mut Path,
    ) {
        assert_eq!(
            action_n.len(),
            table.declaration().agents(),
            "one action per agent"
        );
        path.choices.clear();
        self.descend(
            table,
            Part {
                level: TEAM,
                group: 0,
            },
            follow,
            action_n,
            path,
        );
    }

    fn descend<E: Element>(
        &self,
        table: &PolicyTable<'_, E>,
        part: Part,
        follow: Option<AgentId>,
        action_n: &mut [Action],
        path: &mut Path,
    ) {
        let declaration = table.declaration();
        let column = self.choose_in(table, part);
        path.choices.push((part, column));
        let divisions = table.divisions(part);
        let Some(division) = divisions.get(column) else {
            let mut joint = column - divisions.len();
            for member in declaration.members(part).iter().rev() {
                action_n[member.index()] = Action::new(joint % declaration.actions());
                joint /= declaration.actions();
            }
            return;
        };
        for &inner in &division.parts {
            if follow.is_none_or(|agent| declaration.members(inner).contains(&agent)) {
                self.descend(table, inner, follow, action_n, path);
            }
        }
    }

    /// The choice of one group.
    fn choose_in<E: Element>(&self, table: &PolicyTable<'_, E>, part: Part) -> usize {
        let level = &table.declaration().levels()[part.level];
        let draw = level.draw(part.level, part.group);
        match level.selection {
            Selection::Learned if level.is_learned() => self.choose(table.row(part), draw),
            _ => self.draw_evenly(table.divisions(part).len(), draw),
        }
    }

    /// One of `count` choices, each as likely as any other; drawn from the shared seed in greedy mode too.
    fn draw_evenly(&self, count: usize, draw: Draw) -> usize {
        let uniform = self.key.uniform(self.step, draw);
        let reached = |choice: &usize| uniform * (count as f64) < (choice + 1) as f64;
        (0..count).find(reached).unwrap_or(count - 1)
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
fn most_probable<E: Element>(log_p: &[E]) -> usize {
    let mut best = None;
    for (index, &candidate) in log_p.iter().enumerate() {
        if candidate > best.map_or(E::NEG_INFINITY, |(_, log_p)| log_p) {
            best = Some((index, candidate));
        }
    }
    best.expect("every row has an available entry").0
}

#[cfg(test)]
mod tests {
    use mackrl_env::Stream;

    use super::*;
    use crate::{
        partition::PartitionSchedule,
        policy::{Declaration, Delegation},
    };

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
                Sampler { key, step, mode }.draw_evenly(3, Draw::Selector)
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
        let declaration = Declaration::pairwise(
            [3, 4],
            PartitionSchedule::All,
            Selection::Learned,
            Delegation::Learned,
            1,
        )
        .unwrap();
        let even = |columns: usize, rows: usize| vec![-(columns as f64).ln(); columns * rows];
        let (team, pairs, agents) = (even(3, 1), even(17, 3), even(4, 3));
        let in_force = &declaration.levels()[TEAM].divisions_gd[0];
        let table = PolicyTable::new(&declaration, in_force, &[&team, &pairs, &agents]).unwrap();
        let drawn = |row: &[f64], draw| invert(row, sampler.key.uniform(7, draw));
        let mut path = Path::default();
        let mut action_n = [Action::default(); 3];
        sampler.walk(&table, None, &mut action_n, &mut path);
        let division = drawn(&team, Draw::Selector);
        assert_eq!(path.division(), division);
        for &(part, column) in &path.choices[1..] {
            let (row, draw) = match part.level {
                1 => (&pairs[..17], Draw::Pair(part.group)),
                _ => (&agents[..4], Draw::Agent(part.group)),
            };
            assert_eq!(column, drawn(row, draw), "{part:?}");
        }
        for agent in (0..3).map(AgentId::new) {
            let (mut own, mut own_path) = ([Action::default(); 3], Path::default());
            sampler.walk(&table, Some(agent), &mut own, &mut own_path);
            assert_eq!(
                own[agent.index()],
                action_n[agent.index()],
                "agent {agent} alone"
            );
        }
    }
}
