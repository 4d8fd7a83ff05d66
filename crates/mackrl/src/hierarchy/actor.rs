//! The whole hierarchy at work in the environments of one shard.

use std::{any::Any, sync::Arc};

use mackrl_env::{Action, AgentId, EntityId};

use super::{
    Parts,
    controllers::{Controllers, StepContext, rows_of_environment},
    evaluation::add_entries,
    perspective::{Perspective, forced_action},
    statistics::HierarchyStatistics,
    thought,
};
use crate::{
    Error, Phase, Stopwatch,
    experience::Experience,
    marginalisation::{MarginalGradient, log_likelihood_with_gradient},
    policy::{
        Actor, ControllerInput, ControllerOutput, Parameters, PolicyTable, Recording, Sampler,
        Situation, Tally, Thought,
    },
};

/// A team that acts as its hierarchy declares.
pub(super) struct TeamActor {
    controllers: Controllers,
    recording: Recording,
    gradient: MarginalGradient<f32>,
    statistics: HierarchyStatistics,
    stopwatch: Stopwatch,
}

impl TeamActor {
    pub(super) fn new(parts: Arc<Parts>, environments: usize) -> Self {
        Self {
            statistics: HierarchyStatistics::new(&parts),
            controllers: Controllers::new(parts, environments, None),
            recording: Recording::Off,
            gradient: MarginalGradient::default(),
            stopwatch: Stopwatch::default(),
        }
    }

    /// Notes who lives in environment `b`, whose choice is forced, and which groups can be formed.
    fn observe(&mut self, perspective: Perspective<'_>, situation: Situation<'_>, b: usize) {
        let Controllers { parts, tables, .. } = &mut self.controllers;
        let agents = (0..parts.declaration.agents()).map(AgentId::new);
        let living = agents.filter(|&agent| perspective.acts(b, agent));
        tables[b].alive = living.map(EntityId::from).collect();
        tables[b].write_forced(parts, |agent| forced_action(perspective.view(b, agent)));
        tables[b].note_possible(parts, &situation.keys[b], situation.step);
    }

    /// Refuses a step at which a group of living members that can only act jointly does not commonly know who they are.
    fn check_sight(&self, situation: Situation<'_>) -> Result<(), Error> {
        let Controllers { parts, tables, .. } = &self.controllers;
        let levels = parts.declaration.levels().iter().enumerate();
        for (place, _) in levels.filter(|(_, level)| level.survives) {
            for &b in situation.playing {
                let table = &tables[b];
                let known = table.known_g[place][0];
                if !table.alive.is_subset_of(known) {
                    return Err(Error::Config(format!(
                        "at step {} of an episode of {} the {} living agents do not all see each other, expected a world in which they always do: \
                         a controller of the whole team reads what the team commonly knows",
                        situation.step,
                        parts.spec.name,
                        table.alive.len(),
                    )));
                }
            }
        }
        Ok(())
    }

    /// Walks down the hierarchy in environment `b` and, if recording, remembers how log p(u) depends on each choice.
    fn choose(
        &mut self,
        b: usize,
        situation: Situation<'_>,
        experience: &mut Experience,
        action_n: &mut [Action],
    ) {
        let step = situation.step;
        let Controllers {
            parts,
            tables,
            activations,
            ..
        } = &mut self.controllers;
        let decision = tables[b].decision(parts, &situation.keys[b], step);
        let sampler = Sampler {
            key: situation.keys[b],
            step,
            mode: situation.behaviour.mode,
        };
        sampler.walk(&decision.table, None, action_n, decision.path);
        self.statistics.observe(&decision);
        if self.recording == Recording::ForLearning {
            self.stopwatch.lap(Phase::Act);
            let log_p = log_likelihood_with_gradient(&decision.table, action_n, &mut self.gradient);
            activations.log_p_bt[b].push(log_p);
            let episode = &mut experience.episodes[b];
            episode.log_p_t.push(log_p);
            episode.alive_t.push(decision.alive);
            for (level, rows) in experience.banks.iter().enumerate() {
                if let Some(own) = &mut activations.banks[level] {
                    let latest = rows.latest();
                    let own_rows = rows_of_environment(rows.instances_of(latest), b);
                    let place = (level, step, own_rows);
                    add_entries(parts, place, (rows, latest), action_n, &self.gradient, own);
                }
            }
            self.stopwatch.lap(Phase::Marginal);
        }
        for (last, &action) in tables[b].last_action_n.iter_mut().zip(&*action_n) {
            *last = Some(action);
        }
    }
}

impl Actor for TeamActor {
    fn begin(&mut self, recording: Recording, experience: &mut Experience) {
        self.recording = recording;
        self.statistics.clear();
        self.controllers.begin(recording, &mut experience.banks);
    }

    fn act(
        &mut self,
        parameters: &Parameters,
        situation: Situation<'_>,
        experience: &mut Experience,
        actions_bn: &mut [Action],
    ) -> Result<(), Error> {
        let perspective = Perspective::Everybody(situation.observations);
        for &b in situation.playing {
            self.observe(perspective, situation, b);
        }
        self.stopwatch.lap(Phase::Act);
        let moment = StepContext {
            step: situation.step,
            playing: situation.playing,
            exploration: situation.behaviour.exploration,
        };
        self.controllers.advance(
            parameters,
            perspective,
            moment,
            &mut experience.banks,
            &mut self.stopwatch,
        )?;
        self.check_sight(situation)?;
        let agents = self.controllers.parts.declaration.agents();
        for &b in situation.playing {
            let action_n = &mut actions_bn[b * agents..(b + 1) * agents];
            self.choose(b, situation, experience, action_n);
        }
        self.stopwatch.lap(Phase::Act);
        Ok(())
    }

    fn report(&self, tally: &mut Tally) {
        self.statistics.report(tally);
    }

    fn stopwatch(&mut self) -> &mut Stopwatch {
        &mut self.stopwatch
    }

    fn cache(&mut self) -> Option<&mut dyn Any> {
        Some(&mut self.controllers.activations)
    }

    fn controller_inputs(&self, experience: &Experience, b: usize) -> Vec<ControllerInput> {
        self.controllers.inputs(experience, b)
    }

    fn controller_outputs(&self, experience: &Experience, b: usize) -> Vec<ControllerOutput> {
        self.controllers.outputs(experience, b)
    }

    fn table(&mut self, b: usize, situation: Situation<'_>) -> Option<PolicyTable<'_, f32>> {
        let Controllers { parts, tables, .. } = &mut self.controllers;
        let decision = tables[b].decision(parts, &situation.keys[b], situation.step);
        Some(decision.table)
    }

    fn thought(&mut self, b: usize, situation: Situation<'_>, action_n: &[Action]) -> Thought {
        let Controllers { parts, tables, .. } = &mut self.controllers;
        let decision = tables[b].decision(parts, &situation.keys[b], situation.step);
        thought::describe(&decision, action_n, &mut self.gradient)
    }
}
