//! The settings of every learner that has controllers and one central critic, and learns on policy.

use mackrl_env::{
    declare_settings,
    settings::{Accepts, EXACT, SettingsError},
};

use crate::{
    algorithms::shared_settings::{Exploration, OptimiserName},
    critics::{CriticMinibatch, CriticSettings},
    nn::OptimiserKind,
    objectives::{LossAverage, ReturnSettings},
};

declare_settings! {
    /// Sizes of the networks, how training explores (p = (1 − ε)·softmax + ε·uniform, with ε falling linearly), and how the
    /// controllers and the critic learn.
    pub struct ActorCriticSettings {
        /// Units in each hidden layer and each recurrent state.
        hidden: usize = 64, Accepts::integer(1, 4096);
        /// Units in the critic's hidden layer; 0: as many as `algorithm.hidden`.
        critic_hidden: usize = 0, Accepts::integer(0, 4096);
        /// ε, a probability, at the first environment step.
        exploration_start: f64 = 0.5, Accepts::within(0.0, 1.0);
        /// ε, a probability, from `algorithm.exploration_steps_env` on; at most `algorithm.exploration_start`.
        exploration_finish: f64 = 0.01, Accepts::within(0.0, 1.0);
        /// Environment steps, summed over the parallel environments, over which ε falls.
        exploration_steps_env: u64 = 50_000, Accepts::integer(1, EXACT);
        /// How parameters follow the gradient, for the controllers and for the critic.
        optimiser: OptimiserName = OptimiserName::Adam, OptimiserName::ACCEPTS;
        /// What is added to the root of the mean squared gradient before a step is divided by it: a parameter whose gradients have long
        /// been smaller than this moves less than the step size.
        optimiser_epsilon: f64 = 1e-8, Accepts::above_within(0.0, 1.0);
        /// Of `rmsprop`: how much of the mean squared gradient is kept at a step. The larger, the longer its memory.
        rmsprop_smoothing: f64 = 0.99, Accepts::within(0.0, 0.999_999);
        /// Step size of the controllers.
        learning_rate: f64 = 5e-4, Accepts::above_within(0.0, 1.0);
        /// Step size of the critic.
        critic_learning_rate: f64 = 5e-4, Accepts::above_within(0.0, 1.0);
        /// Discount γ of one environment step.
        gamma: f64 = 0.99, Accepts::within(0.0, 1.0);
        /// λ of the critic's TD(λ) targets: 0 looks one step ahead, 1 to the end of the episode.
        lambda: f64 = 0.8, Accepts::within(0.0, 1.0);
        /// The states on which the critic takes one optimiser step: those of one time, from the last time to the first, or all of the
        /// batch.
        critic_minibatch: CriticMinibatch = CriticMinibatch::Time, CriticMinibatch::ACCEPTS;
        /// How often the critic goes through a batch before the policy learns from it. The authors' configurations ask for 60 (3m: 40)
        /// repetitions, and their released code has the loop commented out.
        critic_sweeps: u64 = 1, Accepts::integer(1, 1000);
        /// λ of the advantages: 0 looks one step ahead, as the paper does (eq. 6); above it, they are generalised advantages (GAE).
        advantage_lambda: f64 = 0.0, Accepts::within(0.0, 1.0);
        /// Critic updates between two refreshments of the target critic.
        target_interval_updates: u64 = 200, Accepts::integer(1, EXACT);
        /// Longest gradient (Euclidean norm over all parameters of the policy, or of the critic); longer ones are shortened.
        gradient_norm_max: f64 = 10.0, Accepts::above(0.0);
        /// Longest update of the controllers, as the root mean square over all parameters of what the step size multiplies; longer ones are
        /// shortened. Usual updates have .2 to 1, some with large gradients after a calm more. 0: no bound, as in the authors' code.
        update_length_max: f64 = 0.0, Accepts::within(0.0, 1000.0);
        /// What a step counts for in the policy's loss: all steps of a batch alike, or, as in the authors' code, those of each time
        /// slot together as much as those of another, so that late steps of long episodes count for more; a buffer has one slot more
        /// than the time limit, so that batches of short episodes count for less.
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
    /// How parameters follow the gradient.
    #[must_use]
    pub const fn optimiser(&self) -> OptimiserKind {
        (self.optimiser).with(self.optimiser_epsilon, self.rmsprop_smoothing)
    }

    /// How the critic learns.
    #[must_use]
    pub fn critic(&self) -> CriticSettings {
        CriticSettings {
            hidden: match self.critic_hidden {
                0 => self.hidden,
                own => own,
            },
            optimiser: self.optimiser(),
            learning_rate: self.critic_learning_rate,
            gradient_norm_max: self.gradient_norm_max,
            returns: ReturnSettings {
                gamma: self.gamma,
                lambda: self.lambda,
            },
            minibatch: self.critic_minibatch,
            sweeps: self.critic_sweeps,
            advantage_lambda: self.advantage_lambda,
            target_interval_updates: self.target_interval_updates,
            bootstrap_at_time_limit: self.bootstrap_at_time_limit,
        }
    }

    /// How ε falls.
    pub(super) const fn exploration(&self) -> Exploration {
        Exploration {
            start: self.exploration_start,
            finish: self.exploration_finish,
            steps_env: self.exploration_steps_env,
        }
    }

    /// Checks what the range of a single setting does not say: exploration falls.
    ///
    /// # Errors
    /// [`SettingsError::AtOdds`] if it rises.
    pub fn check(&self) -> Result<(), SettingsError> {
        self.exploration().check()
    }
}

#[cfg(test)]
mod tests {
    use mackrl_env::settings::Settings;

    use super::*;

    #[test]
    fn exploration_that_rises_is_refused() {
        let table = toml::from_str("exploration_finish = 0.9").unwrap();
        let error = ActorCriticSettings::read(&table).unwrap().check();
        let error = error.unwrap_err().to_string();
        assert!(error.contains("at most 0.5"), "{error}");
    }
}
