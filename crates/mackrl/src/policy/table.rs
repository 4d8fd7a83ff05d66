//! One step of the hierarchy as log-probabilities: the one table that both the sampler and the marginal likelihood read.
//!
//! Had each of them its own way from network outputs to probabilities, the two could drift apart, and learning would
//! follow the gradient of a policy that is never executed. The table is complete: masked (−∞) and with exploration mixed in.

use super::declaration::{Declaration, Division, LEVELS_MAX, Part, TEAM};
use crate::{Error, Real};

/// The policy of one environment at one step, borrowed from where it was computed.
///
/// Rows of groups that no division in force leads to are never read and may hold anything.
#[derive(Debug, Clone, Copy)]
pub struct PolicyTable<'a, F> {
    declaration: &'a Declaration,
    in_force: &'a [Division],
    log_p_gc: [&'a [F]; LEVELS_MAX],
}

impl<'a, F: Real> PolicyTable<'a, F> {
    /// Puts a table together from the log-probabilities of the levels.
    ///
    /// # Shapes
    /// `in_force` \[P\]: the divisions of the team; `levels`: of each level \[G, C\], of the team \[1, P\].
    ///
    /// # Errors
    /// [`Error::Data`] names the level whose size is wrong.
    pub fn new(
        declaration: &'a Declaration,
        in_force: &'a [Division],
        levels: &[&'a [F]],
    ) -> Result<Self, Error> {
        if in_force.is_empty() {
            return Err(Error::Data(
                "the team cannot divide, expected at least 1 way".into(),
            ));
        }
        if levels.len() != declaration.levels().len() {
            return Err(Error::Data(format!(
                "a table has {} levels, expected {}",
                levels.len(),
                declaration.levels().len()
            )));
        }
        let mut log_p_gc: [&[F]; LEVELS_MAX] = [&[]; LEVELS_MAX];
        for (place, (level, &rows)) in declaration.levels().iter().zip(levels).enumerate() {
            let columns = if place == TEAM {
                in_force.len()
            } else {
                level.columns(declaration.actions())
            };
            let expected = level.groups.len() * columns;
            if rows.len() != expected {
                return Err(Error::Data(format!(
                    "the table of {} has {} entries, expected {expected} for {} groups",
                    level.name,
                    rows.len(),
                    level.groups.len()
                )));
            }
            log_p_gc[place] = rows;
        }
        Ok(Self {
            declaration,
            in_force,
            log_p_gc,
        })
    }

    /// Whose policy it is.
    #[must_use]
    pub const fn declaration(&self) -> &'a Declaration {
        self.declaration
    }

    /// The divisions of the team in force \[P\].
    #[must_use]
    pub const fn in_force(&self) -> &'a [Division] {
        self.in_force
    }

    /// The divisions of a group \[D\]: the first columns of its row.
    #[must_use]
    pub fn divisions(&self, part: Part) -> &'a [Division] {
        self.declaration.divisions(part, self.in_force)
    }

    /// The log-probabilities of a group's choices \[C\]: its divisions, then its joint actions.
    #[must_use]
    pub fn row(&self, part: Part) -> &'a [F] {
        let rows = self.log_p_gc[part.level];
        let columns = rows.len() / self.declaration.levels()[part.level].groups.len();
        &rows[part.group * columns..(part.group + 1) * columns]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_of_the_wrong_size_is_refused_by_the_name_of_its_level() {
        let declaration = Declaration::pairwise(
            [3, 2],
            crate::partition::PartitionSchedule::All,
            Default::default(),
            Default::default(),
            1,
        )
        .expect("three agents are few");
        let in_force = &declaration.levels()[TEAM].divisions_gd[0];
        let (selector, pair, agent) = (vec![0.0; 3], vec![0.0; 15], vec![0.0; 6]);
        let check = |in_force: &[Division], levels: &[&[f64]]| {
            PolicyTable::new(&declaration, in_force, levels)
                .map(|_| ())
                .map_err(|error| error.to_string())
        };
        assert_eq!(check(in_force, &[&selector, &pair, &agent]), Ok(()));
        let short = check(in_force, &[&selector, &pair[1..], &agent]).expect_err("too short");
        assert!(
            short.starts_with("the table of pair_controller has 14 entries, expected 15"),
            "{short}"
        );
        assert!(
            check(in_force, &[&selector[1..], &pair, &agent]).is_err(),
            "selector"
        );
        assert!(
            check(in_force, &[&selector, &pair, &agent[1..]]).is_err(),
            "agent"
        );
        assert!(
            check(in_force, &[&selector, &pair]).is_err(),
            "a level is missing"
        );
        assert!(check(&[], &[&[], &pair, &agent]).is_err(), "no division");
    }
}
