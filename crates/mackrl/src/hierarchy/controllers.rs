//! The levels of the hierarchy, advanced by one step.
//!
//! At every step the recurrence of each group advances, chosen or not: which division a later step will choose is not known
//! now. Only a level whose controllers [remember while formed](Memory::WhileFormed) has rows of the formed groups alone. Rows of groups with a dead member are dropped where their one choice is forced. Which groups *can* be chosen at this
//! step is known: where divisions take turns, only the groups of the one in force are asked for their choice, which is
//! exact, since what the others would have said is never read. Of 27 agents that is 13 pairs of 351.

use std::{ops::Range, sync::Arc};

use mackrl_env::AgentId;

use super::{
    Parts,
    activations::{Activations, BankActivations},
    perspective::Perspective,
    tables::Tables,
};
use crate::{
    NotFinite, Phase, Stopwatch,
    experience::{Experience, Instance, Rows, StepRows},
    nn::first_not_finite,
    policy::{
        ControllerId, ControllerInput, ControllerOutput, Level, Memory, Parameters, Part, Reads,
        Recording, TEAM,
    },
};

/// The controllers of a few environments, or of one agent.
pub(crate) struct Controllers {
    pub(crate) parts: Arc<Parts>,
    pub(crate) activations: Activations,
    pub(crate) tables: Vec<Tables>,
    /// Of each level, the groups that are computed, ascending.
    groups: Vec<Vec<usize>>,
    /// Of each level, members' available actions \[members, A\].
    available_ga: Vec<Vec<bool>>,
    recording: Recording,
    begun: bool,
}

/// When and where a step is taken.
#[derive(Clone, Copy)]
pub(crate) struct StepContext<'a> {
    pub(crate) step: usize,
    /// The environments that are still playing, ascending.
    pub(crate) playing: &'a [usize],
    pub(crate) exploration: f32,
}

impl Controllers {
    /// Working memory for `environments` environments; of all groups, or of those that one agent belongs to.
    pub(crate) fn new(parts: Arc<Parts>, environments: usize, only: Option<AgentId>) -> Self {
        let levels = parts.declaration.levels();
        let activations = parts.banks.iter().enumerate().map(|(level, bank)| {
            let selective = only.is_none() && is_selective(&parts, level);
            bank.as_ref()
                .map(|bank| BankActivations::new(&bank.network, selective))
        });
        let activations = Activations {
            banks: activations.collect(),
            log_p_bt: vec![Vec::new(); environments],
            ..Activations::default()
        };
        let groups = levels.iter().map(|level| {
            let active = level.active.iter().copied();
            let own =
                |group: &usize| only.is_none_or(|agent| level.groups[*group].contains(&agent));
            active.filter(own).collect()
        });
        let actions = parts.declaration.actions();
        Self {
            activations,
            tables: (0..environments).map(|_| Tables::new(&parts)).collect(),
            groups: groups.collect(),
            available_ga: levels
                .iter()
                .map(|level| vec![false; level.size() * actions])
                .collect(),
            recording: Recording::Off,
            begun: false,
            parts,
        }
    }

    /// Forgets all steps; recurrences start at zero.
    pub(crate) fn begin(&mut self, recording: Recording, banks: &mut Vec<Rows>) {
        self.recording = recording;
        self.begun = false;
        self.tables.iter_mut().for_each(Tables::begin);
        if banks.is_empty() {
            let levels = self
                .parts
                .declaration
                .levels()
                .iter()
                .zip(&self.parts.banks);
            banks.extend(
                levels
                    .zip(&self.activations.banks)
                    .map(|((level, bank), own)| match (bank, own) {
                        (Some(bank), Some(own)) => {
                            bank.rows(level.groups.len(), own.is_selective())
                        }
                        _ => Rows::new([level.groups.len(), 0, 0], false),
                    }),
            );
        }
        banks.iter_mut().for_each(|rows| rows.begin(recording));
    }

    /// Advances all levels by a step and fills the tables of the environments that play.
    pub(crate) fn advance(
        &mut self,
        parameters: &Parameters,
        perspective: Perspective<'_>,
        moment: StepContext<'_>,
        banks: &mut [Rows],
        stopwatch: &mut Stopwatch,
    ) -> Result<(), NotFinite> {
        if !self.begun {
            self.begun = true;
            self.activations.begin(parameters.version(), self.recording);
        }
        let parts = Arc::clone(&self.parts);
        let weights = parts.weights(parameters);
        for level in 0..banks.len() {
            if let Some(weights) = &weights[level] {
                self.write_rows(level, perspective, moment.playing, &mut banks[level]);
                let reads = parts.declaration.levels()[level].reads;
                stopwatch.lap(if reads == Reads::OwnObservation {
                    Phase::Act
                } else {
                    Phase::CommonKnowledge
                });
                let bank = parts.banks[level]
                    .as_ref()
                    .expect("weights belong to a bank");
                let own = self.activations.banks[level].as_mut().expect("as the bank");
                let rows = &banks[level];
                let epsilon = parts.epsilon(level, moment.exploration);
                own.compute(&bank.network, weights, (rows, rows.latest()), epsilon);
                check_logits(&parts, level, own, rows, moment.step)?;
                fill_tables(&parts, level, own, (rows, rows.latest()), &mut self.tables);
                stopwatch.lap(Phase::Act);
            }
        }
        Ok(())
    }

