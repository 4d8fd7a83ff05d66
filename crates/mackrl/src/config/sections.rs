//! Every setting: its name, type, built-in value, accepted range and meaning.

use serde::{Deserialize, Serialize};

use crate::config::{
    Algorithm, CommonKnowledgeFeatures, ConfigError, Delegation, EnvironmentConfig, OptimiserKind,
    Origin, PartitionChoice, Selection, Setting,
    settings::{Violation, section},
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

section! {
    /// The controllers.
    "policy" PolicyConfig {
        /// What learns: the hierarchy, or the agent controllers alone.
        algorithm: Algorithm = Algorithm::Mackrl, "`mackrl` or `central-v`", |_| true;
        /// Which features of commonly known entities the controllers read: all of them, or those of the authors' code.
        common_knowledge: CommonKnowledgeFeatures = CommonKnowledgeFeatures::Complete, "`complete` or `thin`", |_| true;
        /// Which partitions into pairs the pair selector chooses from. More than 8 agents have too many to take all; they take
        /// `round-robin` unless something else is asked for.
        partitions: PartitionChoice = PartitionChoice::All, "`all`, `round-robin` or `sampled:K` with K >= 1", |_| true;
        /// How a partition is chosen: the pair selector decides, or, as an ablation, all are equally likely.
        selector: Selection = Selection::Learned, "`learned` or `uniform`", |_| true;
        /// When pairs delegate: their controllers decide, or, as ablations, always, or only where no joint action is commonly known.
        delegation: Delegation = Delegation::Learned, "`learned`, `always` or `never`", |_| true;
        /// Units in each hidden layer and each recurrent state.
        hidden: usize = 64, "an integer in [1, 4096]", |units| (1..=4096).contains(units);
    }
}

section! {
    /// How training explores: p = (1 − ε)·softmax + ε·uniform for pair and agent controllers, with ε falling linearly.
    "exploration" ExplorationConfig {
        /// ε at the first environment step.
        start: f64 = 0.5, "a number in [0, 1]", |epsilon| (0.0..=1.0).contains(epsilon);
        /// ε from `exploration.steps_env` on; at most `exploration.start`.
        finish: f64 = 0.01, "a number in [0, exploration.start]", |epsilon| (0.0..=1.0).contains(epsilon);
        /// Environment steps, summed over the parallel environments, over which ε falls.
        steps_env: u64 = 50_000, "an integer in [1, 2^53]", |steps| (1..=EXACT).contains(steps);
    }
}

section! {
    /// How the controllers and the critic learn.
    "learner" LearnerConfig {
        /// How parameters follow the gradient, for the controllers and for the critic.
        optimiser: OptimiserKind = OptimiserKind::Adam, "`adam` or `rmsprop`", |_| true;
        /// Step size of the controllers.
        learning_rate: f64 = 5e-4, "a number in (0, 1]", |rate| *rate > 0.0 && *rate <= 1.0;
        /// Step size of the critic.
        critic_learning_rate: f64 = 5e-4, "a number in (0, 1]", |rate| *rate > 0.0 && *rate <= 1.0;
        /// Discount γ of one environment step.
        gamma: f64 = 0.99, "a number in [0, 1]", |gamma| (0.0..=1.0).contains(gamma);
        /// λ of the critic's TD(λ) targets: 0 looks one step ahead, 1 to the end of the episode.
        lambda: f64 = 0.8, "a number in [0, 1]", |lambda| (0.0..=1.0).contains(lambda);
        /// Critic updates between two refreshments of the target critic.
        target_interval_updates: u64 = 200, "an integer in [1, 2^53]", |updates| (1..=EXACT).contains(updates);
        /// Longest gradient (Euclidean norm over all parameters of the policy, or of the critic); longer ones are shortened.
        gradient_norm_max: f64 = 10.0, "a finite number > 0", |norm| *norm > 0.0 && norm.is_finite();
        /// Environments that run side by side; each gives one episode to an update.
        environments: usize = 8, "an integer in [1, 4096]", |environments| (1..=4096).contains(environments);
        /// Whether the state at a time limit keeps its value; otherwise time running out counts as the end of the game.
        bootstrap_at_time_limit: bool = false, "`true` or `false`", |_| true;
    }
}

section! {
    /// Greedy tests during training.
    "test" TestConfig {
        /// Environment steps between two tests.
        interval_steps_env: u64 = 10_000, "an integer in [1, 2^53]", |steps| (1..=EXACT).contains(steps);
        /// Episodes of a test.
        episodes: usize = 32, "an integer in [1, 1000000]", |episodes| (1..=1_000_000).contains(episodes);
    }
}

section! {
    /// Length and seed of a run, and what is written when.
    "run" RunConfig {
        /// Environment steps after which training ends; the batch that reaches it is finished.
        steps_env: u64 = 1_000_000, "an integer in [1, 2^53]", |steps| (1..=EXACT).contains(steps);
        /// Environment steps between two rows of training metrics; tests give rows of their own.
        metrics_interval_steps_env: u64 = 2_000, "an integer in [1, 2^53]", |steps| (1..=EXACT).contains(steps);
        /// Environment steps between two checkpoints; one more is written at the end. Changes no result.
        checkpoint_interval_steps_env: u64 = 200_000, "an integer in [1, 2^53]", |steps| (1..=EXACT).contains(steps);
        /// Checkpoints that stay in the run folder; older ones are removed. Changes no result.
        checkpoints_kept: usize = 2, "an integer in [1, 1000]", |kept| (1..=1000).contains(kept);
        /// Seed from which every random draw of the run is derived; known to all agents.
        seed: u64 = 1, "an integer in [0, 2^53]", |seed| (0..=EXACT).contains(seed);
    }
}

/// 2⁵³: up to here every reader of TOML and JSON keeps integers exactly, those that hold them as f64 included.
const EXACT: u64 = 1 << 53;

impl Config {
    /// Every setting of the run with its meaning and its range, in the order of the file; those of the map, below `env`, are
    /// explained where the map's world declares them.
    #[must_use]
    pub fn settings() -> Vec<Setting> {
        [
            EnvironmentConfig::SETTINGS,
            PolicyConfig::SETTINGS,
            ExplorationConfig::SETTINGS,
            LearnerConfig::SETTINGS,
            TestConfig::SETTINGS,
            RunConfig::SETTINGS,
        ]
        .concat()
    }

    /// Every dotted key, in the order of the file.
    ///
    /// # Panics
    /// Never: built-in settings are a table.
    #[must_use]
    pub fn keys() -> Vec<String> {
        let declared = Self::settings().into_iter();
        let (mut env, others): (Vec<_>, Vec<_>) = declared
            .map(|setting| setting.key.to_owned())
            .partition(|key| key.starts_with("env."));
        env.extend(EnvironmentConfig::map_keys());
        env.extend(others);
        env
    }

    /// Checks ranges and combinations.
    ///
    /// # Errors
    /// [`ConfigError::UnknownMap`], or [`ConfigError::WrongValue`] with the first setting that is out of its range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.validate_with(|_| Origin::Unknown)
    }

    /// As [`Config::validate`], with errors that say where a value came from.
    pub(super) fn validate_with(
        &self,
        origin_of: impl Fn(&str) -> Origin,
    ) -> Result<(), ConfigError> {
        self.env.validate_with(&origin_of)?;
        let Some(violation) = self.violations().into_iter().next() else {
            return Ok(());
        };
        Err(ConfigError::WrongValue {
            origin: origin_of(violation.key),
            key: violation.key.to_owned(),
            found: self
                .get(violation.key)
                .map_or_else(String::new, |value| value.to_string()),
            expected: violation.expects.to_owned(),
        })
    }

    fn violations(&self) -> Vec<Violation> {
        let mut violations = [
            self.policy.violations(),
            self.exploration.violations(),
            self.learner.violations(),
            self.test.violations(),
            self.run.violations(),
        ]
        .concat();
        if self.exploration.finish > self.exploration.start {
            violations.push(Violation {
                key: "exploration.finish",
                expects: "a number in [0, exploration.start]",
            });
        }
        violations
    }

    /// The value at a dotted key, if it is set.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<toml::Value> {
        let table = toml::Value::Table(self.to_table());
        key.split('.')
            .try_fold(&table, |value, name| value.get(name))
            .cloned()
    }

    /// The same settings as a table.
    ///
    /// # Panics
    /// If an integer is beyond 2⁶³, which [`Config::validate`] refuses.
    #[must_use]
    pub fn to_table(&self) -> toml::Table {
        toml::Table::try_from(self).expect("a valid configuration is a table")
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
