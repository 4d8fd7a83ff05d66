//! The learner of IQL, VDN and QMIX.
//!
//! After every batch of new episodes, which only go into the memory, a minibatch is drawn from it, cut into shards of episodes of
//! like lengths, and one optimiser step is taken on agents and mixer together. Sums over shards are taken in their order: the
//! number of threads changes nothing.

use mackrl_env::{EpisodeKey, Stream};

use super::{
    QLearningSettings,
    acting::ActionValues,
    loss::{Networks, Rule, Sums, Weights, Workspace},
    minibatch::Minibatch,
};
use crate::{
    Error, NotFinite, Phase, Real, Stopwatch,
    algorithms::{Algorithm, AlgorithmState, StoredState, Team, add_to, state::read_moments},
    critics::Mixer,
    experience::{EpisodeShape, Piece, RememberedEpisode, ReplayMemory},
    nn::{Optimiser, ParameterLayout, finite_step},
    parallel::for_each_in_parallel,
    policy::{Behaviour, Parameters, Policy, Tally},
};

/// What is reported.
const METRICS: &[(&str, &str)] = &[
    (
        "epsilon",
        "ε of the latest batch: the probability of any available action instead of the best",
    ),
    (
        "loss",
        "mean squared error of the mixed values to their targets",
    ),
    ("grad_norm", "norm of the gradient before clipping"),
    ("td_error_abs", "mean |target − mixed value|"),
    ("q_taken_mean", "mean mixed value of what was done"),
    ("target_mean", "mean target"),
    ("memory_episodes", "episodes in the replay memory"),
    (
        "memory_megabytes",
        "size of the replay memory's episodes, in units of 10⁶ bytes",
    ),
];

/// Which number of [`Stream::Other`] names the draws from the memory.
const DRAWS: u64 = 2;

/// A team that learns action values from remembered episodes.
#[derive(Debug)]
pub struct QLearner<M: Mixer> {
    settings: QLearningSettings,
    threads: usize,
    draws: EpisodeKey,
    policy: ActionValues,
    /// Agents and mixer.
    layout: ParameterLayout,
    networks: Networks<M>,
    values: Vec<f32>,
    weights: Weights<M, f32>,
    target_values: Vec<f32>,
    target_weights: Weights<M, f32>,
    optimiser: Optimiser<f32>,
    /// The agents' part of `values`, to act with.
    parameters: Parameters,
    memory: ReplayMemory,
    remembered: Vec<RememberedEpisode>,
    shards: Vec<Shard<M>>,
    batches: u64,
    /// Episodes before the batch after which the target networks were refreshed.
    episodes_at_refresh: u64,
}

/// A piece of a minibatch, and room to work on it.
#[derive(Debug)]
struct Shard<M: Mixer> {
    batch: Minibatch<f32>,
    work: Workspace<M, f32>,
    gradient: Vec<f32>,
    sums: Sums,
}

impl<M: Mixer> QLearner<M> {
    /// A team that has learnt nothing, with initial parameters drawn from the team's seed; `mixer` adds its tensors to a layout.
    #[must_use]
    pub fn new(
        settings: QLearningSettings,
        team: Team<'_>,
        mixer: impl FnOnce(&mut ParameterLayout) -> M,
    ) -> Self {
        let policy = ActionValues::new(team.spec, settings.hidden);
        let mut layout = policy.layout().clone();
        let mixer = mixer(&mut layout);
        let mut values = policy.initialise(team.seed);
        let own = values.len();
        values.resize(layout.len(), 0.0);
        let mixer_key = EpisodeKey::new(team.seed, Stream::Other, 1);
        mixer.initialise(&mixer_key, &mut values);
        let networks = Networks {
            agents: policy.network().clone(),
            mixer,
        };
        Self {
            threads: team.threads,
            draws: EpisodeKey::new(team.seed, Stream::Other, DRAWS),
            weights: networks.weights(&values),
            target_weights: networks.weights(&values),
            target_values: values.clone(),
            optimiser: Optimiser::new(settings.optimiser(), values.len()),
            parameters: Parameters::new(values[..own].to_vec()),
            memory: ReplayMemory::new(EpisodeShape::of(team.spec), settings.memory_episodes),
            remembered: Vec::new(),
            shards: Vec::new(),
            batches: 0,
            episodes_at_refresh: 0,
            settings,
            policy,
            layout,
            networks,
            values,
        }
    }

