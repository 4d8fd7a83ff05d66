//! On-policy actor-critic learning from the marginal probability of the joint action (eq. 6), on any declared hierarchy.
//!
//! One update takes a batch of whole episodes: the critic sweeps backwards through time and yields advantages, then the policy
//! takes one step along `Σ A_t ∇ log p(u_t)`. MACKRL and Central-V differ in their declaration alone.
//!
//! Every piece of a batch has a gradient of its own, and they are summed in the order of the pieces: the number of threads
//! changes nothing.

mod settings;

use mackrl_env::{EpisodeKey, Stream};

pub use settings::ActorCriticSettings;

use super::{
    Algorithm, AlgorithmState, StoredState, Team, add_to, state::read_actor_critic,
    steps_to_learn_from,
};
use crate::{
    Error, NotFinite, Phase, Real, Stopwatch,
    critics::{CentralCritic, CriticReport},
    experience::{Episode, Piece},
    hierarchy::Hierarchy,
    nn::{Optimiser, ParameterLayout, finite_step, first_not_finite, update_length},
    objectives::{entropy_regularised, policy_gradient},
    parallel::for_each_in_parallel,
    policy::{Behaviour, Parameters, Policy, Tally},
};

/// What is reported.
const METRICS: &[(&str, &str)] = &[
    ("epsilon", "ε of the bounded softmax in the latest batch"),
    (
        "pg_loss",
        "−mean of A_t log p(u_t), divided by the number of agents",
    ),
    (
        "agent_grad_norm",
        "norm of the policy's gradient before clipping",
    ),
    (
        "agent_update_length",
        "root mean square over the policy's parameters of what the step size multiplies, before it is bounded: 1 if every gradient is as large as it has been",
    ),
    ("advantage_mean", "mean of the advantages A_t"),
    (
        "critic_loss",
        "mean squared error of V to its λ-returns over a sweep",
    ),
    (
        "critic_grad_norm",
        "mean norm of the critic's gradients before clipping",
    ),
    ("td_error_abs", "mean |λ-return − V|"),
    ("target_mean", "mean λ-return"),
    (
        "explained_variance",
        "1 − Var(λ-return − V) / Var(λ-return), with V as the first sweep meets it: 1 is a perfect critic, 0 one that knows no more than the mean",
    ),
];

/// A team with a central critic.
#[derive(Debug)]
pub struct ActorCritic {
    settings: ActorCriticSettings,
    agents: usize,
    episode_limit: usize,
    threads: usize,
    hierarchy: Hierarchy,
    parameters: Parameters,
    optimiser: Optimiser<f32>,
    critic: CentralCritic,
    gradients: Vec<Vec<f32>>,
    advantage_bt: Vec<Vec<f32>>,
    updates: u64,
}

/// One piece of a batch and its share of the gradient.
struct Work<'a> {
    piece: &'a mut Piece,
    gradient: &'a mut Vec<f32>,
    advantage_bt: &'a [Vec<f32>],
    outcome: Result<f64, Error>,
    /// Whether its controllers read their input.
    health: Tally,
}

impl ActorCritic {
    /// A team that acts as `hierarchy` declares, with initial parameters drawn from the team's seed.
    #[must_use]
    pub fn new(hierarchy: Hierarchy, settings: ActorCriticSettings, team: Team<'_>) -> Self {
        let parameters = hierarchy.initialise(team.seed);
        let critic_key = EpisodeKey::new(team.seed, Stream::Other, 1);
        Self {
            agents: team.spec.agents,
            episode_limit: team.spec.episode_limit,
            threads: team.threads,
            optimiser: Optimiser::new(settings.optimiser(), parameters.len()),
            critic: CentralCritic::new(team.spec.state_size, settings.critic(), &critic_key),
            parameters: Parameters::new(parameters),
            hierarchy,
            settings,
            gradients: Vec::new(),
            advantage_bt: Vec::new(),
            updates: 0,
        }
    }

    /// How many parameters a team with this hierarchy and its critic have.
    #[must_use]
    pub fn size(hierarchy: &Hierarchy, settings: &ActorCriticSettings, team: Team<'_>) -> usize {
        let critic = CentralCritic::size(team.spec.state_size, settings.critic().hidden);
        hierarchy.layout().len() + critic
    }

    /// The critic.
    #[must_use]
    pub const fn critic(&self) -> &CentralCritic {
        &self.critic
    }

