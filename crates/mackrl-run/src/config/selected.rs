//! A kind of world or of algorithm that was chosen by its name, with a table of the settings that it declares.

use std::{fmt::Debug, sync::Arc};

use mackrl::algorithms::AlgorithmKind;
use mackrl_env::{
    WorldKind,
    settings::{Accepts, EXACT, Setting},
};
use serde::{Serialize, Serializer, ser::SerializeMap};

use crate::config::{ConfigError, Origin, error::nearest};

/// What configurations can name and what has settings of its own.
pub trait Kind: Debug + Send + Sync {
    /// The section of a configuration in which it is named.
    const SECTION: &'static str;

    /// How configurations call it.
    fn called(&self) -> &str;

    /// What it is, in one line.
    fn described(&self) -> &str;

    /// Its settings, in the order in which they are shown.
    fn declared(&self) -> Vec<Setting>;

    /// The built-in value of each of them.
    fn built_in(&self) -> toml::Table;
}

impl Kind for dyn WorldKind {
    const SECTION: &'static str = "env";

    fn called(&self) -> &str {
        self.name()
    }

    fn described(&self) -> &str {
        self.summary()
    }

    fn declared(&self) -> Vec<Setting> {
        self.settings()
    }

    fn built_in(&self) -> toml::Table {
        self.defaults()
    }
}

impl Kind for dyn AlgorithmKind {
    const SECTION: &'static str = "algorithm";

    fn called(&self) -> &str {
        self.name()
    }

    fn described(&self) -> &str {
        self.summary()
    }

    fn declared(&self) -> Vec<Setting> {
        self.settings()
    }

    fn built_in(&self) -> toml::Table {
        self.defaults()
    }
}

/// A kind that was chosen, and the value of each of its settings.
#[derive(Debug)]
pub struct Selected<K: Kind + ?Sized> {
    pub(super) kind: Arc<K>,
    pub(super) table: toml::Table,
}

impl<K: Kind + ?Sized> Clone for Selected<K> {
    fn clone(&self) -> Self {
        Self {
            kind: Arc::clone(&self.kind),
            table: self.table.clone(),
        }
    }
}

impl<K: Kind + ?Sized> PartialEq for Selected<K> {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name() && self.table == other.table
    }
}

impl<K: Kind + ?Sized> Selected<K> {
    /// The kind with its built-in values.
    #[must_use]
    pub fn new(kind: Arc<K>) -> Self {
        let table = kind.built_in();
        Self { kind, table }
    }

    /// The kind.
    #[must_use]
    pub const fn kind(&self) -> &Arc<K> {
        &self.kind
    }

    /// How the kind is called.
    #[must_use]
    pub fn name(&self) -> &str {
        self.kind.called()
    }

    /// The value of each setting, in the order of declaration.
    #[must_use]
    pub const fn table(&self) -> &toml::Table {
        &self.table
    }

    /// The value of the setting `name`, if there is such a setting.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&toml::Value> {
        self.table.get(name)
    }

    /// The text that the setting `name` holds; empty if it holds none or there is no such setting.
    #[must_use]
    pub fn text(&self, name: &str) -> &str {
        (self.get(name).and_then(toml::Value::as_str)).unwrap_or_default()
    }

    /// Changes one setting.
    ///
    /// # Errors
    /// [`ConfigError::UnknownKey`] if there is no such setting, [`ConfigError::WrongValue`] if it does not take the value.
    pub fn set(&mut self, name: &str, value: impl Into<toml::Value>) -> Result<(), ConfigError> {
        let declared = self.kind.declared();
        let key = format!("{}.{name}", K::SECTION);
        let Some(setting) = declared.iter().find(|setting| setting.name == name) else {
            return Err(ConfigError::UnknownKey {
                origin: Origin::Unknown,
                key,
                nearest: nearest(name, declared.iter().map(|setting| setting.name)),
            });
        };
        let value = as_asked(setting.accepts, value.into());
        if !setting.accepts.admits(&value) {
            return Err(ConfigError::WrongValue {
                origin: Origin::Unknown,
                key,
                found: value.to_string(),
                expected: setting.accepts.to_string(),
            });
        }
        self.table.insert(name.to_owned(), value);
        Ok(())
    }
}

impl<K: Kind + ?Sized> Serialize for Selected<K> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.table.len() + 1))?;
        map.serialize_entry("name", self.name())?;
        for (name, value) in &self.table {
            map.serialize_entry(name, value)?;
        }
        map.end()
    }
}

/// `value`, but for an integer as a number where numbers are taken, and 1e6 as an integer where integers are: so people write them.
pub(super) fn as_asked(accepts: Accepts, value: toml::Value) -> toml::Value {
    match (accepts, value) {
        (Accepts::Number { .. }, toml::Value::Integer(integer)) => {
            toml::Value::Float(integer as f64)
        }
        (Accepts::Integer { .. }, toml::Value::Float(number))
            if number.fract() == 0.0 && number.abs() < EXACT as f64 =>
        {
            #[expect(
                clippy::cast_possible_truncation,
                reason = "it has no fraction and fits"
            )]
            toml::Value::Integer(number as i64)
        }
        (_, value) => value,
    }
}
