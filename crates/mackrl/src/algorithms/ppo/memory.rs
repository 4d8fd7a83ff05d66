//! What an update knows of each piece of its batch: values, advantages, the groups' choices, and the gradients of an epoch.

use mackrl_env::AgentId;

use super::PpoSettings;
use crate::{
    Error, Real,
    critics::{TeamCritic, TeamCriticSettings, ValueInputs},
    experience::{Episode, Experience, Piece},
    hierarchy::{Activations, Factor, FactorWorkspace, Hierarchy},
    nn::ValueTrace,
    objectives::{ReturnSettings, Surrogate, clipped_surrogate, generalised_advantages},
    policy::{Parameters, Tally},
};

/// What is known of one piece of a batch, and room to work on it.
#[derive(Debug, Default)]
pub(super) struct Memory {
    pub(super) inputs: ValueInputs,
    pub(super) trace: ValueTrace<f32>,
    pub(super) workspace: FactorWorkspace,
    /// Values when the update began, in the critic's units \[steps · N\].
    pub(super) value_sn: Vec<f32>,
    /// λ-returns \[steps · N\].
    pub(super) return_sn: Vec<f32>,
    /// The same in the critic's units.
    pub(super) target_sn: Vec<f32>,
    pub(super) advantage_sn: Vec<f32>,
    /// Which agents lived \[steps · N\].
    pub(super) alive_sn: Vec<bool>,
    /// The choices that are weighed by themselves; none where they are those of the whole team.
    pub(super) factors: Vec<Factor>,
    pub(super) advantage_i: Vec<f32>,
    pub(super) old_log_q_i: Vec<f32>,
    pub(super) log_q_i: Vec<f32>,
    pub(super) d_log_q_i: Vec<f32>,
    pub(super) gradient: Vec<f32>,
    pub(super) critic_gradient: Vec<f32>,
    pub(super) health: Tally,
}

/// A piece of a batch with what is known of it.
pub(super) struct Work<'a> {
    pub(super) piece: &'a mut Piece,
    pub(super) memory: &'a mut Memory,
    pub(super) outcome: Result<Epoch, Error>,
}

/// What an epoch came to.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Epoch {
    pub(super) surrogate: Surrogate,
    pub(super) entropy: f64,
    pub(super) critic_loss: f64,
}

/// What all pieces of an epoch have in common.
#[derive(Clone, Copy)]
pub(super) struct Rule<'a> {
    pub(super) hierarchy: &'a Hierarchy,
    pub(super) parameters: &'a Parameters,
    pub(super) critic: &'a TeamCritic,
    /// Whether each group has a ratio of its own.
    pub(super) factorises: bool,
    pub(super) clip: f32,
    pub(super) entropy_weight: f32,
    /// What each choice counts for, and each value.
    pub(super) weights: [f32; 2],
}

/// Numbers over a whole batch.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    /// Number, sum and sum of squares.
    pub(super) returns: [f64; 3],
    /// The same of returns less values.
    pub(super) errors: [f64; 3],
    /// The same of advantages of living agents.
    pub(super) advantages: [f64; 3],
}

impl Memory {
    /// Values, λ-returns and advantages of every member at every step.
    pub(super) fn prepare(
        &mut self,
        critic: &TeamCritic,
        critic_settings: TeamCriticSettings,
        experience: &Experience,
        hierarchy: &Hierarchy,
        settings: &PpoSettings,
    ) {
        let members = critic_settings.members;
        let alone = hierarchy.declaration().alone();
        self.inputs.take(critic_settings, experience, alone);
        critic.values(&self.inputs, &mut self.trace, &mut self.value_sn);
        let [mean, deviation] = critic.scale().mean_and_deviation();
        let returns = ReturnSettings {
            gamma: settings.gamma,
            lambda: settings.lambda,
        };
        let rows = self.value_sn.len();
        for numbers in [&mut self.return_sn, &mut self.advantage_sn] {
            numbers.clear();
            numbers.resize(rows, 0.0);
        }
        self.alive_sn.clear();
        self.alive_sn.resize(rows, false);
        let (mut value_t, mut advantage_t) = (Vec::new(), Vec::new());
        for (b, episode) in experience.episodes.iter().enumerate() {
            let steps = episode.steps();
            let first = self.inputs.row(b, 0, members);
            for member in 0..members {
                let row = |t: usize| first + t * members + member;
                value_t.clear();
                value_t.extend((0..steps).map(|t| mean + deviation * self.value_sn[row(t)]));
                value_t.push(0.0);
                advantage_t.clear();
                advantage_t.resize(steps, 0.0);
                generalised_advantages(returns, &episode.reward_t, &value_t, &mut advantage_t);
                for (t, &advantage) in advantage_t.iter().enumerate() {
                    self.advantage_sn[row(t)] = advantage;
                    self.return_sn[row(t)] = advantage + value_t[t];
                    self.alive_sn[row(t)] = episode.alive_t[t].contains(AgentId::new(member));
                }
            }
        }
    }

