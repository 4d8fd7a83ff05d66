//! One environment's table at one step, and what it takes to fill it.

use mackrl_env::{Action, AgentId, EntitySet, EpisodeKey};

use super::Parts;
use crate::{
    Real,
    policy::{DivisionBuffer, LEVELS_MAX, Level, Part, Path, PolicyTable, TEAM},
};

/// The rows of one environment.
#[derive(Debug)]
pub(crate) struct Tables {
    /// Of each level \[G, C\].
    log_p_gc: Vec<Vec<f32>>,
    /// Agents that act.
    pub(crate) alive: EntitySet,
    /// Of each level, what each group commonly knows \[G\].
    pub(crate) known_g: Vec<Vec<EntitySet>>,
    /// Of each level, whether each group can be formed at this step \[G\].
    pub(crate) possible_g: Vec<Vec<bool>>,
    pub(crate) last_action_n: Vec<Option<Action>>,
    buffer: DivisionBuffer,
    path: Path,
}

/// One environment's table at one step, and what was made of it.
#[derive(Debug)]
pub(crate) struct Decision<'a> {
    pub(crate) table: PolicyTable<'a, f32>,
    pub(crate) path: &'a mut Path,
    /// Of each level, what each group commonly knows \[G\].
    pub(crate) known_g: &'a [Vec<EntitySet>],
    /// Of each level, whether each group can be formed \[G\].
    pub(crate) possible_g: &'a [Vec<bool>],
    pub(crate) alive: EntitySet,
}

impl Tables {
    pub(crate) fn new(parts: &Parts) -> Self {
        let levels = parts.declaration.levels();
        let (agents, actions) = (parts.declaration.agents(), parts.declaration.actions());
        let per_group = |level: &Level| vec![EntitySet::EMPTY; level.groups.len()];
        let mut log_p_gc: Vec<Vec<f32>> = levels
            .iter()
            .map(|level| vec![0.0; level.groups.len() * level.columns(actions)])
            .collect();
        // A controller replaces these at every step.
        let divisions = levels[TEAM].divisions;
        log_p_gc[TEAM].fill(0.0 - Real::ln(divisions as f32));
        Self {
            log_p_gc,
            alive: EntitySet::first(agents),
            known_g: levels.iter().map(per_group).collect(),
            possible_g: levels
                .iter()
                .map(|level| vec![true; level.groups.len()])
                .collect(),
            last_action_n: vec![None; agents],
            buffer: DivisionBuffer::default(),
            path: Path::default(),
        }
    }

    /// Begins an episode.
    pub(crate) fn begin(&mut self) {
        self.last_action_n.fill(None);
    }

    /// Whether a group has a choice: its members live, or it could divide in several ways without them.
    pub(crate) fn has_choice(&self, level: &Level, group: usize) -> bool {
        !level.is_forced_by_death() || self.lives(&level.groups[group])
    }

    pub(crate) fn lives(&self, members: &[AgentId]) -> bool {
        members
            .iter()
            .copied()
            .all(|member| self.alive.contains(member))
    }

    /// Writes the rows of groups whose choice is forced by the death of a member; `forced` is what a dead agent does.
    pub(crate) fn write_forced(
        &mut self,
        parts: &Parts,
        mut forced: impl FnMut(AgentId) -> Action,
    ) {
        if self.alive == EntitySet::first(parts.declaration.agents()) {
            return;
        }
        for (place, level) in parts.declaration.levels().iter().enumerate() {
            for &group in &level.active {
                if self.has_choice(level, group) {
                    continue;
                }
                let only = if level.divisions == 1 {
                    0
                } else {
                    forced(level.groups[group][0]).index()
                };
                let row = self.row_mut(
                    parts,
                    Part {
                        level: place,
                        group,
                    },
                );
                row.fill(f32::NEG_INFINITY);
                row[only] = 0.0;
            }
        }
    }

    /// Notes which groups can be formed at `step` of the episode called `key`.
    pub(crate) fn note_possible(&mut self, parts: &Parts, key: &EpisodeKey, step: usize) {
        if parts.declaration.is_fixed() {
            return;
        }
        self.possible_g
            .iter_mut()
            .for_each(|possible| possible.fill(false));
        self.possible_g[TEAM][0] = true;
        let in_force = parts.declaration.in_force(key, step, &mut self.buffer);
        for part in in_force.iter().flat_map(|division| &division.parts) {
            self.possible_g[part.level][part.group] = true;
            // Those that they divide into are asked when they do.
            for &inner in parts
                .declaration
                .divisions(*part, in_force)
                .iter()
                .flat_map(|own| &own.parts)
            {
                self.possible_g[inner.level][inner.group] = true;
            }
        }
    }

    /// The row of a group, to be written \[C\].
    pub(crate) fn row_mut(&mut self, parts: &Parts, part: Part) -> &mut [f32] {
        let columns = parts.declaration.levels()[part.level].columns(parts.declaration.actions());
        &mut self.log_p_gc[part.level][part.group * columns..(part.group + 1) * columns]
    }

    /// The table of the latest step, with what belongs to it.
    pub(crate) fn decision<'a>(
        &'a mut self,
        parts: &'a Parts,
        key: &EpisodeKey,
        step: usize,
    ) -> Decision<'a> {
        let mut levels: [&[f32]; LEVELS_MAX] = [&[]; LEVELS_MAX];
        for (level, rows) in levels.iter_mut().zip(&self.log_p_gc) {
            *level = rows;
        }
        let in_force = parts.declaration.in_force(key, step, &mut self.buffer);
        let table = PolicyTable::new(&parts.declaration, in_force, &levels[..self.log_p_gc.len()]);
        Decision {
            table: table.expect("the buffers have the declared sizes"),
            path: &mut self.path,
            known_g: &self.known_g,
            possible_g: &self.possible_g,
            alive: self.alive,
        }
    }
}

impl Decision<'_> {
    /// Whether all members of a group act.
    pub(crate) fn lives(&self, part: Part) -> bool {
        let members = self.table.declaration().members(part).iter();
        members.copied().all(|member| self.alive.contains(member))
    }

    /// What a group commonly knows.
    pub(crate) fn known(&self, part: Part) -> EntitySet {
        self.known_g[part.level][part.group]
    }
}
