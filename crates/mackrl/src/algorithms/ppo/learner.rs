//! The learner of MACKRL-PPO, MAPPO and IPPO.
//!
//! An update takes a batch of whole episodes. Values, advantages, groups and what acted are found once; then every epoch goes
//! through the batch, all at once or in minibatches of some of its pieces, and for each computes the networks anew and takes one
//! step of the policy and one of the critic. Sums over pieces are taken in their order: the number of threads changes nothing.

use std::ops::Range;

use mackrl_env::{EpisodeKey, Stream};

use super::{
    PpoSettings, Sight, Weighed,
    memory::{Epoch, Memory, Rule, Sums, mean_and_deviation, works},
    metrics::METRICS,
};
use crate::{
    Error, NotFinite, Phase, Real, Stopwatch,
    algorithms::{
        Algorithm, AlgorithmState, StoredState, Team, add_to, state::read_moments,
        steps_to_learn_from,
    },
    critics::{ReturnScale, TeamCritic, TeamCriticSettings},
    experience::Piece,
    hierarchy::Hierarchy,
    nn::{Optimiser, ParameterLayout, finite_step, first_not_finite},
    parallel::for_each_in_parallel,
    policy::{Behaviour, Parameters, Policy, Tally},
};

/// A team that learns with a clipped surrogate.
#[derive(Debug)]
pub struct Ppo {
    settings: PpoSettings,
    weighed: Weighed,
    agents: usize,
    threads: usize,
    hierarchy: Hierarchy,
    parameters: Parameters,
    optimiser: Optimiser<f32>,
    critic: TeamCritic,
    critic_settings: TeamCriticSettings,
    memories: Vec<Memory>,
    updates: u64,
    steps_env: u64,
}

impl Ppo {
    /// A team that acts as `hierarchy` declares, with initial parameters drawn from the team's seed.
    #[must_use]
    pub fn new(
        hierarchy: Hierarchy,
        settings: PpoSettings,
        weighed: Weighed,
        sight: Sight,
        team: Team<'_>,
    ) -> Self {
        let parameters = hierarchy.initialise(team.seed);
        let critic_settings = critic_settings(&settings, sight, team);
        let critic_key = EpisodeKey::new(team.seed, Stream::Other, 1);
        Self {
            weighed,
            agents: team.spec.agents,
            threads: team.threads,
            optimiser: Optimiser::new(PpoSettings::OPTIMISER, parameters.len()),
            critic: TeamCritic::new(critic_settings, &critic_key),
            critic_settings,
            parameters: Parameters::new(parameters),
            hierarchy,
            settings,
            memories: Vec::new(),
            updates: 0,
            steps_env: 0,
        }
    }

    /// How many parameters a team with this hierarchy and its critic have.
    #[must_use]
    pub fn size(
        hierarchy: &Hierarchy,
        settings: &PpoSettings,
        sight: Sight,
        team: Team<'_>,
    ) -> usize {
        hierarchy.layout().len() + TeamCritic::size(critic_settings(settings, sight, team))
    }

    /// The policy's gradient of the latest epoch, before it was shortened; empty before there was one.
    #[must_use]
    pub fn gradient(&self) -> &[f32] {
        self.memories.first().map_or(&[], |memory| &memory.gradient)
    }

    /// Finds values, advantages, groups and the probabilities under which they acted, and gives the sums over the batch.
    fn prepare(&mut self, batch: &mut [&mut Piece]) -> Result<Sums, Error> {
        self.memories.resize_with(batch.len(), Memory::default);
        let (hierarchy, critic, parameters) = (&self.hierarchy, &self.critic, &self.parameters);
        let (settings, critic_settings) = (&self.settings, self.critic_settings);
        let weighed = self.weighed;
        let mut work = works(batch, &mut self.memories);
        for_each_in_parallel(self.threads, &mut work, |work| {
            let experience = &work.piece.experience;
            work.memory
                .prepare(critic, critic_settings, experience, hierarchy, settings);
            let acted = (work.memory).recall(hierarchy, parameters, work.piece, weighed);
            work.outcome = acted.map(|()| Epoch::default());
        });
        for work in work {
            work.outcome?;
        }
        let mut sums = Sums::default();
        let scale = self.critic.scale().mean_and_deviation();
        for (shard, memory) in self.memories.iter().enumerate() {
            if let Some(index) = first_not_finite(&memory.advantage_sn) {
                let place = [("shard", shard), ("row", index)];
                return Err(NotFinite::new("advantage", &place, memory.advantage_sn[index]).into());
            }
            memory.add_to(&mut sums, scale);
        }
        Ok(sums)
    }