    /// Adds the numbers of this piece to those of the batch; `scale` are the critic's units.
    pub(super) fn add_to(&self, sums: &mut Sums, [mean, deviation]: [f32; 2]) {
        let add = |sums: &mut [f64; 3], number: f64| {
            sums[0] += 1.0;
            sums[1] += number;
            sums[2] += number * number;
        };
        for (&return_, &value) in self.return_sn.iter().zip(&self.value_sn) {
            let error = return_ - (mean + deviation * value);
            add(&mut sums.returns, f64::from(return_));
            add(&mut sums.errors, f64::from(error));
        }
        for (&advantage, &alive) in self.advantage_sn.iter().zip(&self.alive_sn) {
            if alive {
                add(&mut sums.advantages, f64::from(advantage));
            }
        }
    }

    pub(super) fn normalise(&mut self, scale: [f32; 2], advantages: [f64; 2]) {
        self.target_sn.clear();
        let targets = self.return_sn.iter();
        self.target_sn
            .extend(targets.map(|return_| (return_ - scale[0]) / scale[1]));
        let [mean, deviation]: [f32; 2] = advantages.map(Real::from_f64);
        for advantage in &mut self.advantage_sn {
            *advantage = (*advantage - mean) / (deviation + 1e-5);
        }
    }

    /// The advantage of each group: the mean of its members'.
    pub(super) fn weigh_factors(&mut self, agents: usize) {
        self.advantage_i.clear();
        self.advantage_i.extend(self.factors.iter().map(|factor| {
            let row = self.inputs.row(factor.episode, factor.step, agents);
            let first = self.advantage_sn[row + factor.first];
            factor.second.map_or(first, |second| {
                0.5 * (first + self.advantage_sn[row + second])
            })
        }));
    }

    /// The advantage of each joint action of the whole team: the mean of its living members'.
    pub(super) fn weigh_teams(&mut self, experience: &Experience, agents: usize) {
        self.advantage_i.clear();
        for (b, episode) in experience.episodes.iter().enumerate() {
            for t in 0..episode.steps() {
                let row = self.inputs.row(b, t, agents);
                let living = (row..row + agents).filter(|&row| self.alive_sn[row]);
                let count = living.clone().count().max(1);
                let sum: f32 = living.map(|row| self.advantage_sn[row]).sum();
                self.advantage_i.push(sum / count as f32);
            }
        }
    }

    /// Recalls the log q under which the piece was played, and whether the controllers read their input.
    pub(super) fn recall(
        &mut self,
        hierarchy: &Hierarchy,
        parameters: &Parameters,
        piece: &mut Piece,
    ) -> Result<(), Error> {
        let activations = if hierarchy.factorises() {
            let (_, activations) = hierarchy.networks(parameters, piece)?;
            hierarchy.log_q(activations, &self.factors, &mut self.old_log_q_i);
            activations
        } else {
            let (_, activations) = hierarchy.evaluate(parameters, piece)?;
            flatten(activations.log_p_bt(), &mut self.old_log_q_i);
            activations
        };
        self.health = Tally::default();
        hierarchy.report_health(activations, &mut self.health);
        Ok(())
    }

