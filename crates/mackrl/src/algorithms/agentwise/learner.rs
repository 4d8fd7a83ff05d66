//! The learner of IAC and COMA.

use std::marker::PhantomData;

use mackrl_env::{EnvironmentSpec, EpisodeKey, Stream};

use super::{Advantage, AgentwiseSettings, Judge};
use crate::{
    Error, NotFinite, Phase, Real, Stopwatch,
    algorithms::{Algorithm, AlgorithmState, StoredState, Team, state::read_actor_critic},
    common_knowledge::CommonKnowledgeFeatures,
    critics::{MemberCritic, MemberCriticSettings, MemberRows},
    experience::{Episode, Piece},
    hierarchy::{Factor, FactorWorkspace, Hierarchy, HierarchySettings, NetworkStyle, Weighing},
    nn::{Optimiser, ParameterLayout, finite_step, first_not_finite},
    objectives::{ReturnSettings, generalised_advantages, policy_gradient},
    parallel::for_each_in_parallel,
    policy::{Behaviour, Declaration, Parameters, Policy, Tally},
};

/// What is reported.
const METRICS: &[(&str, &str)] = &[
    ("epsilon", "ε of the bounded softmax in the latest batch"),
    (
        "pg_loss",
        "−mean of A log π(u) over steps and agents, each with its own advantage",
    ),
    (
        "agent_grad_norm",
        "norm of the policy's gradient before clipping",
    ),
    ("advantage_mean", "mean of the living agents' advantages"),
    (
        "critic_loss",
        "mean squared error of the critic to its λ-returns",
    ),
    (
        "critic_grad_norm",
        "mean norm of the critic's gradients before clipping",
    ),
    ("td_error_abs", "mean |λ-return − value|"),
    ("target_mean", "mean λ-return"),
    (
        "mackrl/entropy_agent_controller",
        "entropy of living agents' controllers, in nats",
    ),
];

/// A team of agents alone whose choices are each weighed by an advantage of their own.
#[derive(Debug)]
pub struct Agentwise<J> {
    judge: PhantomData<J>,
    settings: AgentwiseSettings,
    spec: EnvironmentSpec,
    threads: usize,
    hierarchy: Hierarchy,
    parameters: Parameters,
    optimiser: Optimiser<f32>,
    critic: MemberCritic,
    rows: MemberRows,
    /// What the critic gave \[steps · N, C\].
    value_rc: Vec<f32>,
    /// Advantages of each row, where they do not depend on the policy \[steps · N\].
    advantage_r: Vec<f32>,
    shards: Vec<Shard>,
    updates: u64,
}

/// A piece's share of an update.
#[derive(Debug, Default)]
struct Shard {
    /// Number of its first episode in the batch.
    first: usize,
    log_q_i: Vec<f32>,
    advantage_i: Vec<f32>,
    workspace: FactorWorkspace,
    gradient: Vec<f32>,
    loss: f64,
}

/// What all shards read.
struct Shared<'a> {
    hierarchy: &'a Hierarchy,
    parameters: &'a Parameters,
    rows: &'a MemberRows,
    value_rc: &'a [f32],
    advantage_r: &'a [f32],
    advantage: Advantage,
    members: usize,
    outputs: usize,
    weight: f32,
}

impl<J: Judge> Agentwise<J> {
    /// A team that has learnt nothing, with initial parameters drawn from the team's seed.
    #[must_use]
    pub fn new(settings: AgentwiseSettings, team: Team<'_>) -> Self {
        let hierarchy = hierarchy(&settings, team);
        let parameters = hierarchy.initialise(team.seed);
        let critic_key = EpisodeKey::new(team.seed, Stream::Other, 1);
        let critic = critic_settings::<J>(&settings, team.spec);
        Self {
            judge: PhantomData,
            spec: team.spec.clone(),
            threads: team.threads,
            optimiser: Optimiser::new(settings.optimiser(), parameters.len()),
            critic: MemberCritic::new(critic, &critic_key),
            parameters: Parameters::new(parameters),
            hierarchy,
            settings,
            rows: MemberRows::default(),
            value_rc: Vec::new(),
            advantage_r: Vec::new(),
            shards: Vec::new(),
            updates: 0,
        }
    }

    /// How many parameters such a team and its critic have.
    #[must_use]
    pub fn size(settings: &AgentwiseSettings, team: Team<'_>) -> usize {
        let critic = MemberCritic::size(&critic_settings::<J>(settings, team.spec));
        hierarchy(settings, team).layout().len() + critic
    }

