//! Putting a configuration together from layers.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::config::{
    Config, ConfigError, Origin, Preset, Setting,
    document::{Leaf, SyntaxError, line_and_column, parse_assignment, parse_document},
    error::nearest,
};

/// Lays settings over each other, later ones over earlier ones, and remembers where each came from.
///
/// Every value is checked when it is laid, so the first error is the first in reading order; ranges are checked at the end,
/// because they can depend on one another.
///
/// # Examples
/// ```
/// use mackrl::config::ConfigBuilder;
///
/// let config = ConfigBuilder::new()
///     .preset("paper")?
///     .file("mine.toml", "[learner]\ngamma = 0.95\n")?
///     .set("env.map=2s3z")?
///     .build()?;
/// assert_eq!(config.learner.gamma, 0.95);
/// assert_eq!(config.env.map, "2s3z");
/// # Ok::<(), mackrl::config::ConfigError>(())
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
    pub fn flag(mut self, typed: &str, assignment: &str) -> Result<Self, ConfigError> {
        let origin = Origin::CommandLine {
            text: typed.to_owned(),
        };
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

    /// Checks ranges and gives the configuration.
    ///
    /// # Errors
    /// If a value is out of its range or does not go with another.
    ///
    /// # Panics
    /// Never: every value is checked when it is laid.
    pub fn build(&self) -> Result<Config, ConfigError> {
        let config = Config::deserialize(self.table.clone())
            .expect("every value was checked when it was laid");
        config.validate_with(|key| self.origin(key))?;
        Ok(config)
    }

    /// Where the value at `key` was written.
    #[must_use]
    pub fn origin(&self, key: &str) -> Origin {
        self.origins.get(key).cloned().unwrap_or(Origin::BuiltIn)
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
        let expected = expectation(&leaf.path).ok_or_else(|| ConfigError::UnknownKey {
            origin: key_at,
            nearest: nearest(&key, Config::settings().iter().map(|setting| setting.key)),
            key: key.clone(),
        })?;
        let found = leaf.value.to_string();
        let mut table = self.table.clone();
        let laid = insert(&mut table, &leaf.path, leaf.value);
        if !laid || Config::deserialize(table.clone()).is_err() {
            return Err(ConfigError::WrongValue {
                origin: value_at,
                key,
                found,
                expected: expected.to_owned(),
            });
        }
        self.table = table;
        self.origins.insert(key, value_at);
        Ok(())
    }
}

/// What is expected at `path`; `None` if there is no such setting.
fn expectation(path: &[String]) -> Option<&'static str> {
    let key = path.join(".");
    let settings = Config::settings();
    let is_section = |setting: &Setting| setting.key.starts_with(&format!("{key}."));
    if let Some(setting) = settings.iter().find(|setting| setting.key == key) {
        Some(setting.expects)
    } else if settings.iter().any(is_section) {
        Some("a table of settings")
    } else {
        let [section, name] = path else { return None };
        (section == "env" && !name.is_empty()).then_some("a setting of the map")
    }
}

/// Puts `value` at `path`; false if something on the way is not a table.
fn insert(table: &mut toml::Table, path: &[String], value: toml::Value) -> bool {
    let Some((last, parents)) = path.split_last() else {
        return false;
    };
    let mut table = table;
    for name in parents {
        let entry = table
            .entry(name.clone())
            .or_insert_with(|| toml::Value::Table(toml::Table::new()));
        let Some(inner) = entry.as_table_mut() else {
            return false;
        };
        table = inner;
    }
    table.insert(last.clone(), value);
    true
}

#[cfg(test)]
mod tests;