    /// Writes the gradients of policy and critic for this piece.
    pub(super) fn differentiate(
        &mut self,
        rule: Rule<'_>,
        piece: &mut Piece,
    ) -> Result<Epoch, Error> {
        self.gradient.clear();
        self.gradient.resize(rule.parameters.values().len(), 0.0);
        self.critic_gradient.clear();
        self.critic_gradient
            .resize(rule.critic.parameters().len(), 0.0);
        let (surrogate, entropy) = if rule.factorises {
            self.differentiate_groups(rule, piece)?
        } else {
            self.differentiate_teams(rule, piece)?
        };
        let critic_loss = rule.critic.differentiate(
            &self.inputs,
            [&self.value_sn, &self.target_sn],
            rule.weights[1],
            &mut self.trace,
            &mut self.critic_gradient,
        );
        Ok(Epoch {
            surrogate,
            entropy,
            critic_loss,
        })
    }

    /// Each group with a ratio of its own.
    fn differentiate_groups(
        &mut self,
        rule: Rule<'_>,
        piece: &mut Piece,
    ) -> Result<(Surrogate, f64), Error> {
        let Rule {
            hierarchy,
            parameters,
            ..
        } = rule;
        let (experience, activations) = hierarchy.networks(parameters, piece)?;
        hierarchy.log_q(activations, &self.factors, &mut self.log_q_i);
        let surrogate = self.surrogate(rule);
        let entropy = hierarchy.backward_factors(
            parameters,
            experience,
            activations,
            (
                &self.factors,
                &self.d_log_q_i,
                -rule.weights[0] * rule.entropy_weight,
            ),
            &mut self.workspace,
            &mut self.gradient,
        );
        Ok((surrogate, entropy))
    }

    /// One ratio for the joint action of the whole team, whose entropy `−E log p` has the gradient `−E[log p ∇ log p]`.
    fn differentiate_teams(
        &mut self,
        rule: Rule<'_>,
        piece: &mut Piece,
    ) -> Result<(Surrogate, f64), Error> {
        let Rule {
            hierarchy,
            parameters,
            ..
        } = rule;
        let (experience, activations): (&Experience, &mut Activations) =
            hierarchy.evaluate(parameters, piece)?;
        flatten(activations.log_p_bt(), &mut self.log_q_i);
        let surrogate = self.surrogate(rule);
        let bonus = rule.weights[0] * rule.entropy_weight;
        let mut entropy = 0.0;
        for (d_log_q, &log_q) in self.d_log_q_i.iter_mut().zip(&self.log_q_i) {
            *d_log_q += bonus * log_q;
            entropy -= f64::from(log_q);
        }
        let mut rest = self.d_log_q_i.as_slice();
        let steps = experience.episodes.iter().map(Episode::steps);
        let d_log_p_bt: Vec<Vec<f32>> = steps
            .map(|steps| {
                let (own, others) = rest.split_at(steps);
                rest = others;
                own.to_vec()
            })
            .collect();
        hierarchy.backward(
            parameters,
            experience,
            activations,
            &d_log_p_bt,
            &mut self.gradient,
        );
        Ok((surrogate, entropy))
    }

    /// The surrogate under the present log q.
    fn surrogate(&mut self, rule: Rule<'_>) -> Surrogate {
        clipped_surrogate(
            rule.clip,
            rule.weights[0],
            [&self.log_q_i, &self.old_log_q_i, &self.advantage_i],
            &mut self.d_log_q_i,
        )
    }
}

fn flatten(log_p_bt: &[Vec<f32>], log_p: &mut Vec<f32>) {
    log_p.clear();
    log_p.extend(log_p_bt.iter().flatten().copied());
}

impl Epoch {
    pub(super) fn add(&mut self, other: Self) {
        self.surrogate.loss += other.surrogate.loss;
        self.surrogate.clipped += other.surrogate.clipped;
        self.surrogate.divergence += other.surrogate.divergence;
        self.entropy += other.entropy;
        self.critic_loss += other.critic_loss;
    }
}

/// Pieces with what is known of them.
pub(super) fn works<'a>(batch: &'a mut [&mut Piece], memories: &'a mut [Memory]) -> Vec<Work<'a>> {
    let pieces = batch.iter_mut().zip(memories);
    let work = pieces.map(|(piece, memory)| Work {
        piece,
        memory,
        outcome: Ok(Epoch::default()),
    });
    work.collect()
}

/// Of numbers by their count, sum and sum of squares.
pub(super) fn mean_and_deviation([count, sum, squares]: [f64; 3]) -> [f64; 2] {
    let mean = sum / count.max(1.0);
    [
        mean,
        (squares / count.max(1.0) - mean * mean).max(0.0).sqrt(),
    ]
}
