//! On-policy actor-critic learning from the marginal probability of the joint action (eq. 6).
//!
//! One update takes a batch of whole episodes: the critic sweeps backwards through time and yields advantages, then the
//! policy takes one step along `Σ A_t ∇ log p(u_t)`. The learner sees episodes and actors, never an environment.
//!
//! Every shard has a gradient of its own, and they are summed in the order of the shards: the number of threads changes
//! nothing.

use mackrl_env::{EpisodeKey, Stream};

use crate::{
    Error, Phase, Stopwatch,
    central_critic::{CentralCritic, CriticReport, CriticSettings, CriticState, not_finite},
    nn::{Moments, Optimiser, OptimiserKind, clip_gradient_norm, first_not_finite},
    parallel::for_each_in_parallel,
    policy::{Policy, Weights},
    rollout::{Episode, ShardBatch},
};

/// How the policy learns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LearnerSettings {
    /// How parameters follow the gradient.
    pub optimiser: OptimiserKind,
    /// Step size, > 0.
    pub learning_rate: f64,
    /// Largest norm of the policy's gradient, > 0; longer ones are scaled down.
    pub gradient_norm_max: f64,
    /// How the critic learns.
    pub critic: CriticSettings,
}

/// What one update did.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct UpdateReport {
    /// −mean of `A_t log p(u_t)`, per agent.
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
    /// `∇J = 1 / (N Σ_b T_b) Σ_{b,t} A_{bt} ∇ log p(u_{bt})` (eq. 6), then one step of the optimiser.
    ///
    /// # Errors
    /// [`Error::NotFinite`] if a reward or a state is not finite, before anything changes; or if a gradient is not finite: the
    /// policy has not changed then.
    pub fn update(
        &mut self,
        policy: &dyn Policy,
        shards: Vec<&mut ShardBatch>,
        stopwatch: &mut Stopwatch,
    ) -> Result<UpdateReport, Error> {
        let episodes: Vec<&Episode> = shards.iter().flat_map(|shard| &shard.episodes).collect();
        self.check_finite(&episodes)?;
        let steps: usize = episodes.iter().map(|episode| episode.steps()).sum();
        let critic = self.critic.sweep(&episodes, &mut self.advantage_bt)?;
        let advantages = self.advantage_bt.iter().flatten();
        let advantage_mean = advantages.map(|&a| f64::from(a)).sum::<f64>() / steps as f64;
        stopwatch.lap(Phase::Critic);
        let objective = self.backward(shards, steps);
        stopwatch.lap(Phase::Backward);
        let gradient = &mut self.shard_gradients[0];
        if let Some(index) = first_not_finite(gradient) {
            let layout = policy.layout();
            return Err(not_finite(
                layout,
                "gradient of",
                index,
                gradient,
                self.updates,
            ));
        }
        let norm = clip_gradient_norm(gradient, self.settings.gradient_norm_max);
        self.optimiser
            .step(self.settings.learning_rate, gradient, &mut self.parameters);
        policy.refresh(&self.parameters, &mut self.weights);
        self.updates += 1;
        stopwatch.lap(Phase::Optimiser);
        Ok(UpdateReport {
            policy_loss: -objective,
            policy_gradient_norm: norm,
            advantage_mean,
            critic,
        })
    }

    /// Refuses episodes that hold a number that is not finite.
    fn check_finite(&self, episodes: &[&Episode]) -> Result<(), Error> {
        for (b, episode) in episodes.iter().enumerate() {
            for (what, numbers) in [("reward", &episode.reward_t), ("state", &episode.state_tg)] {
                if let Some(index) = first_not_finite(numbers) {
                    // T rewards, but T + 1 states.
                    let times = episode.steps() + usize::from(what == "state");
                    let t = index * times / numbers.len();
                    return Err(Error::NotFinite {
                        tensor: format!("{what} at step {t} of episode {b} of the batch"),
                        value: f64::from(numbers[index]),
                        update: self.updates,
                    });
                }
            }
        }
        Ok(())
    }

    /// Computes the gradient of −J into the first shard's gradient and returns J.
    fn backward(&mut self, shards: Vec<&mut ShardBatch>, steps: usize) -> f64 {
        let parameters = self.parameters.len();
        self.shard_gradients
            .resize_with(shards.len(), || vec![0.0; parameters]);
        // Descending on −J: the weights carry the minus sign and the mean over steps and agents.
        let scale = -1.0 / (steps * self.agents) as f32;
        let mut rest = self.advantage_bt.as_slice();
        let mut work: Vec<ShardWork<'_>> = shards
            .into_iter()
            .zip(&mut self.shard_gradients)
            .map(|(batch, gradient)| {
                let (own, others) = rest.split_at(batch.episodes.len());
                rest = others;
                let scaled =
                    |advantage_t: &Vec<f32>| advantage_t.iter().map(|a| scale * a).collect();
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

#[cfg(test)]
mod tests {
    use mackrl_env::Action;

    use super::*;
    use crate::{
        baselines::CentralV,
        central_critic::ReturnSettings,
        config::Config,
        policy::{Actor, Behaviour, ControllerInput, Recording, Situation, Tally},
        rollout::{Rollout, RolloutSettings},
        training::assembly::{self, World},
    };

    /// An actor whose gradient is broken in one place.
    struct Broken(usize, Stopwatch);

    impl Actor for Broken {
        fn begin(&mut self, _: Recording) {}
        fn act(&mut self, _: &Weights, _: Situation<'_>, _: &mut [Action]) {}
        fn backward(&mut self, _: &Weights, _: &[Vec<f32>], gradient: &mut [f32]) -> f64 {
            gradient[self.0] = f32::NAN;
            0.0
        }
        fn report(&self, _: &mut Tally) {}
        fn controller_inputs(&self, _: usize) -> Vec<ControllerInput> {
            Vec::new()
        }
        fn stopwatch(&mut self) -> &mut Stopwatch {
            &mut self.1
        }
    }

    #[test]
    fn a_gradient_that_is_no_number_is_refused_and_the_policy_stays_as_it_was() {
        let mut config = Config::default();
        config.env.map = "matrix-game".to_owned();
        config.policy.hidden = 5;
        let world = World::new(&config).unwrap();
        let policy = assembly::policy(&config, &world).unwrap();
        let sizes = [world.spec().agents, world.spec().state_size];
        let mut learner = Learner::new(&*policy, sizes, assembly::learner(&config), 1, 1);
        let mut rollout = Rollout::new(&*policy, world.environments(3).unwrap(), 3, 1);
        let keys = [0, 1, 2].map(|episode| EpisodeKey::new(1, Stream::Training, episode));
        let settings = RolloutSettings {
            behaviour: Behaviour::sampled(0.5),
            recording: Recording::ForLearning,
        };
        rollout.play(learner.weights(), &keys, settings).unwrap();
        let mut broken = ShardBatch {
            episodes: rollout.batches().next().unwrap().episodes.clone(),
            actor: Box::new(Broken(policy.layout().len() - 1, Stopwatch::default())),
        };
        let before = learner.parameters().to_vec();
        let error = learner
            .update(&*policy, vec![&mut broken], &mut Stopwatch::default())
            .unwrap_err();
        let name = &policy.layout().tensors().last().unwrap().name;
        assert!(error.to_string().contains(name), "{error}");
        assert_eq!(learner.parameters(), before);
        assert_eq!(learner.updates(), 0);
        learner
            .update(
                &*policy,
                rollout.batches().collect(),
                &mut Stopwatch::default(),
            )
            .unwrap();
        assert_ne!(learner.parameters(), before);
        assert_eq!(learner.updates(), 1);
    }

    /// A learner of the built-in map and a batch of two episodes.
    fn prepare() -> (CentralV, Learner, Rollout) {
        let environments = || Config::default().env.make().unwrap();
        let spec = environments().spec().clone();
        let policy = CentralV::new(&spec, 5);
        let settings = LearnerSettings {
            optimiser: OptimiserKind::ADAM,
            learning_rate: 1e-3,
            gradient_norm_max: 10.0,
            critic: CriticSettings {
                hidden: 5,
                optimiser: OptimiserKind::ADAM,
                learning_rate: 1e-3,
                gradient_norm_max: 10.0,
                returns: ReturnSettings {
                    gamma: 0.99,
                    lambda: 0.8,
                },
                target_interval_updates: 200,
                bootstrap_at_time_limit: false,
            },
        };
        let learner = Learner::new(&policy, [spec.agents, spec.state_size], settings, 1, 1);
        let mut rollout = Rollout::new(&policy, vec![environments(), environments()], 2, 1);
        let keys = [0, 1].map(|episode| EpisodeKey::new(1, Stream::Training, episode));
        let settings = RolloutSettings {
            behaviour: Behaviour::sampled(0.5),
            recording: Recording::ForLearning,
        };
        rollout.play(learner.weights(), &keys, settings).unwrap();
        (policy, learner, rollout)
    }

    #[test]
    fn a_number_that_is_not_finite_is_named_before_anything_changes() {
        let (policy, mut learner, mut rollout) = prepare();
        let before = learner.state();
        let plant = |rollout: &mut Rollout, reward: f32, state: f32| {
            let batch = rollout.batches().next().unwrap();
            batch.episodes[1].reward_t[3] = reward;
            let size = batch.episodes[1].state(0).len();
            batch.episodes[1].state_tg[7 * size + size - 1] = state;
        };
        for (reward, state, expected) in [
            (
                f32::NAN,
                0.0,
                "reward at step 3 of episode 1 of the batch holds NaN at update 0",
            ),
            (
                0.0,
                f32::INFINITY,
                "state at step 7 of episode 1 of the batch holds inf at update 0",
            ),
        ] {
            plant(&mut rollout, reward, state);
            let batches = rollout.batches().collect();
            let error = learner
                .update(&policy, batches, &mut Stopwatch::default())
                .unwrap_err();
            assert_eq!(error.to_string(), expected);
            assert!(learner.state() == before, "nothing has changed");
        }
        plant(&mut rollout, 0.0, 0.0);
        let batches = rollout.batches().collect();
        learner
            .update(&policy, batches, &mut Stopwatch::default())
            .unwrap();
        assert!(learner.state() != before, "a sound batch is learnt from");
    }
}
