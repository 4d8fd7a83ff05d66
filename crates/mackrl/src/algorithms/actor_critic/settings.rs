//! The settings of every learner that has controllers and one central critic, and learns on policy.

use mackrl_env::{
    declare_settings, declare_words,
    settings::{Accepts, EXACT, SettingsError, WrongSetting},
};

use crate::{
    critics::CriticSettings,
    nn::OptimiserKind,
    objectives::{LossAverage, ReturnSettings},
};

declare_words! {
    /// How parameters follow the gradient.
    pub enum OptimiserName {
        /// Adam (Kingma and Ba, 2015), as the paper says.
        #[default]
        Adam = "adam",
        /// `RMSprop`, as the authors' code.
        Rmsprop = "rmsprop",
    }
}

impl From<OptimiserName> for OptimiserKind {
    fn from(name: OptimiserName) -> Self {
        match name {
            OptimiserName::Adam => Self::ADAM,
            OptimiserName::Rmsprop => Self::RMSPROP,
        }
    }
}

declare_settings! {
    /// Sizes of the networks, how training explores (p = (1 − ε)·softmax + ε·uniform, with ε falling linearly), and how the
    /// controllers and the critic learn.
    pub struct ActorCriticSettings {
        /// Units in each hidden layer and each recurrent state.
        hidden: usize = 64, Accepts::integer(1, 4096);
        /// ε, a probability, at the first environment step.
        exploration_start: f64 = 0.5, Accepts::within(0.0, 1.0);
        /// ε, a probability, from `algorithm.exploration_steps_env` on; at most `algorithm.exploration_start`.
        exploration_finish: f64 = 0.01, Accepts::within(0.0, 1.0);
        /// Environment steps, summed over the parallel environments, over which ε falls.
        exploration_steps_env: u64 = 50_000, Accepts::integer(1, EXACT);
        /// How parameters follow the gradient, for the controllers and for the critic.
        optimiser: OptimiserName = OptimiserName::Adam, OptimiserName::ACCEPTS;
        /// Step size of the controllers.
        learning_rate: f64 = 5e-4, Accepts::above_within(0.0, 1.0);
        /// Step size of the critic.
        critic_learning_rate: f64 = 5e-4, Accepts::above_within(0.0, 1.0);
        /// Discount γ of one environment step.
        gamma: f64 = 0.99, Accepts::within(0.0, 1.0);
        /// λ of the critic's TD(λ) targets: 0 looks one step ahead, 1 to the end of the episode.
        lambda: f64 = 0.8, Accepts::within(0.0, 1.0);
        /// Critic updates between two refreshments of the target critic.
        target_interval_updates: u64 = 200, Accepts::integer(1, EXACT);
        /// Longest gradient (Euclidean norm over all parameters of the policy, or of the critic); longer ones are shortened.
        gradient_norm_max: f64 = 10.0, Accepts::above(0.0);
        /// What a step counts for in the policy's loss: all steps of a batch alike, or, as in the authors' code, those of each time
        /// slot together as much as those of another, so that late steps of long episodes count for more.
        loss_average: LossAverage = LossAverage::Steps, LossAverage::ACCEPTS;
        /// Weight τ of the entropy of the joint action beside the return; 0 is the paper's objective (eq. 6). Advantages are of the
        /// size of rewards, so that useful weights are small: .001 and less.
        entropy_weight: f64 = 0.0, Accepts::within(0.0, 1.0);
        /// Environments that run side by side; each gives one episode to an update.
        environments: usize = 8, Accepts::integer(1, 4096);
        /// Pieces into which the environments are cut for work in parallel; as many threads as this can be used. It decides the
        /// last bits of a result, which the number of threads does not.
        shards: usize = 2, Accepts::integer(1, 4096);
        /// Whether the state at a time limit keeps its value; otherwise time running out counts as the end of the game.
        bootstrap_at_time_limit: bool = false, Accepts::Flag;
    }
}

impl ActorCriticSettings {
    /// How the critic learns.
    #[must_use]
    pub fn critic(&self) -> CriticSettings {
        CriticSettings {
            hidden: self.hidden,
            optimiser: self.optimiser.into(),
            learning_rate: self.critic_learning_rate,
            gradient_norm_max: self.gradient_norm_max,
            returns: ReturnSettings {
                gamma: self.gamma,
                lambda: self.lambda,
            },
            target_interval_updates: self.target_interval_updates,
            bootstrap_at_time_limit: self.bootstrap_at_time_limit,
        }
    }

    /// ε of the bounded softmax after so many environment steps: it falls linearly.
    #[must_use]
    pub fn exploration(&self, steps_env: u64) -> f64 {
        let progress = (steps_env as f64 / self.exploration_steps_env as f64).min(1.0);
        self.exploration_start + (self.exploration_finish - self.exploration_start) * progress
    }

    /// Checks what the range of a single setting does not say: exploration falls.
    ///
    /// # Errors
    /// [`SettingsError::AtOdds`] if it rises.
    pub fn check(&self) -> Result<(), SettingsError> {
        let (start, finish) = (self.exploration_start, self.exploration_finish);
        if finish <= start {
            return Ok(());
        }
        let wrong = |name: &str, found: f64, expected| WrongSetting {
            name: name.to_owned(),
            found: format!("{found:?}"),
            expected,
            nearest: None,
        };
        Err(SettingsError::AtOdds(Box::new([
            wrong(
                "exploration_finish",
                finish,
                format!("at most {start:?}, which is algorithm.exploration_start"),
            ),
            wrong(
                "exploration_start",
                start,
                format!("at least {finish:?}, which is algorithm.exploration_finish"),
            ),
        ])))
    }
}

#[cfg(test)]
mod tests {
    use mackrl_env::settings::Settings;

    use super::*;

    #[test]
    fn exploration_falls_linearly_and_then_stays() {
        let settings = ActorCriticSettings::default();
        for (steps, expected) in [(0, 0.5), (25_000, 0.255), (50_000, 0.01), (1_000_000, 0.01)] {
            let found = settings.exploration(steps);
            assert!((found - expected).abs() < 1e-12, "{steps}: {found}");
        }
    }

    #[test]
    fn exploration_that_rises_is_refused() {
        let table = toml::from_str("exploration_finish = 0.9").unwrap();
        let error = ActorCriticSettings::read(&table).unwrap().check();
        let error = error.unwrap_err().to_string();
        assert!(error.contains("at most 0.5"), "{error}");
    }
}