    /// Writes what the groups of a level read at this step.
    fn write_rows(
        &mut self,
        place: usize,
        perspective: Perspective<'_>,
        playing: &[usize],
        rows: &mut Rows,
    ) {
        let Self {
            parts,
            tables,
            groups,
            available_ga,
            ..
        } = self;
        let level = &parts.declaration.levels()[place];
        let bank = parts.banks[place]
            .as_ref()
            .expect("the level has a network");
        let groups = &groups[place];
        let instances = playing.iter().flat_map(|&environment| {
            let table = &tables[environment];
            let forms = move |group: usize| {
                level.memory == Memory::Episode || table.possible_g[place][group]
            };
            let chosen = groups
                .iter()
                .filter(move |group| table.has_choice(level, **group) && forms(**group));
            chosen.map(move |&group| Instance { environment, group })
        });
        rows.begin_step(instances, |instance| {
            tables[instance.environment].possible_g[place][instance.group]
        });
        for row in 0..rows.latest().rows.len() {
            let Instance { environment, group } = rows.instances_of(rows.latest())[row];
            let table = &mut tables[environment];
            if level.reads == Reads::OwnObservation {
                let agent = level.groups[group][0];
                let view = perspective.view(environment, agent);
                bank.write_agent(view, table.last_action_n[agent.index()], rows.row_mut(row));
            } else {
                let members = &level.groups[group];
                let known = if level.survives {
                    perspective.common_knowledge_of_living(environment, members)
                } else {
                    perspective.common_knowledge(environment, members)
                };
                table.known_g[place][group] = known.set();
                bank.write_group(
                    level,
                    group,
                    known,
                    &mut available_ga[place],
                    rows.row_mut(row),
                );
            }
        }
    }

    /// What the controllers of environment `b` read at the latest step.
    pub(crate) fn inputs(&self, experience: &Experience, b: usize) -> Vec<ControllerInput> {
        let levels = self.parts.declaration.levels().iter().enumerate();
        let learned = levels.filter(|(place, _)| self.parts.banks[*place].is_some());
        learned
            .flat_map(|(place, level)| {
                let rows = &experience.banks[place];
                rows_of_environment(rows.instances_of(rows.latest()), b).map(move |row| {
                    let instance = rows.instances_of(rows.latest())[row];
                    ControllerInput {
                        controller: controller_id(level, instance.group),
                        values: rows.input(row).to_vec(),
                    }
                })
            })
            .collect()
    }

    /// What the controllers of environment `b` that were asked at the latest step gave.
    pub(crate) fn outputs(&self, experience: &Experience, b: usize) -> Vec<ControllerOutput> {
        let levels = self.parts.declaration.levels().iter().enumerate();
        let mut outputs = Vec::new();
        for (place, level) in levels {
            let Some(own) = &self.activations.banks[place] else {
                continue;
            };
            let rows = &experience.banks[place];
            let step = rows.latest();
            for (asked, &row) in rows.asked_of(step).iter().enumerate() {
                let instance = rows.instances_of(step)[row];
                if instance.environment == b {
                    outputs.push(ControllerOutput {
                        controller: controller_id(level, instance.group),
                        log_p: own.log_p(step.asked.start + asked).to_vec(),
                    });
                }
            }
        }
        outputs
    }
}

/// Names the controller of a group.
fn controller_id(level: &Level, group: usize) -> ControllerId {
    ControllerId {
        name: level.name.into(),
        agents: level.groups[group].clone(),
    }
}

/// Whether only some groups of a level are asked at a step: where divisions take turns, all but the team and single agents,
/// and those that only have a row while they are formed.
fn is_selective(parts: &Parts, level: usize) -> bool {
    parts.declaration.levels()[level].memory == Memory::Episode
        && !parts.declaration.is_fixed()
        && level != TEAM
        && level != parts.declaration.alone()
}

/// The rows of one environment among a step's, which are ascending.
pub(super) fn rows_of_environment(instances: &[Instance], b: usize) -> Range<usize> {
    let first = instances.partition_point(|instance| instance.environment < b);
    let end = instances.partition_point(|instance| instance.environment <= b);
    first..end
}

/// Copies the log-probabilities of a step's rows into the tables of their environments.
pub(super) fn fill_tables(
    parts: &Parts,
    level: usize,
    own: &BankActivations,
    (rows, step): (&Rows, &StepRows),
    tables: &mut [Tables],
) {
    let instances = rows.instances_of(step);
    for (place, &row) in rows.asked_of(step).iter().enumerate() {
        let Instance { environment, group } = instances[row];
        let to = tables[environment].row_mut(parts, Part { level, group });
        to.copy_from_slice(own.log_p(step.asked.start + place));
    }
}

/// Refuses logits of the latest step that are not finite.
fn check_logits(
    parts: &Parts,
    level: usize,
    own: &BankActivations,
    rows: &Rows,
    t: usize,
) -> Result<(), NotFinite> {
    let logits = own.trace.last_logits();
    let Some(index) = first_not_finite(logits) else {
        return Ok(());
    };
    let (columns, step) = (rows.columns(), rows.latest());
    let row = rows.asked_of(step)[index / columns];
    let Instance { environment, group } = rows.instances_of(step)[row];
    let level = &parts.declaration.levels()[level];
    let mut place = vec![("episode", environment), ("step", t)];
    if level.size() < parts.declaration.agents() {
        place.extend(
            level.groups[group]
                .iter()
                .map(|agent| ("agent", agent.index())),
        );
    }
    place.push(("column", index % columns));
    Err(NotFinite::new(
        format!("logits of {}", level.name),
        &place,
        logits[index],
    ))
}
