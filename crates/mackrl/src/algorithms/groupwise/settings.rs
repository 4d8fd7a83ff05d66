//! The settings of IAC, COMA and MACKRL-COMA.

use mackrl_env::{
    EnvironmentSpec, declare_settings,
    settings::{Accepts, EXACT, SettingsError},
};

use super::Judge;
use crate::{
    algorithms::shared_settings::{Exploration, OptimiserName},
    critics::{ChoiceCriticSettings, MemberCriticSettings},
    nn::OptimiserKind,
    objectives::ReturnSettings,
};

declare_settings! {
    /// Sizes of the networks, how training explores (p = (1 − ε)·softmax + ε·uniform, with ε falling linearly), and how the
    /// controllers and the critics learn.
    pub struct GroupwiseSettings {
        /// Units in each hidden layer and each recurrent state.
        hidden: usize = 64, Accepts::integer(1, 4096);
        /// Units in each of a critic's two hidden layers.
        critic_hidden: usize = 128, Accepts::integer(1, 4096);
        /// ε, a probability, at the first environment step.
        exploration_start: f64 = 0.5, Accepts::within(0.0, 1.0);
        /// ε, a probability, from `algorithm.exploration_steps_env` on; at most `algorithm.exploration_start`.
        exploration_finish: f64 = 0.01, Accepts::within(0.0, 1.0);
        /// Environment steps, summed over the parallel environments, over which ε falls.
        exploration_steps_env: u64 = 100_000, Accepts::integer(1, EXACT);
        /// How parameters follow the gradient, for the controllers and for the critic.
        optimiser: OptimiserName = OptimiserName::Rmsprop, OptimiserName::ACCEPTS;
        /// What is added to the root of the mean squared gradient before a step is divided by it.
        optimiser_epsilon: f64 = 1e-5, Accepts::above_within(0.0, 1.0);
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
        /// Critic updates between two refreshments of the target critic.
        target_interval_updates: u64 = 200, Accepts::integer(1, EXACT);
        /// Longest gradient (Euclidean norm over all parameters of the policy, or of the critic); longer ones are shortened.
        gradient_norm_max: f64 = 10.0, Accepts::above(0.0);
        /// Environments that run side by side; each gives one episode to an update.
        environments: usize = 8, Accepts::integer(1, 4096);
        /// Pieces into which the environments are cut for work in parallel; as many threads as this can be used. It decides the
        /// last bits of a result, which the number of threads does not.
        shards: usize = 2, Accepts::integer(1, 4096);
    }
}

impl GroupwiseSettings {
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

    /// The critic of a team's members: of each, what it reads itself and what the judge adds.
    pub(super) fn critic<J: Judge>(&self, spec: &EnvironmentSpec) -> MemberCriticSettings {
        MemberCriticSettings {
            choices: self.choices::<J>("critic", 1, spec),
            members: spec.agents,
            returns: ReturnSettings {
                gamma: self.gamma,
                lambda: self.lambda,
            },
            target_interval_updates: self.target_interval_updates,
        }
    }

    /// The critic of pairs: of each, what both members read and what the judge adds.
    pub(super) fn pair_critic<J: Judge>(&self, spec: &EnvironmentSpec) -> ChoiceCriticSettings {
        self.choices::<J>("pair_critic", 2, spec)
    }

    fn choices<J: Judge>(
        &self,
        name: &'static str,
        size: usize,
        spec: &EnvironmentSpec,
    ) -> ChoiceCriticSettings {
        let own = spec.observation_size + spec.agents + spec.actions;
        let choices = (0..size).fold(1, |product, _| product * spec.actions);
        ChoiceCriticSettings {
            name,
            inputs: size * own + J::inputs(spec),
            hidden: self.critic_hidden,
            outputs: J::ADVANTAGE.outputs(choices),
            optimiser: self.optimiser(),
            learning_rate: self.critic_learning_rate,
            gradient_norm_max: self.gradient_norm_max,
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