    /// Writes targets in the critic's units, and the normalised advantage of each choice.
    fn finish_preparation(&mut self, batch: &[&mut Piece], sums: &Sums) {
        let [mean, deviation] = mean_and_deviation(sums.advantages);
        let scale = self.critic.scale().mean_and_deviation();
        let factorises = self.hierarchy.factorises();
        for (memory, piece) in self.memories.iter_mut().zip(batch) {
            memory.normalise(scale, [mean, deviation]);
            if factorises {
                memory.weigh_factors(self.agents, Real::from_f64(self.weighed.private));
            } else {
                memory.weigh_teams(&piece.experience, self.agents);
            }
        }
    }

    /// One step of the policy and one of the critic on some pieces of the batch. Gives what they came to, and the norms of both
    /// gradients.
    fn step(
        &mut self,
        batch: &mut [&mut Piece],
        pieces: Range<usize>,
    ) -> Result<(Epoch, [f64; 2]), Error> {
        let memories = &mut self.memories[pieces.clone()];
        let weights = minibatch_weights(memories);
        let factorises = self.hierarchy.factorises();
        let groups = if factorises {
            1
        } else {
            self.agents.div_ceil(2)
        };
        let rule = Rule {
            hierarchy: &self.hierarchy,
            parameters: &self.parameters,
            critic: &self.critic,
            factorises,
            clip: Real::from_f64(self.settings.clip / (groups as f64).sqrt()),
            entropy_weight: Real::from_f64(self.settings.entropy_weight_at(self.steps_env)),
            weights,
        };
        let mut work = works(&mut batch[pieces], memories);
        for_each_in_parallel(self.threads, &mut work, |work| {
            work.outcome = work.memory.differentiate(rule, work.piece);
        });
        let mut total = Epoch::default();
        for work in work {
            total.add(work.outcome?);
        }
        let Some((first, others)) = memories.split_first_mut() else {
            return Err(Error::Data("there is no step to learn from".to_owned()));
        };
        for other in others {
            add_to(&mut first.gradient, &other.gradient);
            add_to(&mut first.critic_gradient, &other.critic_gradient);
        }
        if !(total.surrogate.loss.is_finite() && total.entropy.is_finite()) {
            let loss = Real::from_f64(total.surrogate.loss + total.entropy);
            return Err(NotFinite::new("surrogate loss", &[], loss).into());
        }
        let factor = self.settings.learning_rate_factor(self.steps_env);
        let most = self.settings.gradient_norm_max;
        let (optimiser, layout) = (&mut self.optimiser, self.hierarchy.layout());
        let rates = [factor * self.settings.learning_rate, most];
        let gradient = &mut first.gradient;
        let step = |values: &mut Vec<f32>| finite_step(optimiser, layout, rates, gradient, values);
        let norm = self.parameters.change(step)?;
        let rates = [factor * self.settings.critic_learning_rate, most];
        let critic_norm = self.critic.step(rates, &mut first.critic_gradient)?;
        Ok((total, [norm, critic_norm]))
    }
}

impl Algorithm for Ppo {
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

    fn behaviour(&self, _steps_env: u64) -> Behaviour {
        Behaviour::sampled(0.0)
    }

