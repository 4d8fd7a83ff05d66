//! On-policy actor-critic learning from the marginal probability of the joint action (eq. 6).
//!
//! One update takes a batch of whole episodes: the critic sweeps backwards through time and yields advantages, then the
//! policy takes one step along `Σ A_t ∇ log p(u_t)`. The learner sees episodes and actors, never an environment.
//!
//! Every shard has a gradient of its own, and they are summed in the order of the shards: the number of threads changes
//! nothing.

mod average;

use mackrl_env::{EpisodeKey, Stream};

use crate::{
    NotFinite, Phase, Real, Stopwatch,
    central_critic::{
        CentralCritic, CriticReport, CriticSettings, CriticState, broken_step, check_gradient,
        named_step,
    },
    nn::{Moments, Named, Optimiser, OptimiserKind, clip_gradient_norm, first_not_finite},
    parallel::for_each_in_parallel,
    policy::{Policy, Weights},
    rollout::{Episode, ShardBatch},
};

pub use average::LossAverage;

/// How the policy learns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LearnerSettings {
    /// How parameters follow the gradient.
    pub optimiser: OptimiserKind,
    /// Step size, > 0.
    pub learning_rate: f64,
    /// Largest norm of the policy's gradient, > 0; longer ones are scaled down.
    pub gradient_norm_max: f64,
    /// What a step counts for.
    pub average: LossAverage,
    /// How the critic learns.
    pub critic: CriticSettings,
}

/// What one update did.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct UpdateReport {
    /// −mean of `A_t log p(u_t)`, per agent; which mean, [`LossAverage`] says.
    pub policy_loss: f64,
    /// Norm of the policy's gradient before clipping.
    pub policy_gradient_norm: f64,
    /// Mean of `A_t`.
    pub advantage_mean: f64,
    /// What the critic's sweep did.
    pub critic: CriticReport,
}

/// All that a learner has learnt: with its settings, everything that its future depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnerState {
    /// The policy's parameters.
    pub parameters: Vec<f32>,
    /// What the policy's optimiser remembers.
    pub moments: Moments<f32>,
    /// Policy updates so far.
    pub updates: u64,
    /// The critic.
    pub critic: CriticState,
}

/// The policy's parameters, the critic, and how both change.
#[derive(Debug)]
pub struct Learner {
    settings: LearnerSettings,
    agents: usize,
    threads: usize,
    parameters: Vec<f32>,
    weights: Weights,
    optimiser: Optimiser<f32>,
    critic: CentralCritic,
    shard_gradients: Vec<Vec<f32>>,
    advantage_bt: Vec<Vec<f32>>,
    updates: u64,
    reached: Reached,
}

/// How far an update came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reached {
    /// The critic's sweep.
    Critic,
    /// The policy's gradient.
    Gradient,
    /// The optimiser's step.
    Step,
}

/// One shard's part of the backward pass.
struct ShardWork<'a> {
    batch: &'a mut ShardBatch,
    gradient: &'a mut Vec<f32>,
    weight_bt: Vec<Vec<f32>>,
    objective: f64,
}

impl Learner {
    /// A learner for `policy` in a world of `agents` agents and states of `state_size` numbers, with initial parameters drawn
    /// from `seed`. `threads` changes no result.
    #[must_use]
    pub fn new(
        policy: &dyn Policy,
        [agents, state_size]: [usize; 2],
        settings: LearnerSettings,
        seed: u64,
        threads: usize,
    ) -> Self {
        let parameters = policy.initialise(seed);
        let critic_key = EpisodeKey::new(seed, Stream::Other, 1);
        Self {
            settings,
            agents,
            threads,
            weights: policy.weights(&parameters),
            optimiser: Optimiser::new(settings.optimiser, parameters.len()),
            critic: CentralCritic::new(state_size, settings.critic, &critic_key),
            shard_gradients: Vec::new(),
            advantage_bt: Vec::new(),
            updates: 0,
            reached: Reached::Critic,
            parameters,
        }
    }

    /// The policy's parameters.
    #[must_use]
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// The policy's weights, as actors use them.
    #[must_use]
    pub const fn weights(&self) -> &Weights {
        &self.weights
    }

    /// The critic.
    #[must_use]
    pub const fn critic(&self) -> &CentralCritic {
        &self.critic
    }

    /// Number of policy updates so far.
    #[must_use]
    pub const fn updates(&self) -> u64 {
        self.updates
    }

    /// How far the latest update came.
    #[must_use]
    pub const fn reached(&self) -> Reached {
        self.reached
    }

