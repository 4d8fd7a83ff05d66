//! The settings of every learner of action values.

use mackrl_env::{
    EnvironmentSpec, declare_settings,
    settings::{Accepts, EXACT, SettingsError},
};

use crate::{
    algorithms::{
        Automatic,
        shared_settings::{Exploration, OptimiserName, at_odds},
    },
    nn::OptimiserKind,
    objectives::ReturnSettings,
};

/// What plain arrays of all episodes of a memory may take, if each lasts to the time limit. Encoded they take a sixth or less.
const PLAIN_BYTES_MAX: u64 = 16_000_000_000;
/// Episodes that are remembered in any world.
const EPISODES_LEAST: u64 = 1000;

declare_settings! {
    /// Sizes of the networks, how training explores (ε-greedy, with ε falling linearly), and how action values are learnt from
    /// remembered episodes.
    pub struct QLearningSettings {
        /// Units in each hidden layer and each recurrent state of the agents.
        hidden: usize = 64, Accepts::integer(1, 4096);
        /// ε, the probability of any available action instead of the best, at the first environment step.
        exploration_start: f64 = 1.0, Accepts::within(0.0, 1.0);
        /// ε from `algorithm.exploration_steps_env` on; at most `algorithm.exploration_start`.
        exploration_finish: f64 = 0.05, Accepts::within(0.0, 1.0);
        /// Environment steps, summed over the parallel environments, over which ε falls.
        exploration_steps_env: u64 = 50_000, Accepts::integer(1, EXACT);
        /// Episodes that are remembered; the oldest is forgotten for the next.
        memory_episodes: usize = 5000, Accepts::integer(1, 1_000_000);
        /// Episodes of a minibatch, drawn from the memory; learning begins when it holds as many.
        minibatch_episodes: usize = 32, Accepts::integer(1, 4096);
        /// Minibatches, with an optimiser step each, after every batch of new episodes.
        minibatches: u64 = 1, Accepts::integer(1, 1000);
        /// Episodes between two refreshments of the target networks.
        target_interval_episodes: u64 = 200, Accepts::integer(1, EXACT);
        /// Whether the next action is the best by the present networks, and only its value the target networks'; otherwise both are
        /// the target networks'.
        double_q: bool = true, Accepts::Flag;
        /// How parameters follow the gradient.
        optimiser: OptimiserName = OptimiserName::Rmsprop, OptimiserName::ACCEPTS;
        /// What is added to the root of the mean squared gradient before a step is divided by it.
        optimiser_epsilon: f64 = 1e-5, Accepts::above_within(0.0, 1.0);
        /// Of `rmsprop`: how much of the mean squared gradient is kept at a step. The larger, the longer its memory.
        rmsprop_smoothing: f64 = 0.99, Accepts::within(0.0, 0.999_999);
        /// Step size.
        learning_rate: f64 = 5e-4, Accepts::above_within(0.0, 1.0);
        /// Discount γ of one environment step.
        gamma: f64 = 0.99, Accepts::within(0.0, 1.0);
        /// λ of the targets: 0 looks one step ahead, 1 to the end of the episode as it was played.
        lambda: f64 = 0.0, Accepts::within(0.0, 1.0);
        /// Longest gradient (Euclidean norm over all parameters); longer ones are shortened.
        gradient_norm_max: f64 = 10.0, Accepts::above(0.0);
        /// Environments that run side by side; each gives one episode to a batch.
        environments: usize = 1, Accepts::integer(1, 4096);
        /// Pieces into which a minibatch is cut for work in parallel, and the environments as far as there are as many; as many threads
        /// as this can be used. It decides the last bits of a result, which the number of threads does not.
        shards: usize = 2, Accepts::integer(1, 4096);
        /// Whether the state at a time limit keeps its value; otherwise time running out counts as the end of the game.
        bootstrap_at_time_limit: bool = false, Accepts::Flag;
    }
}

impl QLearningSettings {
    /// How parameters follow the gradient.
    #[must_use]
    pub const fn optimiser(&self) -> OptimiserKind {
        (self.optimiser).with(self.optimiser_epsilon, self.rmsprop_smoothing)
    }

    /// How ε falls.
    pub(super) const fn exploration(&self) -> Exploration {
        Exploration {
            start: self.exploration_start,
            finish: self.exploration_finish,
            steps_env: self.exploration_steps_env,
        }
    }

    /// How far targets look.
    pub(super) const fn returns(&self) -> ReturnSettings {
        ReturnSettings {
            gamma: self.gamma,
            lambda: self.lambda,
        }
    }

    /// Checks what the range of a single setting does not say: exploration falls, and a minibatch fits into the memory.
    ///
    /// # Errors
    /// [`SettingsError::AtOdds`] if not.
    pub fn check(&self) -> Result<(), SettingsError> {
        self.exploration().check()?;
        let (drawn, kept) = (self.minibatch_episodes, self.memory_episodes);
        if drawn > kept {
            return Err(at_odds(
                ("minibatch_episodes", drawn.to_string()),
                ("memory_episodes", kept.to_string()),
            ));
        }
        Ok(())
    }
}

/// A smaller memory, where that of `table` would take many gigabytes in a world of these sizes.
pub(super) fn memory_that_fits(table: &toml::Table, spec: &EnvironmentSpec) -> Vec<Automatic> {
    let numbers = spec.agents * spec.observation_size + spec.state_size;
    let steps = (spec.episode_limit as u64).saturating_add(1);
    let bytes = steps.saturating_mul((numbers * size_of::<f32>()) as u64);
    let fits = (PLAIN_BYTES_MAX / bytes.max(1) / 100 * 100).max(EPISODES_LEAST);
    let wanted = table
        .get("memory_episodes")
        .and_then(toml::Value::as_integer);
    let value = i64::try_from(fits).unwrap_or(i64::MAX);
    if wanted.is_none_or(|wanted| wanted <= value) {
        return Vec::new();
    }
    vec![Automatic {
        name: "memory_episodes",
        value: value.into(),
        why: "more episodes of so large a team would take many gigabytes",
    }]
}

#[cfg(test)]
mod tests {
    use mackrl_env::settings::Settings;

    use super::*;

    #[test]
    fn large_teams_remember_fewer_episodes_and_small_ones_what_is_asked_for() {
        let spec = |agents: usize, observation_size: usize| EnvironmentSpec {
            name: "a world".to_owned(),
            agents,
            entities: 2 * agents,
            entity_features: 5,
            position_features: 2,
            actions: 10,
            observation_size,
            state_size: 100,
            episode_limit: 179,
            distance_scale: 1.0,
            statistics: Vec::new(),
            success: None,
        };
        let table = QLearningSettings::defaults();
        assert_eq!(memory_that_fits(&table, &spec(5, 80)), []);
        let fewer = memory_that_fits(&table, &spec(27, 285));
        // 16e9 bytes by 180 steps of 7 795 numbers.
        assert_eq!(fewer[0].value, toml::Value::Integer(2800));
        assert_eq!(fewer[0].name, "memory_episodes");
    }

    #[test]
    fn settings_that_do_not_go_together_are_refused() {
        let error = |text: &str| {
            let table = toml::from_str(text).unwrap();
            let settings = QLearningSettings::read(&table).unwrap();
            settings.check().unwrap_err().to_string()
        };
        let rising = error("exploration_start = 0.01");
        assert!(rising.contains("at most 0.01"), "{rising}");
        let larger = error("memory_episodes = 31");
        assert!(larger.contains("at most 31"), "{larger}");
    }
}
