//! The learner of MACKRL-PPO, MAPPO and IPPO.
//!
//! An update takes a batch of whole episodes. Values, advantages and groups are found once; then every epoch computes the
//! networks anew and takes one step of the policy and one of the critic on the whole batch. All of it is cut into the pieces of
//! the batch, whose sums are taken in their order: the number of threads changes nothing.

use mackrl_env::{EpisodeKey, Stream};

use super::{PpoSettings, Sight};
use crate::{
    Error, NotFinite, Phase, Real, Stopwatch,
    algorithms::{Algorithm, AlgorithmState, StoredState, Team, state::read_moments},
    critics::{ReturnScale, TeamCritic, TeamCriticSettings, ValueInputs},
    experience::{Episode, Experience, Piece},
    hierarchy::{Activations, Factor, FactorWorkspace, Hierarchy, Weighing},
    nn::{Optimiser, ParameterLayout, ValueTrace, finite_step, first_not_finite},
    objectives::{ReturnSettings, Surrogate, clipped_surrogate, generalised_advantages},
    parallel::for_each_in_parallel,
    policy::{Behaviour, Parameters, Policy, Tally},
};

/// What is reported.
const METRICS: &[(&str, &str)] = &[
    (
        "pg_loss",
        "clipped surrogate loss, without the entropy; mean over epochs, as all of these unless something else is said",
    ),
    (
        "agent_grad_norm",
        "norm of the policy's gradient before clipping",
    ),
    ("critic_loss", "loss of the values, in units of returns"),
    (
        "critic_grad_norm",
        "norm of the critic's gradient before clipping",
    ),
    (
        "clipped_share",
        "share of the groups' choices whose ratio is past its bound, in the last epoch",
    ),
    (
        "divergence",
        "mean of ρ − 1 − log ρ over the groups' choices in the last epoch: how far an update moves the policy",
    ),
    (
        "group_entropy",
        "entropy of what a group does, over all ways to it, in nats (of the whole team, an estimate, where ratios are the team's)",
    ),
    (
        "explained_variance",
        "1 − Var(return − V) / Var(return) before the update",
    ),
    ("target_mean", "mean of what values are fitted to"),
    (
        "learning_rate",
        "step size of the controllers in the latest update",
    ),
    (
        "mackrl/delegation_rate",
        "share of chosen pairs with common knowledge that delegated",
    ),
    (
        "mackrl/delegation_rate_ck_enemies_",
        "the same, for pairs that commonly know this many enemies (Figure 7)",
    ),
    (
        "mackrl/common_knowledge_rate",
        "share of chosen pairs of living agents with common knowledge",
    ),
    (
        "mackrl/ck_entities_mean",
        "entities that a chosen pair of living agents commonly knows",
    ),
    (
        "mackrl/entropy_pair_selector",
        "entropy of the pair selector, in nats",
    ),
    (
        "mackrl/entropy_pair_controller",
        "entropy of chosen pair controllers with common knowledge, in nats",
    ),
    (
        "mackrl/entropy_agent_controller",
        "entropy of living agents' controllers, in nats",
    ),
];

/// A team that learns with a clipped surrogate.
#[derive(Debug)]
pub struct Ppo {
    settings: PpoSettings,
    weighing: Weighing,
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

/// What is known of one piece of a batch, and room to work on it.
#[derive(Debug, Default)]
struct Memory {
    inputs: ValueInputs,
    trace: ValueTrace<f32>,
    workspace: FactorWorkspace,
    /// Values when the update began, in the critic's units \[steps · N\].
    value_sn: Vec<f32>,
    /// λ-returns \[steps · N\].
    return_sn: Vec<f32>,
    /// The same in the critic's units.
    target_sn: Vec<f32>,
    advantage_sn: Vec<f32>,
    /// Which agents lived \[steps · N\].
    alive_sn: Vec<bool>,
    /// The choices that are weighed by themselves; none where they are those of the whole team.
    factors: Vec<Factor>,
    advantage_i: Vec<f32>,
    old_log_q_i: Vec<f32>,
    log_q_i: Vec<f32>,
    d_log_q_i: Vec<f32>,
    gradient: Vec<f32>,
    critic_gradient: Vec<f32>,
}

/// A piece of a batch with what is known of it.
struct Work<'a> {
    piece: &'a mut Piece,
    memory: &'a mut Memory,
    outcome: Result<Epoch, Error>,
}