    /// The policy's gradient of the latest batch, before clipping shortened it; empty before there was one.
    #[must_use]
    pub fn gradient(&self) -> &[f32] {
        self.gradients.first().map_or(&[], Vec::as_slice)
    }

    /// Computes the gradient of the loss into the first piece's gradient and returns the loss, and whether the controllers read
    /// their input.
    ///
    /// # Equation
    /// `∇J = 1/N Σ_{b,t} w_{bt} A_{bt} ∇ log p(u_{bt})` (eq. 6): see [`policy_gradient`]; `w` are the weights of
    /// [`LossAverage`](crate::objectives::LossAverage), `1 / Σ_b T_b` unless something else is asked for.
    fn policy_step(&mut self, batch: &mut [&mut Piece]) -> Result<(f64, Tally), Error> {
        let steps_b: Vec<usize> = self.advantage_bt.iter().map(Vec::len).collect();
        let weights = (self.settings.loss_average)
            .weight_t(&steps_b, self.episode_limit)
            .into_iter();
        let weight_t: Vec<f32> = weights.map(|weight| weight / self.agents as f32).collect();
        let parameters = self.parameters.values().len();
        self.gradients
            .resize_with(batch.len(), || vec![0.0; parameters]);
        let mut rest = self.advantage_bt.as_slice();
        let pieces = batch.iter_mut().zip(&mut self.gradients);
        let mut work: Vec<Work<'_>> = pieces
            .map(|(piece, gradient)| {
                let (own, others) = rest.split_at(piece.experience.episodes.len());
                rest = others;
                Work {
                    piece,
                    gradient,
                    advantage_bt: own,
                    outcome: Ok(0.0),
                    health: Tally::default(),
                }
            })
            .collect();
        let (hierarchy, parameters) = (&self.hierarchy, &self.parameters);
        let entropy_weight = Real::from_f64(self.settings.entropy_weight);
        for_each_in_parallel(self.threads, &mut work, |work| {
            work.outcome = work.differentiate(hierarchy, parameters, &weight_t, entropy_weight);
        });
        let (mut loss, mut health) = (0.0, Tally::default());
        for work in work {
            loss += work.outcome?;
            health.merge(&work.health);
        }
        if let Some((first, others)) = self.gradients.split_first_mut() {
            for other in others {
                add_to(first, other);
            }
        }
        Ok((loss, health))
    }
}

impl Work<'_> {
    /// Writes the piece's gradient and gives its loss.
    fn differentiate(
        &mut self,
        hierarchy: &Hierarchy,
        parameters: &Parameters,
        weight_t: &[f32],
        entropy_weight: f32,
    ) -> Result<f64, Error> {
        self.gradient.fill(0.0);
        let (experience, activations) = hierarchy.evaluate(parameters, self.piece)?;
        hierarchy.report_health(activations, &mut self.health);
        let mut d_log_p_bt = Vec::new();
        let log_p_bt = activations.log_p_bt();
        let loss = if entropy_weight > 0.0 {
            entropy_regularised(
                log_p_bt,
                self.advantage_bt,
                weight_t,
                entropy_weight,
                &mut d_log_p_bt,
            )
        } else {
            policy_gradient(log_p_bt, self.advantage_bt, weight_t, &mut d_log_p_bt)
        };
        hierarchy.backward(
            parameters,
            experience,
            activations,
            &d_log_p_bt,
            self.gradient,
        );
        Ok(loss)
    }
}

impl Algorithm for ActorCritic {
    fn policy(&self) -> &dyn Policy {
        &self.hierarchy
    }

    fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    fn environments(&self) -> usize {
        self.settings.environments
    }

    fn shards(&self) -> usize {
        self.settings.shards
    }

    fn behaviour(&self, steps_env: u64) -> Behaviour {
        Behaviour::sampled(self.settings.exploration().at(steps_env))
    }

