//! Learning's side of the hierarchy: log p(u) of an experience, and the way back from it to the parameters.
//!
//! An objective is a function of log p(u) (see [`crate::objectives`]); it says how much it changes with each, and
//! [`Hierarchy::backward`] does the rest for every objective alike: the marginal turns ∂ loss / ∂ log p(u) into a posterior share
//! for each table entry, the softmax into gradients of logits, and the networks run backwards.

use std::{ops::Range, sync::Arc};

use mackrl_env::Action;

use super::{
    Hierarchy, Parts,
    activations::{Activations, BankActivations, Entry},
    controllers::{Controllers, fill_tables, rows_of_environment},
    tables::Tables,
};
use crate::{
    Error,
    experience::{Experience, Piece, Rows, StepRows},
    marginalisation::{MarginalGradient, log_likelihood_with_gradient},
    policy::{Parameters, Part, Recording},
};

impl Hierarchy {
    /// Room for the activations of an experience that no actor of this hierarchy holds any.
    #[must_use]
    pub fn activations(&self) -> Activations {
        Controllers::new(Arc::clone(&self.parts), 0, None).activations
    }

    /// The piece's experience and its activations under `parameters`: those that its actor kept, if they serve, else
    /// computed again.
    ///
    /// # Errors
    /// [`Error::Data`] if another kind of policy played it.
    pub fn evaluate<'a>(
        &self,
        parameters: &Parameters,
        piece: &'a mut Piece,
    ) -> Result<(&'a Experience, &'a mut Activations), Error> {
        self.present(parameters, piece, Self::recompute)
    }

    /// The piece's experience and its activations under `parameters`: those that its actor kept, if they serve, else what `recompute`
    /// makes of them.
    ///
    /// # Errors
    /// [`Error::Data`] if another kind of policy played it.
    pub(super) fn present<'a>(
        &self,
        parameters: &Parameters,
        piece: &'a mut Piece,
        recompute: impl FnOnce(&Self, &Parameters, &Experience, &mut Activations),
    ) -> Result<(&'a Experience, &'a mut Activations), Error> {
        let (experience, activations) = kept(piece)?;
        if !activations.serve(parameters.version()) {
            recompute(self, parameters, experience, activations);
        }
        Ok((experience, activations))
    }

    /// Computes all activations of an experience, and log p(u) with its gradient, from the inputs that it holds.
    ///
    /// # Panics
    /// If the experience is not one of this hierarchy's, recorded for learning.
    pub fn recompute(
        &self,
        parameters: &Parameters,
        experience: &Experience,
        activations: &mut Activations,
    ) {
        let parts = &*self.parts;
        let weights = parts.weights(parameters);
        let environments = experience.episodes.len();
        activations.begin(parameters.version(), Recording::ForLearning);
        activations.log_p_bt.resize_with(environments, Vec::new);
        activations
            .tables
            .resize_with(environments, || Tables::new(parts));
        let longest = experience
            .episodes
            .iter()
            .map(|episode| episode.steps())
            .max();
        let mut gradient = MarginalGradient::default();
        for t in 0..longest.unwrap_or(0) {
            let Activations {
                banks,
                tables,
                log_p_bt,
                ..
            } = activations;
            for (level, own) in banks.iter_mut().enumerate() {
                let (Some(own), Some(bank), Some(weights)) =
                    (own, &parts.banks[level], &weights[level])
                else {
                    continue;
                };
                let rows = (
                    &experience.banks[level],
                    &experience.banks[level].steps()[t],
                );
                let epsilon = parts.epsilon(level, experience.exploration);
                own.compute(&bank.network, weights, rows, epsilon);
                fill_tables(parts, level, own, rows, tables);
            }
            for (b, episode) in experience.episodes.iter().enumerate() {
                if t >= episode.steps() {
                    continue;
                }
                let action_n = episode.actions(t);
                tables[b].alive = episode.alive_t[t];
                tables[b].write_forced(parts, |agent| action_n[agent.index()]);
                let decision = tables[b].decision(parts, &experience.key_b[b], t);
                let log_p = log_likelihood_with_gradient(&decision.table, action_n, &mut gradient);
                log_p_bt[b].push(log_p);
                for (level, own) in banks.iter_mut().enumerate() {
                    if let Some(own) = own {
                        let rows = &experience.banks[level];
                        let step = &rows.steps()[t];
                        let own_rows = rows_of_environment(rows.instances_of(step), b);
                        add_entries(
                            parts,
                            (level, t, own_rows),
                            (rows, step),
                            action_n,
                            &gradient,
                            own,
                        );
                    }
                }
            }
        }
    }

    /// Adds `Σ_{b,t} d_log_p_bt ∇ log p(u_bt)` to `gradient`. The activations are used up.
    ///
    /// # Shapes
    /// `d_log_p_bt` \[B\]\[T\], each episode with its own T: ∂ loss / ∂ log p(u); `gradient` as the layout.
    ///
    /// # Panics
    /// If the activations are spent or belong to other parameters: [`Self::evaluate`] gives those that serve.
    pub fn backward(
        &self,
        parameters: &Parameters,
        experience: &Experience,
        activations: &mut Activations,
        d_log_p_bt: &[Vec<f32>],
        gradient: &mut [f32],
    ) {
        assert!(
            activations.serve(parameters.version()),
            "activations are those of these parameters, and unspent"
        );
        let weights = self.parts.weights(parameters);
        for (level, own) in activations.banks.iter_mut().enumerate() {
            let (Some(own), Some(bank), Some(weights)) =
                (own, &self.parts.banks[level], &weights[level])
            else {
                continue;
            };
            let rows = &experience.banks[level];
            own.write_logits_gradient(rows, d_log_p_bt);
            bank.network
                .backward(weights, rows.input_rf(), &mut own.trace, gradient);
        }
    }
}