/// What an epoch came to.
#[derive(Debug, Clone, Copy, Default)]
struct Epoch {
    surrogate: Surrogate,
    entropy: f64,
    critic_loss: f64,
}

/// What all pieces of an epoch have in common.
#[derive(Clone, Copy)]
struct Rule<'a> {
    hierarchy: &'a Hierarchy,
    parameters: &'a Parameters,
    critic: &'a TeamCritic,
    /// Whether each group has a ratio of its own.
    factorises: bool,
    clip: f32,
    entropy_weight: f32,
    /// What each choice counts for, and each value.
    weights: [f32; 2],
    is_first: bool,
}

/// Numbers over a whole batch.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    /// Number, sum and sum of squares.
    returns: [f64; 3],
    /// The same of returns less values.
    errors: [f64; 3],
    /// The same of advantages of living agents.
    advantages: [f64; 3],
}

impl Ppo {
    /// A team that acts as `hierarchy` declares, with initial parameters drawn from the team's seed.
    #[must_use]
    pub fn new(
        hierarchy: Hierarchy,
        settings: PpoSettings,
        weighing: Weighing,
        sight: Sight,
        team: Team<'_>,
    ) -> Self {
        let parameters = hierarchy.initialise(team.seed);
        let critic_settings = critic_settings(&settings, sight, team);
        let critic_key = EpisodeKey::new(team.seed, Stream::Other, 1);
        Self {
            weighing,
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

    /// Takes other parameters of the policy and of the critic, for a test that compares two learners.
    ///
    /// # Panics
    /// If there are not as many.
    pub fn set_parameters(&mut self, policy: Vec<f32>, critic: &[f32]) {
        assert_eq!(policy.len(), self.parameters.values().len(), "parameters");
        self.parameters = Parameters::new(policy);
        self.critic.load(critic, ReturnScale::default());
    }

    /// The parameters of the critic.
    #[must_use]
    pub fn critic_parameters(&self) -> &[f32] {
        self.critic.parameters()
    }

    /// Finds values, advantages and groups, and gives the sums over the batch.
    fn prepare(&mut self, batch: &mut [&mut Piece]) -> Result<Sums, Error> {
        self.memories.resize_with(batch.len(), Memory::default);
        let (hierarchy, critic) = (&self.hierarchy, &self.critic);
        let (settings, critic_settings) = (&self.settings, self.critic_settings);
        let weighing = hierarchy.factorises().then_some(self.weighing);
        let mut work = works(batch, &mut self.memories);
        for_each_in_parallel(self.threads, &mut work, |work| {
            let experience = &work.piece.experience;
            work.memory
                .prepare(critic, critic_settings, experience, hierarchy, settings);
            if let Some(weighing) = weighing {
                work.memory.factors = hierarchy.factors(experience, weighing);
            }
        });
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
            memory.normalise(scale, [mean, deviation], self.agents);
            if factorises {
                memory.weigh_factors(self.agents);
            } else {
                memory.weigh_teams(&piece.experience, self.agents);
            }
        }
    }

    /// One step of the policy and one of the critic. Gives what the epoch came to, and the norms of both gradients.
    fn epoch(
        &mut self,
        batch: &mut [&mut Piece],
        weights: [f32; 2],
        is_first: bool,
    ) -> Result<(Epoch, [f64; 2]), Error> {
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
            entropy_weight: Real::from_f64(self.settings.entropy_weight),
            weights,
            is_first,
        };
        let mut work = works(batch, &mut self.memories);
        for_each_in_parallel(self.threads, &mut work, |work| {
            work.outcome = work.memory.differentiate(rule, work.piece);
        });
        let mut total = Epoch::default();
        for work in work {
            total.add(work.outcome?);
        }
        let Some((first, others)) = self.memories.split_first_mut() else {
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

impl Memory {
    /// Values, λ-returns and advantages of every member at every step.
    fn prepare(
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
                    self.alive_sn[row(t)] =
                        episode.alive_t[t].contains(mackrl_env::AgentId::new(member));
                }
            }
        }
    }

