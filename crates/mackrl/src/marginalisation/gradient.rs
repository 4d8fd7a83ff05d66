//! The gradient of log p(u): a posterior probability for every choice that could have led to u.

use crate::{
    Real,
    policy::{Part, PolicyTable},
};

/// d log p(u) / d log π for every table entry that the joint action u touches; all other entries have none.
///
/// Every number is a posterior probability given u, in [0, 1]. If p(u) = 0 there is no gradient, and all are 0.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MarginalGradient<F> {
    /// One for each level of the declaration.
    pub levels: Vec<LevelGradient<F>>,
}

/// The part that belongs to one level.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LevelGradient<F> {
    /// D: divisions of a group.
    pub divisions: usize,
    /// For each group and division \[G, D\]: that the group was asked and divided so.
    pub division_gd: Vec<F>,
    /// For each group \[G\]: that it was asked and acted jointly. Belongs to the column of its members' actions.
    pub joint_g: Vec<F>,
    /// log p of its members' actions \[G\], where it has been computed.
    pub(super) log_p_g: Vec<Option<F>>,
}

impl<F: Real> MarginalGradient<F> {
    /// The posteriors of a group's divisions \[D\].
    #[must_use]
    pub fn divisions(&self, part: Part) -> &[F] {
        let level = &self.levels[part.level];
        &level.division_gd[part.group * level.divisions..(part.group + 1) * level.divisions]
    }

    /// The posterior that a group acted jointly.
    #[must_use]
    pub fn joint(&self, part: Part) -> F {
        self.levels[part.level].joint_g[part.group]
    }

    /// Forgets everything and takes the sizes of `table`; allocates only to grow.
    pub(super) fn reset(&mut self, table: &PolicyTable<'_, F>) {
        let levels = table.declaration().levels();
        self.levels
            .resize_with(levels.len(), LevelGradient::default);
        for (place, (own, level)) in self.levels.iter_mut().zip(levels).enumerate() {
            let groups = level.groups.len();
            own.divisions = if place == crate::policy::TEAM {
                table.in_force().len()
            } else {
                level.divisions
            };
            own.division_gd.clear();
            own.division_gd.resize(groups * own.divisions, F::ZERO);
            own.joint_g.clear();
            own.joint_g.resize(groups, F::ZERO);
            own.log_p_g.clear();
            own.log_p_g.resize(groups, None);
        }
    }
}