    /// Advantages of the latest update, one list for each episode.
    #[must_use]
    pub fn advantages(&self) -> Vec<Named<'_, f32>> {
        let advantages = self.advantage_bt.iter();
        advantages
            .map(|advantage_t| Named::new("advantages", ["step", ""], 1, advantage_t))
            .collect()
    }

    /// The latest gradient of the policy, tensor by tensor.
    #[must_use]
    pub fn gradient(&self, policy: &dyn Policy) -> Vec<Named<'_, f32>> {
        let gradient = self.shard_gradients.first();
        gradient.map_or_else(Vec::new, |gradient| {
            policy.layout().named("gradient of ", gradient)
        })
    }

    /// The policy's state after the latest step, accepted or not, tensor by tensor.
    #[must_use]
    pub fn after_step(&self, policy: &dyn Policy) -> Vec<Named<'_, f32>> {
        named_step(policy.layout(), &self.optimiser, &self.parameters)
    }

    /// What a checkpoint must hold.
    #[must_use]
    pub fn state(&self) -> LearnerState {
        LearnerState {
            parameters: self.parameters.clone(),
            moments: self.optimiser.moments().clone(),
            updates: self.updates,
            critic: self.critic.state(),
        }
    }

    /// Continues from a checkpoint.
    ///
    /// # Panics
    /// If the state is that of another policy, critic or optimiser.
    pub fn restore(&mut self, policy: &dyn Policy, state: LearnerState) {
        policy.refresh(&state.parameters, &mut self.weights);
        self.optimiser.restore(state.moments);
        self.critic.restore(state.critic);
        self.parameters = state.parameters;
        self.updates = state.updates;
    }

    /// Learns from the batch that `shards` hold, and books the time that it takes.
    ///
    /// # Equation
    /// `∇J = 1/N Σ_{b,t} w_{bt} A_{bt} ∇ log p(u_{bt})` (eq. 6), then one step of the optimiser; `w` are the weights of
    /// [`LossAverage`], `1 / Σ_b T_b` unless something else is asked for.
    ///
    /// # Errors
    /// [`NotFinite`] if a number of the critic's sweep, an advantage, a gradient, or a number after the step is not finite.
    /// Nothing has changed then: neither the policy nor the critic keeps anything of such an update.
    pub fn update(
        &mut self,
        policy: &dyn Policy,
        shards: Vec<&mut ShardBatch>,
        stopwatch: &mut Stopwatch,
    ) -> Result<UpdateReport, NotFinite> {
        let episodes: Vec<&Episode> = shards.iter().flat_map(|shard| &shard.episodes).collect();
        let steps: usize = episodes.iter().map(|episode| episode.steps()).sum();
        self.reached = Reached::Critic;
        let critic = self.critic.sweep(&episodes, &mut self.advantage_bt)?;
        stopwatch.lap(Phase::Critic);
        let stepped = self.policy_step(policy, shards, stopwatch);
        let (policy_gradient_norm, objective) = match stepped {
            Ok(stepped) => stepped,
            Err(broken) => {
                self.critic.undo();
                return Err(broken);
            }
        };
        policy.refresh(&self.parameters, &mut self.weights);
        self.updates += 1;
        stopwatch.lap(Phase::Optimiser);
        let advantages = self.advantage_bt.iter().flatten();
        Ok(UpdateReport {
            policy_loss: -objective,
            policy_gradient_norm,
            advantage_mean: advantages.map(|&a| f64::from(a)).sum::<f64>() / steps as f64,
            critic,
        })
    }

    /// Takes one step of the policy's optimiser; gives the gradient's norm and J.
    fn policy_step(
        &mut self,
        policy: &dyn Policy,
        shards: Vec<&mut ShardBatch>,
        stopwatch: &mut Stopwatch,
    ) -> Result<(f64, f64), NotFinite> {
        check_advantages(&self.advantage_bt)?;
        self.reached = Reached::Gradient;
        let objective = self.backward(shards);
        stopwatch.lap(Phase::Backward);
        if !objective.is_finite() {
            return Err(NotFinite::new(
                "sum of A log p(u)",
                &[],
                f32::from_f64(objective),
            ));
        }
        let gradient = &mut self.shard_gradients[0];
        let norm = clip_gradient_norm(gradient, self.settings.gradient_norm_max);
        let layout = policy.layout();
        check_gradient(norm, layout, gradient)?;
        self.reached = Reached::Step;
        let optimiser = &mut self.optimiser;
        optimiser
            .propose(self.settings.learning_rate, gradient, &self.parameters)
            .map_err(|broken| broken_step(broken, layout, optimiser))?;
        optimiser.accept(&mut self.parameters);
        Ok((norm, objective))
    }

    /// Computes the gradient of −J into the first shard's gradient and returns J.
    fn backward(&mut self, shards: Vec<&mut ShardBatch>) -> f64 {
        let parameters = self.parameters.len();
        self.shard_gradients
            .resize_with(shards.len(), || vec![0.0; parameters]);
        // Descending on −J: the weights carry the minus sign and the mean over steps and agents.
        let steps_b: Vec<usize> = self.advantage_bt.iter().map(Vec::len).collect();
        let scale_t: Vec<f32> = (self.settings.average.weight_t(&steps_b).into_iter())
            .map(|weight| -weight / self.agents as f32)
            .collect();
        let mut rest = self.advantage_bt.as_slice();
        let mut work: Vec<ShardWork<'_>> = shards
            .into_iter()
            .zip(&mut self.shard_gradients)
            .map(|(batch, gradient)| {
                let (own, others) = rest.split_at(batch.episodes.len());
                rest = others;
                let scaled = |advantage_t: &Vec<f32>| {
                    let steps = advantage_t.iter().zip(&scale_t);
                    steps.map(|(a, scale)| scale * a).collect()
                };
                let weight_bt = own.iter().map(scaled).collect();
                ShardWork {
                    batch,
                    gradient,
                    weight_bt,
                    objective: 0.0,
                }
            })
            .collect();
        let weights = &self.weights;
        for_each_in_parallel(self.threads, &mut work, |shard| {
            shard.gradient.fill(0.0);
            let loss = shard
                .batch
                .actor
                .backward(weights, &shard.weight_bt, shard.gradient);
            shard.objective = -loss;
        });
        let objective = work.iter().map(|shard| shard.objective).sum();
        drop(work);
        if let Some((first, others)) = self.shard_gradients.split_first_mut() {
            for other in others {
                first
                    .iter_mut()
                    .zip(other.iter())
                    .for_each(|(sum, term)| *sum += term);
            }
        }
        objective
    }
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
