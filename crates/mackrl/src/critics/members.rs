//! A value of each member's choice or situation, learnt backwards in time as PyMARL's critics are.
//!
//! One network reads a row for each member at each step and gives a row of numbers, one of which belongs to what was done: the
//! value of the situation, where there is one column (IAC), or that of the member's action, where there is one for each (COMA).
//! Targets are λ-returns of a copy of the network, refreshed now and then; the last state of an episode is worth nothing.

use mackrl_env::EpisodeKey;

use super::{CRITIC, CriticReport, explained};
use crate::{
    NotFinite,
    experience::Episode,
    nn::{
        FeedForward, FeedForwardTrace, FeedForwardWeights, Moments, Optimiser, OptimiserKind,
        ParameterLayout, finite_step,
    },
    objectives::{ReturnSettings, lambda_returns, squared_errors},
};

/// Rows whose targets are computed together, so that what is computed of them stays in the cache.
const BLOCK_ROWS: usize = 512;

/// Sizes of a [`MemberCritic`], and how it learns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MemberCriticSettings {
    /// F: length of a row.
    pub inputs: usize,
    /// Units of each of the two hidden layers.
    pub hidden: usize,
    /// C: columns that it gives for a row.
    pub outputs: usize,
    /// N: members.
    pub members: usize,
    /// How parameters follow the gradient.
    pub optimiser: OptimiserKind,
    /// Step size.
    pub learning_rate: f64,
    /// Longest gradient.
    pub gradient_norm_max: f64,
    /// How far targets look.
    pub returns: ReturnSettings,
    /// Updates between two refreshments of the target copy.
    pub target_interval_updates: u64,
}

/// The values of a team's members.
#[derive(Debug)]
pub struct MemberCritic {
    settings: MemberCriticSettings,
    layout: ParameterLayout,
    network: FeedForward,
    parameters: Vec<f32>,
    weights: FeedForwardWeights<f32>,
    target_parameters: Vec<f32>,
    target_weights: FeedForwardWeights<f32>,
    optimiser: Optimiser<f32>,
    gradient: Vec<f32>,
    trace: FeedForwardTrace<f32>,
    updates: u64,
    updates_at_refresh: u64,
}

/// The rows of a batch of episodes, by time, then episode, then member.
#[derive(Debug, Clone, Default)]
pub struct MemberRows {
    /// The first step at each time, and behind the last.
    first_t: Vec<usize>,
    /// The number of each step of each episode \[B\]\[T\].
    step_bt: Vec<Vec<usize>>,
    /// What members read \[steps · N, F\].
    pub input_rf: Vec<f32>,
    /// The column of what was done \[steps · N\].
    pub column_r: Vec<usize>,
}

impl MemberRows {
    /// Makes room for these episodes: inputs are zero and all columns 0 until they are written.
    pub fn begin(&mut self, episodes: &[&Episode], settings: &MemberCriticSettings) {
        let longest = episodes.iter().map(|episode| episode.steps()).max();
        self.first_t.clear();
        self.step_bt.clear();
        self.step_bt.resize_with(episodes.len(), Vec::new);
        let mut steps = 0;
        for t in 0..longest.unwrap_or(0) {
            self.first_t.push(steps);
            for (step_t, episode) in self.step_bt.iter_mut().zip(episodes) {
                if t < episode.steps() {
                    step_t.push(steps);
                    steps += 1;
                }
            }
        }
        self.first_t.push(steps);
        let rows = steps * settings.members;
        self.input_rf.clear();
        self.input_rf.resize(rows * settings.inputs, 0.0);
        self.column_r.clear();
        self.column_r.resize(rows, 0);
    }

    /// The row of a member at step `t` of episode `b`.
    #[must_use]
    pub fn row(&self, [b, t]: [usize; 2], member: usize, members: usize) -> usize {
        self.step_bt[b][t] * members + member
    }
}

impl MemberCritic {
    /// A critic whose initial parameters are drawn from `key`.
    #[must_use]
    pub fn new(settings: MemberCriticSettings, key: &EpisodeKey) -> Self {
        let (layout, network) = Self::network(&settings);
        let mut parameters = vec![0.0; layout.len()];
        network.initialise(key, &mut parameters);
        Self {
            weights: network.weights(&parameters),
            target_parameters: parameters.clone(),
            target_weights: network.weights(&parameters),
            optimiser: Optimiser::new(settings.optimiser, parameters.len()),
            gradient: vec![0.0; parameters.len()],
            trace: FeedForwardTrace::of(&network),
            settings,
            layout,
            network,
            parameters,
            updates: 0,
            updates_at_refresh: 0,
        }
    }

    /// How many parameters such a critic has.
    #[must_use]
    pub fn size(settings: &MemberCriticSettings) -> usize {
        Self::network(settings).0.len()
    }

