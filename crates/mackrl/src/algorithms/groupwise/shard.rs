//! A piece's share of an update: the advantages of its groups, and the gradient of what they did.

use super::{Advantage, reading::Choices};
use crate::{
    Error, NotFinite,
    experience::Piece,
    hierarchy::{FactorTerm, FactorWorkspace, Hierarchy},
    nn::first_not_finite,
    objectives::policy_gradient,
    policy::Parameters,
};

/// A piece's share of an update.
#[derive(Debug, Default)]
pub(super) struct Shard {
    pub(super) choices: Choices,
    log_q_i: Vec<f32>,
    pub(super) advantage_i: Vec<f32>,
    workspace: FactorWorkspace,
    pub(super) gradient: Vec<f32>,
    pub(super) loss: f64,
}

/// What all shards read.
pub(super) struct Shared<'a> {
    pub(super) hierarchy: &'a Hierarchy,
    pub(super) parameters: &'a Parameters,
    pub(super) members: Values<'a>,
    pub(super) pairs: Values<'a>,
    /// Advantages of members' rows, where they do not depend on the policy \[steps · N\].
    pub(super) advantage_r: &'a [f32],
    pub(super) advantage: Advantage,
    /// What each choice counts for.
    pub(super) weight: f32,
}

/// What a critic gave.
#[derive(Default)]
pub(super) struct Values<'a> {
    /// \[R, C\]
    pub(super) value_rc: &'a [f32],
    /// C.
    pub(super) outputs: usize,
    /// The column of what was done \[R\].
    pub(super) column_r: &'a [usize],
}

impl Values<'_> {
    fn row(&self, row: usize) -> &[f32] {
        &self.value_rc[row * self.outputs..(row + 1) * self.outputs]
    }
}

impl Shard {
    /// Writes the piece's gradient and its loss.
    pub(super) fn differentiate(
        &mut self,
        shared: &Shared<'_>,
        piece: &mut Piece,
    ) -> Result<(), Error> {
        let &Shared {
            hierarchy,
            parameters,
            weight,
            ..
        } = shared;
        let (experience, activations) = hierarchy.networks(parameters, piece)?;
        let Choices { factors, row_i, .. } = &self.choices;
        hierarchy.log_q(activations, factors, &mut self.log_q_i);
        let expected = &mut self.advantage_i;
        match shared.advantage {
            Advantage::Temporal => {
                expected.clear();
                expected.extend(row_i.iter().map(|&row| shared.advantage_r[row]));
            }
            Advantage::Counterfactual => {
                let values = |place: usize| match factors[place].second {
                    Some(_) => (&shared.pairs, row_i[place]),
                    None => (&shared.members, row_i[place]),
                };
                let of_place = |place: usize| {
                    let (critic, row) = values(place);
                    critic.row(row)
                };
                hierarchy.expectations(activations, factors, of_place, expected);
                for (place, expected) in expected.iter_mut().enumerate() {
                    let (critic, row) = values(place);
                    *expected = critic.row(row)[critic.column_r[row]] - *expected;
                }
            }
        }
        if let Some(index) = first_not_finite(&self.advantage_i) {
            let place = [("choice", index)];
            return Err(NotFinite::new("advantage", &place, self.advantage_i[index]).into());
        }
        let weights = vec![weight; factors.len()];
        let mut d_log_q = Vec::new();
        self.loss = policy_gradient(
            std::slice::from_ref(&self.log_q_i),
            std::slice::from_ref(&self.advantage_i),
            &weights,
            &mut d_log_q,
        );
        let term = FactorTerm {
            factors,
            d_log_q_i: &d_log_q[0],
            entropy_weight: None,
        };
        hierarchy.backward_factors(
            parameters,
            experience,
            activations,
            &[term],
            &mut self.workspace,
            &mut self.gradient,
        );
        Ok(())
    }
}