    fn learn(
        &mut self,
        batch: &mut [&mut Piece],
        stopwatch: &mut Stopwatch,
    ) -> Result<Tally, Error> {
        let steps = steps_to_learn_from(batch)?;
        let episodes: Vec<&Episode> = batch
            .iter()
            .flat_map(|piece| &piece.experience.episodes)
            .collect();
        let critic = self.critic.learn(&episodes, &mut self.advantage_bt)?;
        check_advantages(&self.advantage_bt)?;
        stopwatch.lap(Phase::Critic);
        let exploration = batch
            .first()
            .map_or(0.0, |piece| piece.experience.exploration);
        let (loss, mut tally) = self.policy_step(batch)?;
        stopwatch.lap(Phase::Backward);
        if !loss.is_finite() {
            let loss = Real::from_f64(loss);
            return Err(NotFinite::new("sum of A log p(u)", &[], loss).into());
        }
        let gradient = &mut self.gradients[0];
        let length = update_length(&self.optimiser, gradient);
        let most = self.settings.update_length_max;
        let shortened = if most > 0.0 && length > most {
            most / length
        } else {
            1.0
        };
        let learning_rate = shortened * self.settings.learning_rate;
        let rates = [learning_rate, self.settings.gradient_norm_max];
        let (optimiser, layout) = (&mut self.optimiser, self.hierarchy.layout());
        let step = |values: &mut Vec<f32>| finite_step(optimiser, layout, rates, gradient, values);
        let norm = self.parameters.change(step)?;
        self.updates += 1;
        stopwatch.lap(Phase::Optimiser);
        let advantages = self.advantage_bt.iter().flatten();
        let advantage_mean = advantages.map(|&a| f64::from(a)).sum::<f64>() / steps as f64;
        tally.merge(&report(
            f64::from(exploration),
            [loss, norm, length, advantage_mean],
            critic,
        ));
        Ok(tally)
    }

    fn updates(&self) -> u64 {
        self.updates
    }

    fn metrics(&self) -> &'static [(&'static str, &'static str)] {
        METRICS
    }

    fn models(&self) -> Vec<(&ParameterLayout, &[f32])> {
        vec![
            (self.hierarchy.layout(), self.parameters.values()),
            (self.critic.layout(), self.critic.parameters()),
        ]
    }

    fn state(&self) -> AlgorithmState {
        let parameters = self.parameters.values();
        AlgorithmState::of_actor_critic(
            self.settings.optimiser(),
            [self.hierarchy.layout(), self.critic.layout()],
            (parameters, self.optimiser.moments(), self.updates),
            &self.critic.state(),
        )
    }

    fn restore(&mut self, stored: &dyn StoredState) -> Result<(), Error> {
        let layouts = [self.hierarchy.layout(), self.critic.layout()];
        let (policy, critic) = read_actor_critic(stored, self.settings.optimiser(), layouts)?;
        self.parameters = Parameters::new(policy.parameters);
        self.optimiser.restore(policy.moments);
        self.critic.restore(critic);
        self.updates = policy.updates;
        Ok(())
    }

    fn load(&mut self, stored: &dyn StoredState) -> Result<(), Error> {
        let parameters = stored.tensors(self.hierarchy.layout())?;
        let critic = stored.tensors(self.critic.layout())?;
        self.parameters = Parameters::new(parameters);
        self.critic.load(&critic);
        Ok(())
    }

    fn value(&mut self, state_g: &[f32]) -> Option<f32> {
        Some(self.critic.value(state_g))
    }
}

/// What an update did, under the names of [`METRICS`].
fn report(
    exploration: f64,
    [loss, norm, length, advantage]: [f64; 4],
    critic: CriticReport,
) -> Tally {
    let mut tally = Tally::default();
    for (name, value) in [
        ("epsilon", exploration),
        ("pg_loss", loss),
        ("agent_grad_norm", norm),
        ("agent_update_length", length),
        ("advantage_mean", advantage),
        ("critic_loss", critic.loss),
        ("critic_grad_norm", critic.gradient_norm),
        ("td_error_abs", critic.td_error_abs),
        ("target_mean", critic.target_mean),
        ("explained_variance", critic.explained_variance),
    ] {
        tally.add(name, value, 1.0);
    }
    tally
}

/// Refuses advantages that are not finite.
fn check_advantages(advantage_bt: &[Vec<f32>]) -> Result<(), NotFinite> {
    for (b, advantage_t) in advantage_bt.iter().enumerate() {
        if let Some(t) = first_not_finite(advantage_t) {
            let place = [("episode", b), ("step", t)];
            return Err(NotFinite::new("advantage", &place, advantage_t[t]));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn advantages_that_are_not_finite_are_named() {
        let found = check_advantages(&[vec![0.5; 3], vec![0.5, f32::NEG_INFINITY]]);
        assert_eq!(
            found.unwrap_err().to_string(),
            "advantage is -inf at episode 1, step 1"
        );
        assert_eq!(check_advantages(&[vec![0.5; 3], vec![]]), Ok(()));
    }
}
