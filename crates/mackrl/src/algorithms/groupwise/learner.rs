//! The learner of IAC, COMA and MACKRL-COMA.

use std::marker::PhantomData;

use mackrl_env::{EnvironmentSpec, EpisodeKey, Stream};

use super::{
    Advantage, GroupwiseSettings, Judge,
    reading::{read_members, read_pairs},
    shard::{Shard, Shared, Values},
};
use crate::{
    Error, NotFinite, Phase, Real, Stopwatch,
    algorithms::{
        Algorithm, AlgorithmState, StoredState, Team, add_to,
        state::{read_actor_critic, read_moments},
        steps_to_learn_from,
    },
    critics::{
        ChoiceCritic, ChoiceRows, CriticReport, MemberCritic, MemberCriticSettings, MemberRows,
        write_along_members,
    },
    experience::{Episode, Piece},
    hierarchy::{Hierarchy, Weighing},
    nn::{Optimiser, ParameterLayout, finite_step},
    objectives::{ReturnSettings, generalised_advantages},
    parallel::for_each_in_parallel,
    policy::{Behaviour, Parameters, Policy, Tally},
};

/// What is reported, first of all of pairs.
const METRICS: &[(&str, &str)] = &[
    (
        "choices_of_pairs",
        "share of the groups' choices in a batch that are a pair's: it commonly knew a joint action",
    ),
    (
        "pair_critic_loss",
        "mean squared error of the pairs' critic to its λ-returns",
    ),
    (
        "pair_td_error_abs",
        "mean |λ-return − value| of the pairs' critic",
    ),
    ("epsilon", "ε of the bounded softmax in the latest batch"),
    (
        "pg_loss",
        "−sum of A log q(u) over the choices of groups, each with its own advantage, divided by steps and agents",
    ),
    (
        "agent_grad_norm",
        "norm of the policy's gradient before clipping",
    ),
    (
        "advantage_mean",
        "mean of the advantages of living agents and of pairs that choose",
    ),
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
];

/// How many of [`METRICS`] are of pairs.
const OF_PAIRS: usize = 3;

/// What the optimiser's memory of the pairs' critic is called.
const PAIR_CRITIC: &str = "pair_critic";

/// A team whose groups are each weighed by an advantage of their own: agents alone, or with pairs among them.
#[derive(Debug)]
pub struct Groupwise<J> {
    judge: PhantomData<J>,
    settings: GroupwiseSettings,
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
    pairs: Option<PairValues>,
    shards: Vec<Shard>,
    updates: u64,
}

/// The critic of a hierarchy's pairs, and the latest batch.
#[derive(Debug)]
struct PairValues {
    critic: ChoiceCritic,
    rows: ChoiceRows,
    target_r: Vec<f32>,
    value_rc: Vec<f32>,
}

impl<J: Judge> Groupwise<J> {
    /// A team that acts as `hierarchy` declares and has learnt nothing, with initial parameters drawn from the team's seed.
    ///
    /// # Panics
    /// If the hierarchy does not [factorise](Hierarchy::factorises), or has pairs, and the judge gives no value of each choice.
    #[must_use]
    pub fn new(hierarchy: Hierarchy, settings: GroupwiseSettings, team: Team<'_>) -> Self {
        assert!(hierarchy.factorises(), "one division at a time");
        let parameters = hierarchy.initialise(team.seed);
        let critic_key = |index| EpisodeKey::new(team.seed, Stream::Other, index);
        let pairs = has_pairs(&hierarchy).then(|| {
            let counterfactual = J::ADVANTAGE == Advantage::Counterfactual;
            assert!(counterfactual, "pairs are judged by their choices");
            let critic = settings.pair_critic::<J>(team.spec);
            PairValues {
                critic: ChoiceCritic::new(critic, &critic_key(2)),
                rows: ChoiceRows::default(),
                target_r: Vec::new(),
                value_rc: Vec::new(),
            }
        });
        let critic = settings.critic::<J>(team.spec);
        Self {
            judge: PhantomData,
            spec: team.spec.clone(),
            threads: team.threads,
            optimiser: Optimiser::new(settings.optimiser(), parameters.len()),
            critic: MemberCritic::new(critic, &critic_key(1)),
            parameters: Parameters::new(parameters),
            hierarchy,
            settings,
            rows: MemberRows::default(),
            value_rc: Vec::new(),
            advantage_r: Vec::new(),
            pairs,
            shards: Vec::new(),
            updates: 0,
        }
    }

