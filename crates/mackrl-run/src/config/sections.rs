//! Every setting: its name, type, built-in value, accepted values and meaning.

use mackrl_env::{
    declare_settings,
    settings::{Accepts, EXACT},
};
use serde::{Deserialize, Serialize};

use crate::config::{
    Algorithm, CommonKnowledgeFeatures, ConfigError, Delegation, EnvironmentConfig, LossAverage,
    OptimiserKind, Origin, PartitionChoice, Selection, Setting,
    error::{nearest, shortened},
    settings::in_section,
};

/// Everything that determines the result of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// The world.
    pub env: EnvironmentConfig,
    /// The controllers.
    pub policy: PolicyConfig,
    /// How training explores.
    pub exploration: ExplorationConfig,
    /// How the controllers and the critic learn.
    pub learner: LearnerConfig,
    /// Greedy tests during training.
    pub test: TestConfig,
    /// Length, seed, and what is written when.
    pub run: RunConfig,
}

declare_settings! {
    /// The controllers.
    pub struct PolicyConfig {
        /// What learns: the hierarchy, or the agent controllers alone.
        algorithm: Algorithm = Algorithm::Mackrl, Accepts::OneOf(&["mackrl", "central-v"]);
        /// Which features of commonly known entities the controllers read: all of them, or those of the authors' code.
        common_knowledge: CommonKnowledgeFeatures = CommonKnowledgeFeatures::Complete, Accepts::OneOf(&["complete", "thin"]);
        /// Which partitions into pairs the pair selector chooses from. More than 8 agents have too many to take all; they take
        /// `round-robin` unless something else is asked for.
        partitions: PartitionChoice = PartitionChoice::All, PartitionChoice::ACCEPTS;
        /// How a partition is chosen: the pair selector decides, or, as an ablation, all are equally likely.
        selector: Selection = Selection::Learned, Accepts::OneOf(&["learned", "uniform"]);
        /// When pairs delegate: their controllers decide, or, as ablations, always, or only where no joint action is commonly known.
        delegation: Delegation = Delegation::Learned, Accepts::OneOf(&["learned", "always", "never"]);
        /// Units in each hidden layer and each recurrent state.
        hidden: usize = 64, Accepts::integer(1, 4096);
    }
}

declare_settings! {
    /// How training explores: p = (1 − ε)·softmax + ε·uniform for pair and agent controllers, with ε falling linearly.
    pub struct ExplorationConfig {
        /// ε, a probability, at the first environment step.
        start: f64 = 0.5, Accepts::within(0.0, 1.0);
        /// ε, a probability, from `exploration.steps_env` on; at most `exploration.start`.
        finish: f64 = 0.01, Accepts::within(0.0, 1.0);
        /// Environment steps, summed over the parallel environments, over which ε falls.
        steps_env: u64 = 50_000, Accepts::integer(1, EXACT);
    }
}

declare_settings! {
    /// How the controllers and the critic learn.
    pub struct LearnerConfig {
        /// How parameters follow the gradient, for the controllers and for the critic.
        optimiser: OptimiserKind = OptimiserKind::Adam, Accepts::OneOf(&["adam", "rmsprop"]);
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
        loss_average: LossAverage = LossAverage::Steps, Accepts::OneOf(&["steps", "slots"]);
        /// Environments that run side by side; each gives one episode to an update.
        environments: usize = 8, Accepts::integer(1, 4096);
        /// Whether the state at a time limit keeps its value; otherwise time running out counts as the end of the game.
        bootstrap_at_time_limit: bool = false, Accepts::Flag;
    }
}

declare_settings! {
    /// Greedy tests during training.
    pub struct TestConfig {
        /// Environment steps between two tests.
        interval_steps_env: u64 = 10_000, Accepts::integer(1, EXACT);
        /// Episodes of a test.
        episodes: usize = 32, Accepts::integer(1, 1_000_000);
    }
}

declare_settings! {
    /// Length and seed of a run, and what is written when.
    pub struct RunConfig {
        /// Environment steps after which training ends; the batch that reaches it is finished.
        steps_env: u64 = 1_000_000, Accepts::integer(1, EXACT);
        /// Environment steps between two rows of training metrics; tests give rows of their own.
        metrics_interval_steps_env: u64 = 2_000, Accepts::integer(1, EXACT);
        /// Environment steps between two checkpoints; one more is written at the end. Changes no result.
        checkpoint_interval_steps_env: u64 = 200_000, Accepts::integer(1, EXACT);
        /// Checkpoints that stay in the run folder; older ones are removed. Changes no result.
        checkpoints_kept: usize = 2, Accepts::integer(1, 1000);
        /// Whether a TensorBoard event file is written beside metrics.jsonl, with the same names. Changes no result.
        tensorboard: bool = false, Accepts::Flag;
        /// Seed from which every random draw of the run is derived; known to all agents.
        seed: u64 = 1, Accepts::integer(0, EXACT);
    }
}