    /// How many parameters such a team and its mixer have.
    #[must_use]
    pub fn size(
        settings: &QLearningSettings,
        team: Team<'_>,
        mixer: impl FnOnce(&mut ParameterLayout) -> M,
    ) -> usize {
        let policy = ActionValues::new(team.spec, settings.hidden);
        let mut layout = policy.layout().clone();
        mixer(&mut layout);
        layout.len()
    }

    /// What it learns from.
    #[must_use]
    pub const fn memory(&self) -> &ReplayMemory {
        &self.memory
    }

    /// Takes other parameters, for a test that compares two learners; the target networks take them too.
    ///
    /// # Panics
    /// If there are not as many.
    pub fn set_parameters(&mut self, values: Vec<f32>) {
        assert_eq!(values.len(), self.values.len(), "parameters");
        self.target_values.clone_from(&values);
        self.target_weights = self.networks.weights(&values);
        self.take(values);
    }

    fn take(&mut self, values: Vec<f32>) {
        self.weights = self.networks.weights(&values);
        self.parameters = Parameters::new(values[..self.policy.layout().len()].to_vec());
        self.values = values;
    }

    /// Draws a minibatch and deals it out to the shards, the longest episodes first and in turn.
    fn draw(&mut self, number: u64) {
        let step = usize::try_from(number).unwrap_or(usize::MAX);
        let count = self.settings.minibatch_episodes;
        let drawn = self.memory.draw(count, &self.draws, step);
        self.remembered
            .resize_with(drawn.len(), RememberedEpisode::default);
        for (&index, episode) in drawn.iter().zip(&mut self.remembered) {
            self.memory.read(index, episode);
        }
        let mut order: Vec<&RememberedEpisode> = self.remembered.iter().collect();
        order.sort_by_key(|episode| std::cmp::Reverse(episode.steps()));
        let count = self.settings.shards.min(drawn.len());
        let networks = &self.networks;
        self.shards.resize_with(count, || Shard {
            batch: Minibatch::default(),
            work: networks.workspace(),
            gradient: Vec::new(),
            sums: Sums::default(),
        });
        for (place, shard) in self.shards.iter_mut().enumerate() {
            let own: Vec<&RememberedEpisode> =
                order.iter().copied().skip(place).step_by(count).collect();
            let goes_on = self.settings.bootstrap_at_time_limit;
            shard.batch.fill(self.memory.shape(), &own, goes_on);
        }
    }

    /// Takes one step on the minibatch with this number.
    fn step(
        &mut self,
        number: u64,
        tally: &mut Tally,
        stopwatch: &mut Stopwatch,
    ) -> Result<(), Error> {
        self.draw(number);
        stopwatch.lap(Phase::Memory);
        let steps: usize = self.shards.iter().map(|shard| shard.batch.steps()).sum();
        let errors = steps * self.networks.mixer.outputs();
        let rule = Rule {
            returns: self.settings.returns(),
            double_q: self.settings.double_q,
            weight: Real::from_f64(1.0 / errors as f64),
        };
        let (networks, length) = (&self.networks, self.values.len());
        let weights = [&self.weights, &self.target_weights];
        for_each_in_parallel(self.threads, &mut self.shards, |shard| {
            shard.gradient.clear();
            shard.gradient.resize(length, 0.0);
            let Shard {
                batch,
                work,
                gradient,
                sums,
            } = shard;
            *sums = networks.differentiate(weights, rule, batch, work, gradient);
        });
        let mut sums = Sums::default();
        self.shards.iter().for_each(|shard| sums.add(shard.sums));
        let Some((first, others)) = self.shards.split_first_mut() else {
            return Err(Error::Data("there is no episode to learn from".to_owned()));
        };
        for other in others {
            add_to(&mut first.gradient, &other.gradient);
        }
        stopwatch.lap(Phase::Backward);
        if !sums.errors.loss.is_finite() {
            let loss = Real::from_f64(sums.errors.loss);
            return Err(NotFinite::new("loss of the values", &[], loss).into());
        }
        let rates = [self.settings.learning_rate, self.settings.gradient_norm_max];
        let mut values = std::mem::take(&mut self.values);
        let gradient = &mut first.gradient;
        let norm = finite_step(
            &mut self.optimiser,
            &self.layout,
            rates,
            gradient,
            &mut values,
        );
        self.take(values);
        stopwatch.lap(Phase::Optimiser);
        tally.add("loss", sums.errors.loss, 1.0);
        tally.add("grad_norm", norm?, 1.0);
        tally.add("td_error_abs", sums.errors.absolute, sums.count);
        tally.add("q_taken_mean", sums.value, sums.count);
        tally.add("target_mean", sums.target, sums.count);
        Ok(())
    }
}