    fn learn(
        &mut self,
        batch: &mut [&mut Piece],
        stopwatch: &mut Stopwatch,
    ) -> Result<Tally, Error> {
        let steps = steps_to_learn_from(batch)?;
        let sums = self.prepare(batch)?;
        self.critic.note_returns(sums.returns);
        self.finish_preparation(batch, &sums);
        stopwatch.lap(Phase::Critic);
        let mut tally = Tally::default();
        let size = batch.len().div_ceil(self.settings.minibatches);
        for epoch in 0..self.settings.epochs {
            for start in (0..batch.len()).step_by(size) {
                let pieces = start..batch.len().min(start + size);
                let choices = self.memories[pieces.clone()].iter();
                let choices: usize = choices.map(|memory| memory.choices.advantage_i.len()).sum();
                if choices == 0 {
                    continue;
                }
                let (own, norms) = self.step(batch, pieces)?;
                stopwatch.lap(Phase::Backward);
                for (name, value) in [
                    ("pg_loss", own.surrogate.loss),
                    ("agent_grad_norm", norms[0]),
                    ("critic_loss", own.critic_loss),
                    ("critic_grad_norm", norms[1]),
                    ("group_entropy", own.entropy / choices as f64),
                ] {
                    tally.add(name, value, 1.0);
                }
                if epoch + 1 == self.settings.epochs {
                    tally.add("clipped_share", own.surrogate.clipped, choices as f64);
                    tally.add("divergence", own.surrogate.divergence, choices as f64);
                }
            }
        }
        for memory in &self.memories {
            tally.merge(&memory.health);
        }
        let factor = self.settings.learning_rate_factor(self.steps_env);
        let entropy_weight = self.settings.entropy_weight_at(self.steps_env);
        tally.add("entropy_weight", entropy_weight, 1.0);
        tally.add("learning_rate", factor * self.settings.learning_rate, 1.0);
        let [mean, deviation] = mean_and_deviation(sums.returns);
        let [_, error] = mean_and_deviation(sums.errors);
        let unexplained = (error / deviation.max(1e-6)).powi(2);
        tally.add("explained_variance", 1.0 - unexplained, 1.0);
        tally.add("target_mean", mean, 1.0);
        self.updates += 1;
        self.steps_env += steps as u64;
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
        let (layout, critic_layout) = (self.hierarchy.layout(), self.critic.layout());
        let kind = PpoSettings::OPTIMISER;
        let mut state = AlgorithmState::default();
        state.add_tensors(layout, self.parameters.values());
        state.add_tensors(critic_layout, self.critic.parameters());
        state.add_tensors(&scale_layout(), &self.critic.scale().averages());
        state.add_moments("policy", kind, layout, self.optimiser.moments());
        let moments = self.critic.optimiser().moments();
        state.add_moments("critic", kind, critic_layout, moments);
        state.add_counter("policy.updates", self.updates);
        state.add_counter("policy.steps_env", self.steps_env);
        state
    }

    fn restore(&mut self, stored: &dyn StoredState) -> Result<(), Error> {
        let (layout, critic_layout) = (self.hierarchy.layout(), self.critic.layout());
        let kind = PpoSettings::OPTIMISER;
        let parameters = stored.tensors(layout)?;
        let moments = read_moments(stored, "policy", kind, layout)?;
        let critic = stored.tensors(critic_layout)?;
        let critic_moments = read_moments(stored, "critic", kind, critic_layout)?;
        let averages = stored.tensors(&scale_layout())?;
        let updates = stored.counter("policy.updates")?;
        let steps_env = stored.counter("policy.steps_env")?;
        let averages = <[f32; 3]>::try_from(averages).unwrap_or_default();
        self.parameters = Parameters::new(parameters);
        self.optimiser.restore(moments);
        self.critic
            .load(&critic, ReturnScale::from_averages(averages));
        self.critic.restore_moments(critic_moments);
        self.updates = updates;
        self.steps_env = steps_env;
        Ok(())
    }

    fn load(&mut self, stored: &dyn StoredState) -> Result<(), Error> {
        let parameters = stored.tensors(self.hierarchy.layout())?;
        let critic = stored.tensors(self.critic.layout())?;
        self.parameters = Parameters::new(parameters);
        self.critic.load(&critic, ReturnScale::default());
        Ok(())
    }
}

fn critic_settings(settings: &PpoSettings, sight: Sight, team: Team<'_>) -> TeamCriticSettings {
    let spec = team.spec;
    TeamCriticSettings {
        state: match sight {
            Sight::State => spec.state_size,
            Sight::Nothing => 0,
        },
        own: spec.observation_size + spec.agents + spec.actions,
        identity: spec.observation_size,
        members: spec.agents,
        hidden: settings.critic_hidden,
        optimiser: PpoSettings::OPTIMISER,
        loss: settings.value_loss(),
    }
}

/// What each choice and each value of a minibatch counts for: 1 / the number of choices of living agents, and of values.
fn minibatch_weights(memories: &[Memory]) -> [f32; 2] {
    let alive = memories.iter().flat_map(|memory| &memory.alive_sn);
    let choices = alive.filter(|alive| **alive).count();
    let values: usize = memories.iter().map(|memory| memory.value_sn.len()).sum();
    [choices, values].map(|count| Real::from_f64(1.0 / count as f64))
}

/// How the averages of returns are called in checkpoints.
fn scale_layout() -> ParameterLayout {
    let mut layout = ParameterLayout::new();
    layout.add("critic_scale.averages", &[3]);
    layout
}
