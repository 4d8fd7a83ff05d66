//! Putting a configuration together from layers.

use std::collections::BTreeMap;

use mackrl::partition::PartitionSchedule;
use serde::Deserialize;

use crate::config::{
    Config, ConfigError, EnvironmentConfig, Origin, PartitionChoice, Preset,
    document::{Leaf, SyntaxError, line_and_column, parse_assignment, parse_document},
    error::shortened,
};

/// The setting that depends on the size of the team.
const PARTITIONS: &str = "policy.partitions";

/// Lays settings over each other, later ones over earlier ones, and remembers where each came from.
///
/// Every value is checked when it is laid, so the first error is the first in reading order; ranges are checked at the end,
/// because they can depend on one another.
///
/// # Examples
/// ```
/// use mackrl_run::config::ConfigBuilder;
///
/// let config = ConfigBuilder::new()
///     .preset("paper")?
///     .file("mine.toml", "[learner]\ngamma = 0.95\n")?
///     .set("env.map=2s3z")?
///     .build()?;
/// assert_eq!(config.learner.gamma, 0.95);
/// assert_eq!(config.env.map, "2s3z");
/// # Ok::<(), mackrl_run::config::ConfigError>(())
/// ```
#[derive(Debug, Clone)]
pub struct ConfigBuilder {
    table: toml::Table,
    origins: BTreeMap<String, Origin>,
}

impl Default for ConfigBuilder {
    fn default() -> Self {
        Self::new()
    }
}

impl ConfigBuilder {
    /// Starts from the built-in values.
    #[must_use]
    pub fn new() -> Self {
        Self {
            table: Config::default().to_table(),
            origins: BTreeMap::new(),
        }
    }

    /// Lays a shipped preset over what there is.
    ///
    /// # Errors
    /// If no preset has this name.
    pub fn preset(self, name: &str) -> Result<Self, ConfigError> {
        let Preset { name, text } = Preset::named(name)?;
        self.document(text, |line, column| Origin::Preset { name, line, column })
    }

    /// Lays the TOML `text` of the file called `name` over what there is.
    ///
    /// # Errors
    /// If it is not TOML, a key is unknown or a value has the wrong type.
    pub fn file(self, name: &str, text: &str) -> Result<Self, ConfigError> {
        self.document(text, |line, column| Origin::File {
            name: name.to_owned(),
            line,
            column,
        })
    }

    /// Lays one `key=value` over what there is: a dotted key, and a TOML value or a bare word.
    ///
    /// # Errors
    /// If it has no `=`, the key is unknown or the value has the wrong type.
    pub fn set(self, assignment: &str) -> Result<Self, ConfigError> {
        self.flag(&format!("--set {assignment}"), assignment)
    }

    /// As [`ConfigBuilder::set`], for the flag `typed` that is short for it, such as `--seed 3` for `run.seed=3`.
    ///
    /// # Errors
    /// As [`ConfigBuilder::set`]; the error names `typed`.
    pub fn flag(self, typed: &str, assignment: &str) -> Result<Self, ConfigError> {
        let origin = Origin::CommandLine {
            text: shortened(typed),
        };
        self.assign(origin, assignment)
    }

    /// As [`ConfigBuilder::set`], for a value that was written at `origin`.
    ///
    /// # Errors
    /// As [`ConfigBuilder::set`]; the error names `origin`.
    pub fn assign(mut self, origin: Origin, assignment: &str) -> Result<Self, ConfigError> {
        let leaves = parse_assignment(assignment).map_err(|SyntaxError { message, .. }| {
            ConfigError::Syntax {
                origin: origin.clone(),
                message,
            }
        })?;
        for leaf in leaves {
            self.lay(leaf, origin.clone(), origin.clone())?;
        }
        Ok(self)
    }

    /// The scenario file that the map names and whose text has still to be laid with [`ConfigBuilder::scenario`], if any.
    #[must_use]
    pub fn missing_scenario(&self) -> Option<String> {
        let config = Config::deserialize(self.table.clone()).ok()?;
        config.env.missing_scenario().map(str::to_owned)
    }

    /// Lays the text of the scenario file that the map names, so that the configuration needs the file no more.
    #[must_use]
    pub fn scenario(mut self, text: &str) -> Self {
        let path = ["env", "scenario"].map(str::to_owned);
        insert(&mut self.table, &path, toml::Value::String(text.to_owned()));
        let origin = self.origin("env.map");
        self.origins.insert(path.join("."), origin);
        self
    }