impl<M: Mixer> Algorithm for QLearner<M> {
    fn policy(&self) -> &dyn Policy {
        &self.policy
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
        let episodes_before = self.memory.added();
        let mut tally = Tally::default();
        for piece in &*batch {
            for episode in &piece.experience.episodes {
                self.memory.add(episode)?;
            }
            tally.add("epsilon", f64::from(piece.experience.exploration), 1.0);
        }
        if self.memory.added() == episodes_before {
            return Err(Error::Data("there is no step to learn from".to_owned()));
        }
        stopwatch.lap(Phase::Memory);
        let each = self.settings.minibatches;
        if self.memory.len() >= self.settings.minibatch_episodes {
            for minibatch in 0..each {
                self.step(self.batches * each + minibatch, &mut tally, stopwatch)?;
            }
            let since = episodes_before - self.episodes_at_refresh;
            if since >= self.settings.target_interval_episodes {
                self.target_values.clone_from(&self.values);
                self.target_weights = self.networks.weights(&self.values);
                self.episodes_at_refresh = episodes_before;
            }
        }
        self.batches += 1;
        tally.add("memory_episodes", self.memory.len() as f64, 1.0);
        tally.add("memory_megabytes", self.memory.bytes() as f64 * 1e-6, 1.0);
        stopwatch.lap(Phase::Memory);
        Ok(tally)
    }

    fn updates(&self) -> u64 {
        self.batches
    }

    fn metrics(&self) -> &'static [(&'static str, &'static str)] {
        METRICS
    }

    fn models(&self) -> Vec<(&ParameterLayout, &[f32])> {
        vec![(&self.layout, &self.values)]
    }

    fn state(&self) -> AlgorithmState {
        let mut state = AlgorithmState::default();
        state.add_tensors(&self.layout, &self.values);
        state.add_tensors(&self.layout.prefixed("target."), &self.target_values);
        let (kind, moments) = (self.settings.optimiser(), self.optimiser.moments());
        state.add_moments("policy", kind, &self.layout, moments);
        state.add_counter("policy.updates", self.batches);
        state.add_counter("target.episodes_at_refresh", self.episodes_at_refresh);
        state.memory = Some(self.memory.state());
        state
    }

    fn restore(&mut self, stored: &dyn StoredState) -> Result<(), Error> {
        let kind = self.settings.optimiser();
        let values = stored.tensors(&self.layout)?;
        let target_values = stored.tensors(&self.layout.prefixed("target."))?;
        let moments = read_moments(stored, "policy", kind, &self.layout)?;
        let batches = stored.counter("policy.updates")?;
        let episodes_at_refresh = stored.counter("target.episodes_at_refresh")?;
        let memory = self.memory.restored(stored.memory()?)?;
        if episodes_at_refresh > memory.added() {
            return Err(Error::Data(format!(
                "the target networks were refreshed after {episodes_at_refresh} episodes, expected at most {}",
                memory.added()
            )));
        }
        self.take(values);
        self.target_weights = self.networks.weights(&target_values);
        self.target_values = target_values;
        self.optimiser.restore(moments);
        self.memory = memory;
        self.batches = batches;
        self.episodes_at_refresh = episodes_at_refresh;
        Ok(())
    }

    fn load(&mut self, stored: &dyn StoredState) -> Result<(), Error> {
        let values = stored.tensors(&self.layout)?;
        self.take(values);
        Ok(())
    }
}