/// The piece's experience, and what its actor kept of it.
fn kept(piece: &mut Piece) -> Result<(&Experience, &mut Activations), Error> {
    let Piece { experience, actor } = piece;
    let kept = actor
        .cache()
        .and_then(|cache| cache.downcast_mut::<Activations>());
    let activations = kept.ok_or_else(|| {
        Error::Data("an experience was left by another kind of policy".to_owned())
    })?;
    Ok((experience, activations))
}

impl BankActivations {
    /// Writes ∂ loss / ∂ logits of every row that was asked.
    fn write_logits_gradient(&mut self, rows: &Rows, d_log_p_bt: &[Vec<f32>]) {
        debug_assert!(
            self.entries
                .is_sorted_by_key(|entry| (entry.row, entry.column)),
            "entries come row by row"
        );
        let law = self.law();
        let columns = rows.columns();
        let entries = std::mem::take(&mut self.entries);
        let mut rest = entries.as_slice();
        let mut weighted = Vec::with_capacity(columns);
        for (t, step) in rows.steps().iter().enumerate() {
            // The trace is borrowed for a step at a time, the tables beside it.
            let Self {
                trace,
                log_p_rc,
                softmax_rc,
                ..
            } = self;
            let step_gradient = trace.logits_gradient_mut(t);
            for (row, row_gradient) in step
                .asked
                .clone()
                .zip(step_gradient.chunks_exact_mut(columns))
            {
                let own = rest.iter().take_while(|entry| entry.row == row).count();
                weighted.clear();
                weighted.extend(rest[..own].iter().map(|entry| {
                    (
                        entry.column,
                        entry.posterior * d_log_p_bt[entry.environment][entry.step],
                    )
                }));
                rest = &rest[own..];
                let place = row * columns..(row + 1) * columns;
                law.row_gradient(
                    &log_p_rc[place.clone()],
                    &softmax_rc[place],
                    &weighted,
                    row_gradient,
                );
            }
        }
        self.entries = entries;
    }
}

/// Hands the posterior weights of one environment's joint action to the rows whose choices they are weights of. `place` is
/// the level, the step and the environment's rows at that step.
pub(super) fn add_entries(
    parts: &Parts,
    (level, t, own_rows): (usize, usize, Range<usize>),
    (rows, step): (&Rows, &StepRows),
    action_n: &[Action],
    gradient: &MarginalGradient<f32>,
    own: &mut BankActivations,
) {
    let asked = rows.asked_of(step);
    let first = asked.partition_point(|&row| row < own_rows.start);
    let (instances, declared) = (rows.instances_of(step), &parts.declaration.levels()[level]);
    let places = (step.asked.start + first..).zip(&asked[first..]);
    for (row, &number) in places.take_while(|(_, row)| **row < own_rows.end) {
        let instance = instances[number];
        let part = Part {
            level,
            group: instance.group,
        };
        let divided = gradient.divisions(part).iter().copied().enumerate();
        let column = declared.column(part.group, parts.declaration.actions(), action_n);
        let joint = column.map(|column| (column, gradient.joint(part)));
        let touched = divided
            .chain(joint)
            .filter(|(_, posterior)| *posterior != 0.0);
        own.entries.extend(touched.map(|(column, posterior)| Entry {
            step: t,
            environment: instance.environment,
            row,
            column,
            posterior,
        }));
    }
}