    /// The policy's gradient of the latest batch, before clipping shortened it; empty before there was one.
    #[must_use]
    pub fn gradient(&self) -> &[f32] {
        self.shards.first().map_or(&[], |shard| &shard.gradient)
    }

    /// Writes what the critic reads: what living agents read, everybody's identity, and what the judge adds.
    fn read(&mut self, batch: &[&mut Piece], episodes: &[&Episode]) {
        let EnvironmentSpec {
            agents,
            observation_size,
            ..
        } = self.spec;
        let settings = self.critic.settings();
        let (inputs, own) = (settings.inputs, settings.inputs - J::inputs(&self.spec));
        self.rows.begin(episodes, settings);
        for (b, episode) in episodes.iter().enumerate() {
            for t in 0..episode.steps() {
                for member in 0..agents {
                    let row = self.rows.row([b, t], member, agents);
                    let input = &mut self.rows.input_rf[row * inputs..(row + 1) * inputs];
                    input[observation_size + member] = 1.0;
                    J::write(&self.spec, episode, t, member, &mut input[own..]);
                    if J::ADVANTAGE == Advantage::Counterfactual {
                        self.rows.column_r[row] = episode.actions(t)[member].index();
                    }
                }
            }
        }
        let bank = self.hierarchy.declaration().alone();
        let mut first = 0;
        for piece in batch {
            let bank = &piece.experience.banks[bank];
            for (t, step) in bank.steps().iter().enumerate() {
                let read = bank.inputs_of(step).chunks_exact(own);
                for (instance, read) in bank.instances_of(step).iter().zip(read) {
                    let place = [first + instance.environment, t];
                    let row = self.rows.row(place, instance.group, agents);
                    self.rows.input_rf[row * inputs..][..own].copy_from_slice(read);
                }
            }
            first += piece.experience.episodes.len();
        }
    }

    /// Writes `r + γ V' − V` of every row.
    fn write_temporal_advantages(&mut self, episodes: &[&Episode]) {
        let returns = ReturnSettings {
            gamma: self.settings.gamma,
            lambda: 0.0,
        };
        let members = self.spec.agents;
        self.advantage_r.clear();
        self.advantage_r.resize(self.rows.column_r.len(), 0.0);
        let (mut value_t, mut advantage_t) = (Vec::new(), Vec::new());
        for (b, episode) in episodes.iter().enumerate() {
            for member in 0..members {
                let row = |t: usize| self.rows.row([b, t], member, members);
                value_t.clear();
                value_t.extend((0..episode.steps()).map(|t| self.value_rc[row(t)]));
                value_t.push(0.0);
                advantage_t.clear();
                advantage_t.resize(episode.steps(), 0.0);
                generalised_advantages(returns, &episode.reward_t, &value_t, &mut advantage_t);
                for (t, &advantage) in advantage_t.iter().enumerate() {
                    self.advantage_r[row(t)] = advantage;
                }
            }
        }
    }

    /// Computes the gradient of the loss into the first shard's, and gives the loss and the mean advantage.
    fn differentiate(&mut self, batch: &mut [&mut Piece], steps: usize) -> Result<[f64; 2], Error> {
        self.shards.resize_with(batch.len(), Shard::default);
        let length = self.parameters.values().len();
        let mut first = 0;
        for (shard, piece) in self.shards.iter_mut().zip(&*batch) {
            shard.first = first;
            first += piece.experience.episodes.len();
        }
        let members = self.spec.agents;
        let shared = Shared {
            hierarchy: &self.hierarchy,
            parameters: &self.parameters,
            rows: &self.rows,
            value_rc: &self.value_rc,
            advantage_r: &self.advantage_r,
            advantage: J::ADVANTAGE,
            members,
            outputs: self.critic.settings().outputs,
            weight: Real::from_f64(1.0 / (steps * members) as f64),
        };
        let pieces = batch.iter_mut().zip(&mut self.shards);
        let mut work: Vec<_> = pieces
            .map(|(piece, shard)| (piece, shard, Ok(())))
            .collect();
        for_each_in_parallel(self.threads, &mut work, |(piece, shard, outcome)| {
            shard.gradient.clear();
            shard.gradient.resize(length, 0.0);
            *outcome = shard.differentiate(&shared, piece);
        });
        for (.., outcome) in work {
            outcome?;
        }
        let advantages: Vec<&f32> = (self.shards.iter())
            .flat_map(|shard| &shard.advantage_i)
            .collect();
        let sum: f64 = advantages
            .iter()
            .map(|&&advantage| f64::from(advantage))
            .sum();
        let mean = sum / (advantages.len().max(1)) as f64;
        let loss = self.shards.iter().map(|shard| shard.loss).sum();
        if let Some((first, others)) = self.shards.split_first_mut() {
            for other in others {
                let terms = first.gradient.iter_mut().zip(&other.gradient);
                terms.for_each(|(sum, term)| *sum += term);
            }
        }
        Ok([loss, mean])
    }
}

