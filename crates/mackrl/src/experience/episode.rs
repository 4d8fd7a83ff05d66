//! One episode of one environment.

use mackrl_env::{Action, AgentId, EntitySet, EpisodeEnd, Observations};

use crate::policy::Recording;

/// One episode of one environment: what was done, what it brought, and the states that a central critic may read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Episode {
    /// States \[T + 1, G\]: before each step, and after the last; empty unless recorded for learning.
    pub state_tg: Vec<f32>,
    /// What each agent observes \[T + 1, N, O\]: before each step, and after the last; empty unless recorded for a learner that asks
    /// for it ([`Actor::needs_views`](crate::policy::Actor::needs_views)).
    pub observation_tno: Vec<f32>,
    /// Which actions each agent has \[T + 1, N, A\], as `observation_tno`.
    pub available_tna: Vec<bool>,
    /// Joint actions \[T, N\].
    pub action_tn: Vec<Action>,
    /// Agents that live before each step \[T\]; empty unless recorded for learning.
    pub alive_t: Vec<EntitySet>,
    /// log p(u) of the joint action under the policy that acted \[T\], over all ways to it (eq. 5); empty unless recorded for
    /// learning.
    pub log_p_t: Vec<f32>,
    /// Rewards \[T\].
    pub reward_t: Vec<f32>,
    /// Why the episode ended; `None` while it runs.
    pub end: Option<EpisodeEnd>,
    /// How it ended \[S\], in the order in which the world declares its statistics; empty while it runs.
    pub statistics_s: Vec<f64>,
}

impl Episode {
    /// T: the number of steps played.
    #[must_use]
    pub const fn steps(&self) -> usize {
        self.reward_t.len()
    }

    /// Whether the game would have gone on, had time not run out.
    #[must_use]
    pub fn ends_by_time_limit(&self) -> bool {
        self.end == Some(EpisodeEnd::Truncated)
    }

    /// The sum of all rewards, undiscounted.
    #[must_use]
    pub fn total_reward(&self) -> f64 {
        self.reward_t.iter().map(|&reward| f64::from(reward)).sum()
    }

    /// The state \[G\] before step `t`, or after the last step for t = T.
    #[must_use]
    pub fn state(&self, t: usize) -> &[f32] {
        let size = self.state_tg.len() / (self.steps() + 1);
        &self.state_tg[t * size..(t + 1) * size]
    }

    /// The joint action \[N\] of step `t`.
    #[must_use]
    pub fn actions(&self, t: usize) -> &[Action] {
        let agents = self.action_tn.len() / self.steps().max(1);
        &self.action_tn[t * agents..(t + 1) * agents]
    }

    /// Forgets everything but the memory.
    pub(super) fn clear(&mut self) {
        self.state_tg.clear();
        self.observation_tno.clear();
        self.available_tna.clear();
        self.action_tn.clear();
        self.alive_t.clear();
        self.log_p_t.clear();
        self.reward_t.clear();
        self.end = None;
        self.statistics_s.clear();
    }

    /// Appends what environment `b` shows, as far as it will be needed: the state, and the `agents` local views if `needs_views`.
    pub(super) fn remember(
        &mut self,
        recording: Recording,
        (observations, b): (&Observations, usize),
        agents: usize,
        needs_views: bool,
    ) {
        if recording == Recording::Off {
            return;
        }
        self.state_tg.extend_from_slice(observations.state(b));
        if needs_views {
            for agent in (0..agents).map(AgentId::new) {
                let view = observations.local_view(b, agent);
                self.observation_tno.extend_from_slice(view.observation());
                self.available_tna.extend_from_slice(view.available());
            }
        }
    }
}
