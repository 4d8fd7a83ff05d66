//! A value of each member's choice or situation: a row for each member at each step.
//!
//! Targets are λ-returns of a copy of the network, refreshed now and then; the last state of an episode is worth nothing. One column
//! is the value of the situation (IAC), one for each action that of the member's action (COMA).

use mackrl_env::EpisodeKey;

use super::{
    ChoiceCritic, ChoiceCriticSettings, ChoiceRows, CriticReport, CriticState, choices::chosen,
    write_along_members,
};
use crate::{
    NotFinite,
    experience::Episode,
    nn::{FeedForwardWeights, ParameterLayout},
    objectives::{ReturnSettings, lambda_returns},
};

/// Rows whose targets are computed together, so that what is computed of them stays in the cache.
const BLOCK_ROWS: usize = 512;

/// Sizes of a [`MemberCritic`], and how it learns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MemberCriticSettings {
    /// Of the network.
    pub choices: ChoiceCriticSettings,
    /// N: members.
    pub members: usize,
    /// How far targets look.
    pub returns: ReturnSettings,
    /// Updates between two refreshments of the target copy.
    pub target_interval_updates: u64,
}

/// The values of a team's members.
#[derive(Debug)]
pub struct MemberCritic {
    settings: MemberCriticSettings,
    critic: ChoiceCritic,
    target_parameters: Vec<f32>,
    target_weights: FeedForwardWeights<f32>,
    target_r: Vec<f32>,
    updates: u64,
    updates_at_refresh: u64,
}

/// The rows of a batch of episodes, by time, then episode, then member.
#[derive(Debug, Clone, Default)]
pub struct MemberRows {
    /// What is read, and what was done.
    pub rows: ChoiceRows,
    /// The number of each step of each episode \[B\]\[T\].
    step_bt: Vec<Vec<usize>>,
}

impl MemberRows {
    /// Makes room for these episodes: inputs are zero and all columns 0 until they are written.
    pub fn begin(&mut self, episodes: &[&Episode], settings: &MemberCriticSettings) {
        let longest = episodes.iter().map(|episode| episode.steps()).max();
        self.step_bt.clear();
        self.step_bt.resize_with(episodes.len(), Vec::new);
        let mut steps = 0;
        let counts = (0..longest.unwrap_or(0)).map(|t| {
            let first = steps;
            for (step_t, episode) in self.step_bt.iter_mut().zip(episodes) {
                if t < episode.steps() {
                    step_t.push(steps);
                    steps += 1;
                }
            }
            (steps - first) * settings.members
        });
        self.rows.begin(counts, settings.choices.inputs);
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
        let critic = ChoiceCritic::new(settings.choices, key);
        Self {
            settings,
            target_parameters: critic.parameters().to_vec(),
            target_weights: critic.network.weights(critic.parameters()),
            target_r: Vec::new(),
            critic,
            updates: 0,
            updates_at_refresh: 0,
        }
    }

    /// Its sizes, and how it learns.
    #[must_use]
    pub const fn settings(&self) -> &MemberCriticSettings {
        &self.settings
    }

    /// Names and shapes of the parameters.
    #[must_use]
    pub const fn layout(&self) -> &ParameterLayout {
        self.critic.layout()
    }

    /// The parameters.
    #[must_use]
    pub fn parameters(&self) -> &[f32] {
        self.critic.parameters()
    }

    /// The targets of the latest batch \[steps · N\].
    #[must_use]
    pub fn target_r(&self) -> &[f32] {
        &self.target_r
    }

    /// Takes other parameters.
    ///
    /// # Panics
    /// If there are not as many as the layout says.
    pub fn load(&mut self, parameters: &[f32]) {
        self.critic.load(parameters);
    }

    /// What a checkpoint must hold.
    #[must_use]
    pub fn state(&self) -> CriticState {
        CriticState {
            parameters: self.critic.parameters().to_vec(),
            target_parameters: self.target_parameters.clone(),
            moments: self.critic.moments().clone(),
            updates: self.updates,
            updates_at_refresh: self.updates_at_refresh,
        }
    }

    /// Continues from a checkpoint.
    ///
    /// # Panics
    /// If the state is that of a critic of another size or optimiser.
    pub fn restore(&mut self, state: CriticState) {
        self.critic.load(&state.parameters);
        self.critic.restore_moments(state.moments);
        let target = &state.target_parameters;
        self.critic
            .network
            .refresh(target, &mut self.target_weights);
        self.target_parameters = state.target_parameters;
        self.updates = state.updates;
        self.updates_at_refresh = state.updates_at_refresh;
    }

    /// Learns from a batch as [`ChoiceCritic::learn`] does, and writes what it gave for each row when its step came.
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
            let parameters = self.critic.parameters();
            self.target_parameters.copy_from_slice(parameters);
            let network = &self.critic.network;
            network.refresh(parameters, &mut self.target_weights);
            self.updates_at_refresh = self.updates;
        }
        self.write_targets(episodes, rows);
        let report = self.critic.learn(&rows.rows, &self.target_r, value_rc)?;
        let times = episodes.iter().map(|episode| episode.steps()).max();
        self.updates += times.unwrap_or(0) as u64;
        Ok(report)
    }

    /// Computes the λ-returns of all rows.
    fn write_targets(&mut self, episodes: &[&Episode], rows: &MemberRows) {
        let MemberCriticSettings {
            choices,
            members,
            returns,
            ..
        } = self.settings;
        let critic = &mut self.critic;
        let mut chosen_r: Vec<f32> = Vec::with_capacity(rows.rows.len());
        let blocks = rows.rows.input_rf.chunks(BLOCK_ROWS * choices.inputs);
        for (block, columns) in blocks.zip(rows.rows.column_r.chunks(BLOCK_ROWS)) {
            critic.trace.begin(columns.len()).copy_from_slice(block);
            critic
                .network
                .forward(&self.target_weights, &mut critic.trace);
            chosen_r.extend(chosen(critic.trace.outputs(), choices.outputs, columns));
        }
        self.target_r.clear();
        self.target_r.resize(chosen_r.len(), 0.0);
        write_along_members(
            episodes.iter().copied(),
            members,
            |step, member| rows.row(step, member, members),
            |row| chosen_r[row],
            |reward_t, value_t, return_t| lambda_returns(returns, reward_t, value_t, return_t),
            &mut self.target_r,
        );
    }
}

#[cfg(test)]
mod tests {
    use mackrl_env::Stream;

    use super::*;
    use crate::nn::OptimiserKind;

    /// Two members whose rows say which member it is and what comes: the critic finds the discounted rewards.
    #[test]
    fn it_learns_what_each_member_can_expect() {
        let settings = MemberCriticSettings {
            choices: ChoiceCriticSettings {
                name: "critic",
                inputs: 4,
                hidden: 16,
                outputs: 3,
                optimiser: OptimiserKind::ADAM,
                learning_rate: 3e-3,
                gradient_norm_max: 10.0,
            },
            members: 2,
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
                    rows.rows.input_rf[row * 4 + member] = 1.0;
                    rows.rows.input_rf[row * 4 + 2] = b as f32;
                    rows.rows.input_rf[row * 4 + 3] = t as f32;
                    rows.rows.column_r[row] = member + t;
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