impl Shard {
    /// Writes the piece's gradient and its loss.
    fn differentiate(&mut self, shared: &Shared<'_>, piece: &mut Piece) -> Result<(), Error> {
        let &Shared {
            hierarchy,
            parameters,
            rows,
            members,
            outputs,
            weight,
            ..
        } = shared;
        let (experience, activations) = hierarchy.networks(parameters, piece)?;
        let factors = hierarchy.factors(experience, Weighing::Choosing);
        hierarchy.log_q(activations, &factors, &mut self.log_q_i);
        let first = self.first;
        let row = |factor: &Factor| {
            rows.row([first + factor.episode, factor.step], factor.first, members)
        };
        self.advantage_i.clear();
        match shared.advantage {
            Advantage::Temporal => {
                let advantages = factors.iter().map(|own| shared.advantage_r[row(own)]);
                self.advantage_i.extend(advantages);
            }
            Advantage::Counterfactual => {
                let values = |factor: &Factor| &shared.value_rc[row(factor) * outputs..][..outputs];
                let expected = &mut self.advantage_i;
                hierarchy.expectations(activations, &factors, values, expected);
                for (expected, factor) in expected.iter_mut().zip(&factors) {
                    *expected = values(factor)[rows.column_r[row(factor)]] - *expected;
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
        hierarchy.backward_factors(
            parameters,
            experience,
            activations,
            (&factors, &d_log_q[0], 0.0),
            &mut self.workspace,
            &mut self.gradient,
        );
        Ok(())
    }
}

impl<J: Judge> Algorithm for Agentwise<J> {
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
        let steps: usize = batch.iter().map(|piece| piece.experience.steps()).sum();
        if steps == 0 {
            return Err(Error::Data("there is no step to learn from".to_owned()));
        }
        let exploration = batch[0].experience.exploration;
        let episodes: Vec<&Episode> = batch
            .iter()
            .flat_map(|piece| &piece.experience.episodes)
            .collect();
        self.read(batch, &episodes);
        let critic = self
            .critic
            .learn(&episodes, &self.rows, &mut self.value_rc)?;
        if J::ADVANTAGE == Advantage::Temporal {
            self.write_temporal_advantages(&episodes);
        }
        stopwatch.lap(Phase::Critic);
        let [loss, advantage] = self.differentiate(batch, steps)?;
        stopwatch.lap(Phase::Backward);
        if !loss.is_finite() {
            let loss = Real::from_f64(loss);
            return Err(NotFinite::new("sum of A log π(u)", &[], loss).into());
        }
        let rates = [self.settings.learning_rate, self.settings.gradient_norm_max];
        let (optimiser, layout) = (&mut self.optimiser, self.hierarchy.layout());
        let gradient = &mut self.shards[0].gradient;
        let step = |values: &mut Vec<f32>| finite_step(optimiser, layout, rates, gradient, values);
        let norm = self.parameters.change(step)?;
        self.updates += 1;
        stopwatch.lap(Phase::Optimiser);
        let mut tally = Tally::default();
        for (name, value) in [
            ("epsilon", f64::from(exploration)),
            ("pg_loss", loss),
            ("agent_grad_norm", norm),
            ("advantage_mean", advantage),
            ("critic_loss", critic.loss),
            ("critic_grad_norm", critic.gradient_norm),
            ("td_error_abs", critic.td_error_abs),
            ("target_mean", critic.target_mean),
        ] {
            tally.add(name, value, 1.0);
        }
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
}

/// The hierarchy without upper levels.
fn hierarchy(settings: &AgentwiseSettings, team: Team<'_>) -> Hierarchy {
    let declaration = Declaration::agents_alone([team.spec.agents, team.spec.actions]);
    let own = HierarchySettings {
        // No group reads it.
        common_knowledge: CommonKnowledgeFeatures::default(),
        hidden: settings.hidden,
        networks: NetworkStyle::Plain,
    };
    Hierarchy::new(declaration, team.spec, team.prior, own)
}

fn critic_settings<J: Judge>(
    settings: &AgentwiseSettings,
    spec: &EnvironmentSpec,
) -> MemberCriticSettings {
    let own = spec.observation_size + spec.agents + spec.actions;
    let outputs = J::ADVANTAGE.outputs(spec.actions);
    settings.critic([own + J::inputs(spec), outputs], spec.agents)
}