impl Config {
    /// Every setting with its meaning and the values that it takes, in the order of the file.
    #[must_use]
    pub fn settings() -> Vec<Setting> {
        EnvironmentConfig::settings()
            .into_iter()
            .chain(in_section("policy", PolicyConfig::SETTINGS))
            .chain(in_section("exploration", ExplorationConfig::SETTINGS))
            .chain(in_section("learner", LearnerConfig::SETTINGS))
            .chain(in_section("test", TestConfig::SETTINGS))
            .chain(in_section("run", RunConfig::SETTINGS))
            .collect()
    }

    /// The keys of all settings, in the order of the file.
    pub fn keys() -> impl Iterator<Item = String> {
        Self::settings().into_iter().map(|setting| setting.key)
    }

    /// The setting called `name`, or those in the section called so.
    ///
    /// # Errors
    /// [`ConfigError::UnknownKey`] at `origin`, with the nearest key.
    pub fn settings_called(name: &str, origin: Origin) -> Result<Vec<Setting>, ConfigError> {
        let mut settings = Self::settings();
        let section = format!("{name}.");
        let is_meant = |setting: &Setting| setting.key == name || setting.key.starts_with(&section);
        if !settings.iter().any(is_meant) {
            return Err(ConfigError::UnknownKey {
                origin,
                key: shortened(name),
                nearest: nearest(name, settings.iter().map(|setting| setting.key.as_str())),
            });
        }
        settings.retain(is_meant);
        Ok(settings)
    }

    /// Checks ranges and combinations.
    ///
    /// # Errors
    /// [`ConfigError::UnknownMap`], [`ConfigError::Scenario`], or [`ConfigError::WrongValue`] with the first setting that is out of
    /// its range or does not go with another.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.validate_with(|_| Origin::Unknown)
    }

    /// As [`Config::validate`], with errors that say where a value came from.
    pub(super) fn validate_with(
        &self,
        origin_of: impl Fn(&str) -> Origin,
    ) -> Result<(), ConfigError> {
        self.env.validate_with(&origin_of)?;
        for (section, violation) in [
            ("policy", self.policy.violation()),
            ("exploration", self.exploration.violation()),
            ("learner", self.learner.violation()),
            ("test", self.test.violation()),
            ("run", self.run.violation()),
        ] {
            if let Some(violation) = violation {
                return Err(ConfigError::violation(section, violation, origin_of));
            }
        }
        self.validate_exploration(&origin_of)?;
        self.validate_team(&origin_of)
    }

    fn validate_exploration(&self, origin_of: &impl Fn(&str) -> Origin) -> Result<(), ConfigError> {
        let ExplorationConfig { start, finish, .. } = self.exploration;
        if finish <= start {
            return Ok(());
        }
        Err(ConfigError::at_odds(
            origin_of,
            (
                "exploration.finish",
                format!("{finish:?}"),
                format!("at most {start:?}, which is exploration.start"),
            ),
            (
                "exploration.start",
                format!("{start:?}"),
                format!("at least {finish:?}, which is exploration.finish"),
            ),
        ))
    }

    /// Checks that the team has the partitions from which the pair selector shall choose.
    fn validate_team(&self, origin_of: &impl Fn(&str) -> Origin) -> Result<(), ConfigError> {
        if self.policy.algorithm != Algorithm::Mackrl {
            return Ok(());
        }
        let world = self
            .env
            .simulated()
            .world()
            .map_err(|error| ConfigError::Scenario {
                message: error.to_string(),
            })?;
        let agents = world.spec().agents;
        let Some(expected) = self.policy.partitions.expected_of(agents) else {
            return Ok(());
        };
        let key = "policy.partitions";
        Err(ConfigError::WrongValue {
            origin: origin_of(key),
            key: key.to_owned(),
            found: format!("\"{}\"", self.policy.partitions),
            expected: format!("{expected} for the {agents} agents of {}", self.env.map),
        })
    }

    /// The value at a dotted key, if it is set.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<toml::Value> {
        let table = toml::Value::Table(self.to_table());
        key.split('.')
            .try_fold(&table, |value, name| value.get(name))
            .cloned()
    }

    /// The same settings as a table. Numbers are those that a reader of the file sees: 0.02, not the nearest number of single
    /// precision.
    ///
    /// # Panics
    /// If an integer is beyond 2⁶³, which [`Config::validate`] refuses.
    #[must_use]
    pub fn to_table(&self) -> toml::Table {
        let text = self.to_toml();
        toml::from_str(&text).expect("what was written can be read")
    }

    /// The same settings as TOML, in the order of declaration.
    ///
    /// # Panics
    /// If an integer is beyond 2⁶³, which [`Config::validate`] refuses.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a valid configuration can be written")
    }
}