    fn network(settings: &MemberCriticSettings) -> (ParameterLayout, FeedForward) {
        let mut layout = ParameterLayout::new();
        let widths = [
            settings.inputs,
            settings.hidden,
            settings.hidden,
            settings.outputs,
        ];
        let network = FeedForward::with_widths(&mut layout, CRITIC, &widths);
        (layout, network)
    }

    /// Its sizes, and how it learns.
    #[must_use]
    pub const fn settings(&self) -> &MemberCriticSettings {
        &self.settings
    }

    /// Names and shapes of the parameters.
    #[must_use]
    pub const fn layout(&self) -> &ParameterLayout {
        &self.layout
    }

    /// The parameters.
    #[must_use]
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// Takes other parameters.
    ///
    /// # Panics
    /// If there are not as many as the layout says.
    pub fn load(&mut self, parameters: &[f32]) {
        self.network.refresh(parameters, &mut self.weights);
        self.parameters.copy_from_slice(parameters);
    }

    /// What a checkpoint must hold.
    #[must_use]
    pub fn state(&self) -> super::CriticState {
        super::CriticState {
            parameters: self.parameters.clone(),
            target_parameters: self.target_parameters.clone(),
            moments: self.optimiser.moments().clone(),
            updates: self.updates,
            updates_at_refresh: self.updates_at_refresh,
        }
    }

    /// Continues from a checkpoint.
    ///
    /// # Panics
    /// If the state is that of a critic of another size or optimiser.
    pub fn restore(&mut self, state: super::CriticState) {
        let super::CriticState {
            parameters,
            target_parameters,
            moments,
            updates,
            updates_at_refresh,
        } = state;
        self.load(&parameters);
        self.network
            .refresh(&target_parameters, &mut self.target_weights);
        self.target_parameters = target_parameters;
        let moments: Moments<f32> = moments;
        self.optimiser.restore(moments);
        self.updates = updates;
        self.updates_at_refresh = updates_at_refresh;
    }

    /// Learns from a batch, one optimiser step for each time from the last to the first, and writes what it gave for each row when
    /// its step came.
    ///
    /// # Shapes
    /// `value_rc` becomes \[steps · N, C\].
    ///
    /// # Errors
    /// [`NotFinite`] if a value, a gradient or a number after a step is not finite.
    pub fn learn(
        &mut self,
        episodes: &[&Episode],
        rows: &MemberRows,
        value_rc: &mut Vec<f32>,
    ) -> Result<CriticReport, NotFinite> {
        if self.updates - self.updates_at_refresh >= self.settings.target_interval_updates {
            self.target_parameters.copy_from_slice(&self.parameters);
            self.network
                .refresh(&self.target_parameters, &mut self.target_weights);
            self.updates_at_refresh = self.updates;
        }
        let target_r = self.targets(episodes, rows);
        let MemberCriticSettings {
            outputs, members, ..
        } = self.settings;
        value_rc.clear();
        value_rc.resize(rows.column_r.len() * outputs, 0.0);
        let mut report = CriticReport::default();
        let times = rows.first_t.len() - 1;
        for t in (0..times).rev() {
            let own = rows.first_t[t] * members..rows.first_t[t + 1] * members;
            let values = &mut value_rc[own.start * outputs..own.end * outputs];
            let one = self.update(rows, own, &target_r, values)?;
            report.loss += one.loss / times as f64;
            report.gradient_norm += one.gradient_norm / times as f64;
            report.td_error_abs += one.td_error_abs / times as f64;
            report.target_mean += one.target_mean / times as f64;
        }
        let values = value_rc.chunks_exact(outputs).zip(&rows.column_r);
        let chosen = values.map(|(value_c, &column)| &value_c[column]);
        report.explained_variance = explained(target_r.iter().zip(chosen));
        Ok(report)
    }

    /// The λ-returns of all rows.
    fn targets(&mut self, episodes: &[&Episode], rows: &MemberRows) -> Vec<f32> {
        let MemberCriticSettings {
            inputs,
            outputs,
            members,
            returns,
            ..
        } = self.settings;
        let mut chosen_r = Vec::with_capacity(rows.column_r.len());
        let blocks = rows.input_rf.chunks(BLOCK_ROWS * inputs);
        for (block, columns) in blocks.zip(rows.column_r.chunks(BLOCK_ROWS)) {
            self.trace.begin(columns.len()).copy_from_slice(block);
            self.network.forward(&self.target_weights, &mut self.trace);
            let values = self.trace.outputs().chunks_exact(outputs).zip(columns);
            chosen_r.extend(values.map(|(value_c, &column)| value_c[column]));
        }
        let mut target_r = vec![0.0; chosen_r.len()];
        let (mut value_t, mut return_t) = (Vec::new(), Vec::new());
        for (b, episode) in episodes.iter().enumerate() {
            for member in 0..members {
                let row = |t: usize| rows.row([b, t], member, members);
                value_t.clear();
                value_t.extend((0..episode.steps()).map(|t| chosen_r[row(t)]));
                value_t.push(0.0);
                return_t.clear();
                return_t.resize(episode.steps(), 0.0);
                lambda_returns(returns, &episode.reward_t, &value_t, &mut return_t);
                for (t, &return_) in return_t.iter().enumerate() {
                    target_r[row(t)] = return_;
                }
            }
        }
        target_r
    }