    /// Adds the numbers of this piece to those of the batch; `scale` are the critic's units.
    fn add_to(&self, sums: &mut Sums, [mean, deviation]: [f32; 2]) {
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

    fn normalise(&mut self, scale: [f32; 2], advantages: [f64; 2], _agents: usize) {
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
    fn weigh_factors(&mut self, agents: usize) {
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
    fn weigh_teams(&mut self, experience: &Experience, agents: usize) {
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

    /// Writes the gradients of policy and critic for this piece.
    fn differentiate(&mut self, rule: Rule<'_>, piece: &mut Piece) -> Result<Epoch, Error> {
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
            (&self.factors, &self.d_log_q_i),
            -rule.weights[0] * rule.entropy_weight,
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
        self.log_q_i.clear();
        self.log_q_i
            .extend(activations.log_p_bt().iter().flatten().copied());
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

    /// The surrogate under the present log q; in the first epoch, those are what acted.
    fn surrogate(&mut self, rule: Rule<'_>) -> Surrogate {
        if rule.is_first {
            self.old_log_q_i.clone_from(&self.log_q_i);
        }
        clipped_surrogate(
            rule.clip,
            rule.weights[0],
            [&self.log_q_i, &self.old_log_q_i, &self.advantage_i],
            &mut self.d_log_q_i,
        )
    }
}

impl Epoch {
    fn add(&mut self, other: Self) {
        self.surrogate.loss += other.surrogate.loss;
        self.surrogate.clipped += other.surrogate.clipped;
        self.surrogate.divergence += other.surrogate.divergence;
        self.entropy += other.entropy;
        self.critic_loss += other.critic_loss;
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
        let steps: usize = batch.iter().map(|piece| piece.experience.steps()).sum();
        if steps == 0 {
            return Err(Error::Data("there is no step to learn from".to_owned()));
        }
        let sums = self.prepare(batch)?;
        self.critic.note_returns(sums.returns);
        self.finish_preparation(batch, &sums);
        stopwatch.lap(Phase::Critic);
        let weights = [sums.advantages[0], sums.returns[0]];
        let weights = weights.map(|count| 1.0 / count as f32);
        let mut tally = Tally::default();
        let choices = (self.memories.iter().map(|memory| memory.advantage_i.len())).sum::<usize>();
        for epoch in 0..self.settings.epochs {
            let (own, norms) = self.epoch(batch, weights, epoch == 0)?;
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
        let factor = self.settings.learning_rate_factor(self.steps_env);
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

/// Pieces with what is known of them.
fn works<'a>(batch: &'a mut [&mut Piece], memories: &'a mut [Memory]) -> Vec<Work<'a>> {
    let pieces = batch.iter_mut().zip(memories);
    let work = pieces.map(|(piece, memory)| Work {
        piece,
        memory,
        outcome: Ok(Epoch::default()),
    });
    work.collect()
}

fn add_to(sums: &mut [f32], terms: &[f32]) {
    sums.iter_mut()
        .zip(terms)
        .for_each(|(sum, term)| *sum += term);
}

/// Of numbers by their count, sum and sum of squares.
fn mean_and_deviation([count, sum, squares]: [f64; 3]) -> [f64; 2] {
    let mean = sum / count.max(1.0);
    [
        mean,
        (squares / count.max(1.0) - mean * mean).max(0.0).sqrt(),
    ]
}

/// How the averages of returns are called in checkpoints.
fn scale_layout() -> ParameterLayout {
    let mut layout = ParameterLayout::new();
    layout.add("critic_scale.averages", &[3]);
    layout
}
