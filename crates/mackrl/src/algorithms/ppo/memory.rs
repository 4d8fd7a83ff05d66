//! What an update knows of each piece of its batch: values, advantages, the groups' choices, and the gradients of an epoch.

use super::{PpoSettings, Weighed};
use crate::{
    Error, Real,
    critics::{TeamCritic, TeamCriticSettings, ValueInputs, write_along_members},
    experience::{Episode, Experience, Piece},
    hierarchy::{Activations, Factor, FactorTerm, FactorWorkspace, Hierarchy},
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
    /// The choices of groups, or of the whole team, which have no factor.
    pub(super) choices: Choices,
    /// What members of pairs that choose did, as if each had been alone; none unless these have a weight.
    pub(super) apart: Choices,
    pub(super) gradient: Vec<f32>,
    pub(super) critic_gradient: Vec<f32>,
    pub(super) health: Tally,
}

/// Choices that are weighed by themselves, and what is known of each.
#[derive(Debug, Default)]
pub(super) struct Choices {
    pub(super) factors: Vec<Factor>,
    pub(super) advantage_i: Vec<f32>,
    pub(super) old_log_q_i: Vec<f32>,
    pub(super) log_q_i: Vec<f32>,
    pub(super) d_log_q_i: Vec<f32>,
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
        let (inputs, value_sn) = (&self.inputs, &self.value_sn);
        let row = |[b, t]: [usize; 2], member: usize| inputs.row(b, t, members) + member;
        let value = |row: usize| mean + deviation * value_sn[row];
        self.advantage_sn.clear();
        self.advantage_sn.resize(rows, 0.0);
        write_along_members(
            &experience.episodes,
            members,
            row,
            value,
            |reward_t, value_t, advantage_t| {
                generalised_advantages(returns, reward_t, value_t, advantage_t);
            },
            &mut self.advantage_sn,
        );
        self.return_sn.clear();
        let advantages = self.advantage_sn.iter().enumerate();
        (self.return_sn).extend(advantages.map(|(row, advantage)| advantage + value(row)));
        self.alive_sn.clear();
        self.alive_sn.resize(rows, false);
        for (b, episode) in experience.episodes.iter().enumerate() {
            for (t, alive) in episode.alive_t.iter().enumerate() {
                for agent in alive.iter() {
                    self.alive_sn[row([b, t], agent.index())] = true;
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

    /// The advantage of each group: the mean of its members'. That of a member apart is its own, times `private_weight` and how much
    /// likelier (or less) both members would have done the same if their pair had delegated: `π_a π_b / q`. So on average over what
    /// pairs do, members learn what they would if pairs always delegated.
    pub(super) fn weigh_factors(&mut self, agents: usize, private_weight: f32) {
        let (inputs, advantage_sn) = (&self.inputs, &self.advantage_sn);
        let of = |factor: &Factor, member: usize| {
            advantage_sn[inputs.row(factor.episode, factor.step, agents) + member]
        };
        let Choices {
            factors,
            advantage_i,
            old_log_q_i,
            ..
        } = &mut self.choices;
        advantage_i.clear();
        advantage_i.extend(factors.iter().map(|factor| {
            let first = of(factor, factor.first);
            factor
                .second
                .map_or(first, |second| 0.5 * (first + of(factor, second)))
        }));
        let pairs = factors.iter().zip(old_log_q_i);
        let pairs = pairs.filter(|(factor, _)| factor.second.is_some());
        let apart = &mut self.apart;
        apart.advantage_i.clear();
        let members = apart.factors.chunks_exact(2);
        let members = members.zip(apart.old_log_q_i.chunks_exact(2));
        for ((_, log_q), (members, log_p)) in pairs.zip(members) {
            let weight = private_weight * (log_p[0] + log_p[1] - *log_q).exp();
            let own = members.iter().map(|own| weight * of(own, own.first));
            apart.advantage_i.extend(own);
        }
    }

    /// The advantage of each joint action of the whole team: the mean of its living members'.
    pub(super) fn weigh_teams(&mut self, experience: &Experience, agents: usize) {
        let advantage_i = &mut self.choices.advantage_i;
        advantage_i.clear();
        for (b, episode) in experience.episodes.iter().enumerate() {
            for t in 0..episode.steps() {
                let row = self.inputs.row(b, t, agents);
                let living = (row..row + agents).filter(|&row| self.alive_sn[row]);
                let count = living.clone().count().max(1);
                let sum: f32 = living.map(|row| self.advantage_sn[row]).sum();
                advantage_i.push(sum / count as f32);
            }
        }
    }

    /// Finds the groups that choose, and recalls the log q under which the piece was played, and whether the controllers read their
    /// input.
    pub(super) fn recall(
        &mut self,
        hierarchy: &Hierarchy,
        parameters: &Parameters,
        piece: &mut Piece,
        weighed: Weighed,
    ) -> Result<(), Error> {
        let (choices, apart) = (&mut self.choices, &mut self.apart);
        let activations = if hierarchy.factorises() {
            let (experience, activations) = hierarchy.networks(parameters, piece)?;
            choices.factors = hierarchy.factors(experience, weighed.groups);
            apart.factors.clear();
            if weighed.private > 0.0 {
                let members = choices.factors.iter().filter_map(Factor::apart);
                apart.factors.extend(members.flatten());
            }
            for own in [choices, apart] {
                hierarchy.log_q(activations, &own.factors, &mut own.old_log_q_i);
            }
            activations
        } else {
            let (_, activations) = hierarchy.evaluate(parameters, piece)?;
            flatten(activations.log_p_bt(), &mut choices.old_log_q_i);
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
        let (choices, apart) = (&mut self.choices, &mut self.apart);
        for own in [&mut *choices, &mut *apart] {
            hierarchy.log_q(activations, &own.factors, &mut own.log_q_i);
        }
        let mut surrogate = choices.surrogate(rule);
        surrogate.loss += apart.surrogate(rule).loss;
        let entropy_weight = -rule.weights[0] * rule.entropy_weight;
        let entropy = hierarchy.backward_factors(
            parameters,
            experience,
            activations,
            &[choices.term(Some(entropy_weight)), apart.term(None)],
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
        let choices = &mut self.choices;
        flatten(activations.log_p_bt(), &mut choices.log_q_i);
        let surrogate = choices.surrogate(rule);
        let bonus = rule.weights[0] * rule.entropy_weight;
        let mut entropy = 0.0;
        for (d_log_q, &log_q) in choices.d_log_q_i.iter_mut().zip(&choices.log_q_i) {
            *d_log_q += bonus * log_q;
            entropy -= f64::from(log_q);
        }
        let mut rest = choices.d_log_q_i.as_slice();
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
}

impl Choices {
    /// The surrogate under the present log q.
    fn surrogate(&mut self, rule: Rule<'_>) -> Surrogate {
        clipped_surrogate(
            rule.clip,
            rule.weights[0],
            [&self.log_q_i, &self.old_log_q_i, &self.advantage_i],
            &mut self.d_log_q_i,
        )
    }

    /// What they add to the loss.
    fn term(&self, entropy_weight: Option<f32>) -> FactorTerm<'_> {
        FactorTerm {
            factors: &self.factors,
            d_log_q_i: &self.d_log_q_i,
            entropy_weight,
        }
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