    /// How many parameters such a team and its critics have.
    #[must_use]
    pub fn size(hierarchy: &Hierarchy, settings: &GroupwiseSettings, team: Team<'_>) -> usize {
        let MemberCriticSettings { choices, .. } = settings.critic::<J>(team.spec);
        let pairs = has_pairs(hierarchy).then(|| settings.pair_critic::<J>(team.spec));
        let critics = [Some(choices), pairs].into_iter().flatten();
        let critics = critics.map(|critic| ChoiceCritic::size(&critic));
        hierarchy.layout().len() + critics.sum::<usize>()
    }

    /// The policy's gradient of the latest batch, before clipping shortened it; empty before there was one.
    #[must_use]
    pub fn gradient(&self) -> &[f32] {
        self.shards.first().map_or(&[], |shard| &shard.gradient)
    }

    /// Finds the groups of a batch and their rows, and lets the critics learn from them.
    fn judge(
        &mut self,
        batch: &[&mut Piece],
        episodes: &[&Episode],
        tally: &mut Tally,
    ) -> Result<CriticReport, NotFinite> {
        let (spec, bank) = (&self.spec, self.hierarchy.declaration().alone());
        let settings = self.critic.settings();
        read_members::<J>(&mut self.rows, spec, settings, (batch, bank), episodes);
        self.shards.resize_with(batch.len(), Shard::default);
        let mut first = 0;
        for (shard, piece) in self.shards.iter_mut().zip(batch) {
            let own = &mut shard.choices;
            own.first = first;
            own.factors = self
                .hierarchy
                .factors(&piece.experience, Weighing::Choosing);
            own.place(&self.rows, spec.agents);
            first += piece.experience.episodes.len();
        }
        let report = self
            .critic
            .learn(episodes, &self.rows, &mut self.value_rc)?;
        if J::ADVANTAGE == Advantage::Temporal {
            self.write_temporal_advantages(episodes);
        }
        let Some(pairs) = &mut self.pairs else {
            return Ok(report);
        };
        read_pairs::<J>(
            (&mut pairs.rows, &mut pairs.target_r),
            (&self.rows, self.critic.target_r()),
            &self.spec,
            pairs.critic.settings(),
            self.shards.iter_mut().map(|shard| &mut shard.choices),
            episodes,
        );
        let own = (pairs.critic).learn(&pairs.rows, &pairs.target_r, &mut pairs.value_rc)?;
        let choices = self.shards.iter().map(|shard| shard.choices.row_i.len());
        let of_pairs = pairs.rows.len() as f64;
        tally.add("choices_of_pairs", of_pairs, choices.sum::<usize>() as f64);
        tally.add("pair_critic_loss", own.loss * of_pairs, of_pairs);
        tally.add("pair_td_error_abs", own.td_error_abs * of_pairs, of_pairs);
        Ok(report)
    }

    /// Writes `r + γ V' − V` of every row.
    fn write_temporal_advantages(&mut self, episodes: &[&Episode]) {
        let returns = ReturnSettings {
            gamma: self.settings.gamma,
            lambda: 0.0,
        };
        let members = self.spec.agents;
        self.advantage_r.clear();
        self.advantage_r.resize(self.rows.rows.len(), 0.0);
        let (rows, value_rc) = (&self.rows, &self.value_rc);
        write_along_members(
            episodes.iter().copied(),
            members,
            |step, member| rows.row(step, member, members),
            |row| value_rc[row],
            |reward_t, value_t, advantage_t| {
                generalised_advantages(returns, reward_t, value_t, advantage_t);
            },
            &mut self.advantage_r,
        );
    }