    /// One optimiser step on some rows.
    fn update(
        &mut self,
        rows: &MemberRows,
        own: std::ops::Range<usize>,
        target_r: &[f32],
        values: &mut [f32],
    ) -> Result<CriticReport, NotFinite> {
        let MemberCriticSettings {
            inputs, outputs, ..
        } = self.settings;
        let (columns, targets) = (&rows.column_r[own.clone()], &target_r[own.clone()]);
        let count = own.len() as f64;
        self.trace
            .begin(own.len())
            .copy_from_slice(&rows.input_rf[own.start * inputs..own.end * inputs]);
        self.network.forward(&self.weights, &mut self.trace);
        let (given, gradients) = self.trace.outputs_and_gradient_mut();
        values.copy_from_slice(given);
        let chosen = given.chunks_exact(outputs).zip(columns);
        let chosen: Vec<f32> = chosen.map(|(value_c, &column)| value_c[column]).collect();
        let mut slopes = vec![0.0; chosen.len()];
        let weight = crate::Real::from_f64(1.0 / count);
        let errors = squared_errors(weight, [&chosen, targets], &mut slopes);
        if !errors.absolute.is_finite() {
            let broken = chosen.iter().position(|value| !value.is_finite());
            let row = broken.unwrap_or(0);
            return Err(NotFinite::new("critic.value", &[("row", row)], chosen[row]));
        }
        gradients.fill(0.0);
        for ((gradient_c, &column), slope) in
            gradients.chunks_exact_mut(outputs).zip(columns).zip(slopes)
        {
            gradient_c[column] = slope;
        }
        self.gradient.fill(0.0);
        self.network
            .backward(&self.weights, &mut self.trace, &mut self.gradient);
        let gradient_norm = finite_step(
            &mut self.optimiser,
            &self.layout,
            [self.settings.learning_rate, self.settings.gradient_norm_max],
            &mut self.gradient,
            &mut self.parameters,
        )?;
        self.network.refresh(&self.parameters, &mut self.weights);
        self.updates += 1;
        let target: f64 = targets.iter().map(|&target| f64::from(target)).sum();
        Ok(CriticReport {
            loss: errors.loss,
            gradient_norm,
            td_error_abs: errors.absolute / count,
            target_mean: target / count,
            // Of all rows together, which are not known here.
            explained_variance: 0.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use mackrl_env::Stream;

    use super::*;

    /// Two members whose rows say which member it is and what comes: the critic finds the discounted rewards.
    #[test]
    fn it_learns_what_each_member_can_expect() {
        let settings = MemberCriticSettings {
            inputs: 4,
            hidden: 16,
            outputs: 3,
            members: 2,
            optimiser: OptimiserKind::ADAM,
            learning_rate: 3e-3,
            gradient_norm_max: 10.0,
            returns: ReturnSettings {
                gamma: 0.5,
                lambda: 0.8,
            },
            target_interval_updates: 10,
        };
        let mut critic = MemberCritic::new(settings, &EpisodeKey::new(1, Stream::Other, 1));
        let episode = |rewards: &[f32]| Episode {
            reward_t: rewards.to_vec(),
            ..Episode::default()
        };
        let episodes = [episode(&[1.0, 2.0]), episode(&[-1.0])];
        let episodes: Vec<&Episode> = episodes.iter().collect();
        let mut rows = MemberRows::default();
        rows.begin(&episodes, &settings);
        for (b, episode) in episodes.iter().enumerate() {
            for t in 0..episode.steps() {
                for member in 0..2 {
                    let row = rows.row([b, t], member, 2);
                    rows.input_rf[row * 4 + member] = 1.0;
                    rows.input_rf[row * 4 + 2] = b as f32;
                    rows.input_rf[row * 4 + 3] = t as f32;
                    rows.column_r[row] = member + t;
                }
            }
        }
        let mut values = Vec::new();
        for _ in 0..600 {
            critic.learn(&episodes, &rows, &mut values).unwrap();
        }
        for ([b, t], expected) in [([0, 0], 2.0), ([0, 1], 2.0), ([1, 0], -1.0)] {
            for member in 0..2 {
                let row = rows.row([b, t], member, 2);
                let value = values[row * 3 + member + t];
                assert!((value - expected).abs() < 0.05, "{b} {t} {member}: {value}");
            }
        }
    }
}
