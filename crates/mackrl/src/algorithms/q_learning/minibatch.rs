//! Remembered episodes side by side, as the arrays that networks and objectives read.
//!
//! Episodes are in order of falling length, so those that are still played at a time are always the first ones: no row has to
//! be looked for, and nothing is padded. Rows and steps go by time, then episode, then agent.

use super::acting::InputSizes;
use crate::experience::{EpisodeShape, RememberedEpisode};

/// Some episodes. `R` is the kind of number, `f32` but in tests.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Minibatch<R> {
    /// Episodes that show something at each time \[longest T + 1\].
    pub(super) shown_t: Vec<usize>,
    /// What each agent reads \[rows, F\].
    pub(super) input_rf: Vec<R>,
    /// \[rows, A\]
    pub(super) available_ra: Vec<bool>,
    /// \[S, N\]
    pub(super) action_sn: Vec<usize>,
    /// \[S\]
    pub(super) reward_s: Vec<R>,
    /// States before each step \[S, G\] and after it.
    pub(super) state_sg: Vec<R>,
    pub(super) next_state_sg: Vec<R>,
    /// T of each episode, and whether something comes after its last step.
    pub(super) steps_b: Vec<usize>,
    pub(super) goes_on_b: Vec<bool>,
}

impl<R> Minibatch<R> {
    /// S: the steps of all episodes.
    pub(super) fn steps(&self) -> usize {
        self.reward_s.len()
    }

    /// The first step at time `t` among all steps.
    pub(super) fn first_step(&self, t: usize) -> usize {
        self.shown_t[1..=t].iter().sum()
    }
}

impl Minibatch<f32> {
    /// Takes these episodes, whose lengths must not rise.
    pub(super) fn fill(
        &mut self,
        shape: EpisodeShape,
        episodes: &[&RememberedEpisode],
        bootstrap_at_time_limit: bool,
    ) {
        self.clear();
        let sizes = InputSizes {
            observation: shape.observation,
            agents: shape.agents,
            actions: shape.actions,
        };
        for episode in episodes {
            self.steps_b.push(episode.steps());
            self.goes_on_b
                .push(bootstrap_at_time_limit && episode.ends_by_time_limit);
        }
        let longest = self.steps_b.first().copied().unwrap_or_default();
        for t in 0..=longest {
            let shown = self.steps_b.partition_point(|&steps| steps >= t);
            self.shown_t.push(shown);
            for episode in &episodes[..shown] {
                self.show(sizes, shape, episode, t);
                if t < episode.steps() {
                    self.take_step(shape, episode, t);
                }
            }
        }
    }

    fn clear(&mut self) {
        self.shown_t.clear();
        self.input_rf.clear();
        self.available_ra.clear();
        self.action_sn.clear();
        self.reward_s.clear();
        self.state_sg.clear();
        self.next_state_sg.clear();
        self.steps_b.clear();
        self.goes_on_b.clear();
    }

    /// Appends the rows of all agents at time `t`.
    fn show(
        &mut self,
        sizes: InputSizes,
        shape: EpisodeShape,
        episode: &RememberedEpisode,
        t: usize,
    ) {
        let (agents, per_time) = (shape.agents, shape.agents * shape.actions);
        self.available_ra
            .extend_from_slice(&episode.available_tna[t * per_time..(t + 1) * per_time]);
        let first = self.input_rf.len();
        self.input_rf.resize(first + agents * sizes.total(), 0.0);
        let rows = self.input_rf[first..].chunks_exact_mut(sizes.total());
        for (agent, row) in rows.enumerate() {
            let observation = &episode.observations(shape, t)[agent * shape.observation..];
            let last_action = t
                .checked_sub(1)
                .map(|before| usize::from(episode.action_tn[before * agents + agent]));
            sizes.write(row, &observation[..shape.observation], agent, last_action);
        }
    }

    fn take_step(&mut self, shape: EpisodeShape, episode: &RememberedEpisode, t: usize) {
        let actions = &episode.action_tn[t * shape.agents..(t + 1) * shape.agents];
        let actions = actions.iter().map(|&action| usize::from(action));
        self.action_sn.extend(actions);
        self.reward_s.push(episode.reward_t[t]);
        self.state_sg.extend_from_slice(episode.state(shape, t));
        self.next_state_sg
            .extend_from_slice(episode.state(shape, t + 1));
    }
}