    /// Computes the gradient of the loss into the first shard's, and gives the loss and the mean advantage.
    fn differentiate(&mut self, batch: &mut [&mut Piece], steps: usize) -> Result<[f64; 2], Error> {
        let length = self.parameters.values().len();
        let pairs = self.pairs.as_ref().map(|pairs| Values {
            value_rc: &pairs.value_rc,
            outputs: pairs.critic.settings().outputs,
            column_r: &pairs.rows.column_r,
        });
        let shared = Shared {
            hierarchy: &self.hierarchy,
            parameters: &self.parameters,
            members: Values {
                value_rc: &self.value_rc,
                outputs: self.critic.settings().choices.outputs,
                column_r: &self.rows.rows.column_r,
            },
            pairs: pairs.unwrap_or_default(),
            advantage_r: &self.advantage_r,
            advantage: J::ADVANTAGE,
            weight: Real::from_f64(1.0 / (steps * self.spec.agents) as f64),
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
                add_to(&mut first.gradient, &other.gradient);
            }
        }
        Ok([loss, mean])
    }
}

impl<J: Judge> Algorithm for Groupwise<J> {
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
        let exploration = batch[0].experience.exploration;
        let episodes: Vec<&Episode> = batch
            .iter()
            .flat_map(|piece| &piece.experience.episodes)
            .collect();
        let mut tally = Tally::default();
        let critic = self.judge(batch, &episodes, &mut tally)?;
        stopwatch.lap(Phase::Critic);
        let [loss, advantage] = self.differentiate(batch, steps)?;
        stopwatch.lap(Phase::Backward);
        if !loss.is_finite() {
            let loss = Real::from_f64(loss);
            return Err(NotFinite::new("sum of A log q(u)", &[], loss).into());
        }
        let rates = [self.settings.learning_rate, self.settings.gradient_norm_max];
        let (optimiser, layout) = (&mut self.optimiser, self.hierarchy.layout());
        let gradient = &mut self.shards[0].gradient;
        let step = |values: &mut Vec<f32>| finite_step(optimiser, layout, rates, gradient, values);
        let norm = self.parameters.change(step)?;
        self.updates += 1;
        stopwatch.lap(Phase::Optimiser);
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
        let without = if self.pairs.is_some() { 0 } else { OF_PAIRS };
        &METRICS[without..]
    }

    fn models(&self) -> Vec<(&ParameterLayout, &[f32])> {
        let pairs = self.pairs.as_ref().map(|pairs| &pairs.critic);
        let mut models = vec![
            (self.hierarchy.layout(), self.parameters.values()),
            (self.critic.layout(), self.critic.parameters()),
        ];
        models.extend(pairs.map(|critic| (critic.layout(), critic.parameters())));
        models
    }

    fn state(&self) -> AlgorithmState {
        let parameters = self.parameters.values();
        let kind = self.settings.optimiser();
        let mut state = AlgorithmState::of_actor_critic(
            kind,
            [self.hierarchy.layout(), self.critic.layout()],
            (parameters, self.optimiser.moments(), self.updates),
            &self.critic.state(),
        );
        if let Some(PairValues { critic, .. }) = &self.pairs {
            state.add_tensors(critic.layout(), critic.parameters());
            state.add_moments(PAIR_CRITIC, kind, critic.layout(), critic.moments());
        }
        state
    }

    fn restore(&mut self, stored: &dyn StoredState) -> Result<(), Error> {
        let layouts = [self.hierarchy.layout(), self.critic.layout()];
        let kind = self.settings.optimiser();
        let (policy, critic) = read_actor_critic(stored, kind, layouts)?;
        if let Some(PairValues { critic, .. }) = &mut self.pairs {
            let parameters = stored.tensors(critic.layout())?;
            let moments = read_moments(stored, PAIR_CRITIC, kind, critic.layout())?;
            critic.load(&parameters);
            critic.restore_moments(moments);
        }
        self.parameters = Parameters::new(policy.parameters);
        self.optimiser.restore(policy.moments);
        self.critic.restore(critic);
        self.updates = policy.updates;
        Ok(())
    }

    fn load(&mut self, stored: &dyn StoredState) -> Result<(), Error> {
        let parameters = stored.tensors(self.hierarchy.layout())?;
        let critic = stored.tensors(self.critic.layout())?;
        if let Some(PairValues { critic, .. }) = &mut self.pairs {
            critic.load(&stored.tensors(critic.layout())?);
        }
        self.parameters = Parameters::new(parameters);
        self.critic.load(&critic);
        Ok(())
    }
}

/// Whether a hierarchy has pairs that may choose.
fn has_pairs(hierarchy: &Hierarchy) -> bool {
    hierarchy.declaration().levels().len() > 2
}