    /// Checks ranges and combinations, and gives the configuration.
    ///
    /// # Errors
    /// If a value is out of its range or does not go with another.
    ///
    /// # Panics
    /// Never: every value is checked when it is laid.
    pub fn build(&self) -> Result<Config, ConfigError> {
        let mut config = self.unchecked();
        if let Some(partitions) = self.automatic_partitions() {
            config.policy.partitions = partitions;
        }
        config.validate_with(|key| self.written(key))?;
        Ok(config)
    }

    /// As [`ConfigBuilder::build`], for those who need the world alone: nobody has to be able to learn in it.
    ///
    /// # Errors
    /// If a setting of the world is out of its range or does not go with another.
    ///
    /// # Panics
    /// Never: every value is checked when it is laid.
    pub fn build_environment(&self) -> Result<EnvironmentConfig, ConfigError> {
        let Config { env, .. } = self.unchecked();
        env.validate_with(|key| self.written(key))?;
        Ok(env)
    }

    fn unchecked(&self) -> Config {
        Config::deserialize(self.table.clone()).expect("every value was checked when it was laid")
    }

    /// Where the value at `key` comes from.
    #[must_use]
    pub fn origin(&self, key: &str) -> Origin {
        if key == PARTITIONS && self.automatic_partitions().is_some() {
            return Origin::Automatic {
                why: "more than 8 agents have too many partitions to take all",
            };
        }
        self.written(key)
    }

    /// Where the value at `key` was written.
    fn written(&self, key: &str) -> Origin {
        self.origins.get(key).cloned().unwrap_or(Origin::BuiltIn)
    }

    /// The partitions of a team with too many to take all, unless somebody asked for particular ones: presets are written
    /// for small teams.
    fn automatic_partitions(&self) -> Option<PartitionChoice> {
        let config = self.unchecked();
        let was_asked = !matches!(
            self.written(PARTITIONS),
            Origin::BuiltIn | Origin::Preset { .. }
        );
        if was_asked || config.policy.partitions != PartitionChoice::All {
            return None;
        }
        let agents = config.env.world().ok()?.spec().agents;
        let too_many = agents > PartitionSchedule::MOST_AGENTS_ENUMERATED;
        too_many.then_some(PartitionChoice::RoundRobin)
    }

    fn document(
        mut self,
        text: &str,
        origin: impl Fn(usize, usize) -> Origin,
    ) -> Result<Self, ConfigError> {
        let origin_at = |at: usize| {
            let (line, column) = line_and_column(text, at);
            origin(line, column)
        };
        let leaves = parse_document(text).map_err(|error| ConfigError::Syntax {
            origin: origin_at(error.at),
            message: error.message,
        })?;
        for leaf in leaves {
            let (key_at, value_at) = (origin_at(leaf.key_at), origin_at(leaf.value_at));
            self.lay(leaf, key_at, value_at)?;
        }
        Ok(self)
    }

    /// Lays one value; the table stays deserialisable, so a failure is this value's.
    fn lay(&mut self, leaf: Leaf, key_at: Origin, value_at: Origin) -> Result<(), ConfigError> {
        let key = leaf.path.join(".");
        Config::settings_called(&key, key_at)?;
        let found = shortened(&leaf.value.to_string());
        let mut table = self.table.clone();
        insert(&mut table, &leaf.path, leaf.value);
        if let Err(error) = Config::deserialize(table.clone()) {
            return Err(ConfigError::WrongValue {
                origin: value_at,
                expected: expectation(&key, &error),
                key,
                found,
            });
        }
        self.table = table;
        self.origins.insert(key, value_at);
        Ok(())
    }
}

/// What is expected at `key`, whose value could not be read because of `error`.
fn expectation(key: &str, error: &toml::de::Error) -> String {
    let settings = Config::settings();
    match settings.iter().find(|setting| setting.key == key) {
        Some(setting) => setting.accepts.to_string(),
        None if Config::default().get(key).is_some() => "a table of settings".to_owned(),
        None => error.message().to_owned(),
    }
}

/// Puts `value` at `path`, of which all but the last name are tables: keys are checked first.
fn insert(table: &mut toml::Table, path: &[String], value: toml::Value) {
    match path {
        [] => {}
        [last] => {
            table.insert(last.clone(), value);
        }
        [parent, below @ ..] => {
            if let Some(inner) = table.get_mut(parent).and_then(toml::Value::as_table_mut) {
                insert(inner, below, value);
            }
        }
    }
}

#[cfg(test)]
mod tests;
