//! All layers laid over each other, before anything is checked that takes more than one value.

use std::{collections::BTreeMap, sync::Arc};

use mackrl::algorithms::AlgorithmKind;
use mackrl_env::{
    WorldKind,
    settings::{Accepts, Setting, Settings},
};

use super::{
    Laid, What,
    checks::{ranges, settings_error},
};
use crate::config::{
    AlgorithmConfig, Config, ConfigError, EnvironmentConfig, Kind, Origin, Registry, RunConfig,
    TestConfig,
    error::{one_of, shortened},
    renamed::renamed,
    selected::as_asked,
};

/// The chosen kinds and the value of each of their settings, each of its setting's type.
pub(super) struct Draft<'a> {
    registry: &'a Registry,
    pub(super) env: EnvironmentConfig,
    algorithm: AlgorithmConfig,
    test: toml::Table,
    run: toml::Table,
    pub(super) origins: BTreeMap<String, Origin>,
}

impl<'a> Draft<'a> {
    /// Finds out what is chosen, then lays value over value.
    pub(super) fn new(registry: &'a Registry, layers: &[Laid]) -> Result<Self, ConfigError> {
        let mut draft = Self {
            registry,
            env: registry.default_environment(),
            algorithm: registry.default_algorithm(),
            test: TestConfig::defaults(),
            run: RunConfig::defaults(),
            origins: BTreeMap::new(),
        };
        for laid in layers {
            draft.choose(laid)?;
        }
        for laid in layers {
            draft.lay(laid)?;
        }
        Ok(draft)
    }

    /// The configuration; ranges of the sections that become structures are checked for it.
    pub(super) fn configuration(self) -> Result<(Config, BTreeMap<String, Origin>), ConfigError> {
        let origin_of = |key: &str| super::origin_in(&self.origins, key);
        let test = section("test", &self.test, &origin_of)?;
        let run = section("run", &self.run, &origin_of)?;
        let config = Config {
            env: self.env,
            algorithm: self.algorithm,
            test,
            run,
        };
        Ok((config, self.origins))
    }

    /// Takes note of a name of a world or an algorithm.
    fn choose(&mut self, laid: &Laid) -> Result<(), ConfigError> {
        let key = match &laid.what {
            What::Map(name) => match self.world_of_map(name) {
                Some(kind) => {
                    self.env = EnvironmentConfig::new(kind);
                    "env.name"
                }
                None => return Ok(()),
            },
            What::Value { path, value } if *path == ["env", "name"] => {
                let kinds = self.registry.worlds();
                self.env = EnvironmentConfig::new(named::<dyn WorldKind>(kinds, value, laid)?);
                "env.name"
            }
            What::Value { path, value } if *path == ["algorithm", "name"] => {
                let kinds = self.registry.algorithms();
                let kind = named::<dyn AlgorithmKind>(kinds, value, laid)?;
                self.algorithm = AlgorithmConfig::new(kind);
                "algorithm.name"
            }
            What::Value { .. } => return Ok(()),
        };
        self.origins.insert(key.to_owned(), laid.value_at.clone());
        Ok(())
    }

    /// The kind of world that the map `name` asks for, if it is not the one that is chosen.
    fn world_of_map(&self, name: &str) -> Option<Arc<dyn WorldKind>> {
        if let Some(kind) = self.registry.world(name) {
            return Some(Arc::clone(kind));
        }
        if self.env.get("map").is_some() {
            return None;
        }
        let mut worlds = self.registry.worlds();
        let with_maps = worlds.find(|kind| find(&kind.settings(), "map").is_some());
        with_maps.map(Arc::clone)
    }

    fn lay(&mut self, laid: &Laid) -> Result<(), ConfigError> {
        let (path, value) = match &laid.what {
            What::Value { path, value } => {
                (path.iter().map(String::as_str).collect(), value.clone())
            }
            What::Map(name) if self.registry.world(name).is_some() => return Ok(()),
            What::Map(name) => (vec!["env", "map"], name.as_str().into()),
        };
        match path[..] {
            ["env" | "algorithm", "name"] => return Ok(()),
            ["env", "map"] if self.is_another_world(&value) => {
                return Err(ConfigError::WrongValue {
                    origin: laid.value_at.clone(),
                    key: "env.map".to_owned(),
                    found: shortened(&value.to_string()),
                    expected: format!("a map; a kind of world is chosen by env.name = {value}"),
                });
            }
            _ => {}
        }
        let Some(place) = self.place(&path) else {
            return self.unplaced(&path, &value, laid);
        };
        let value = typed(&place.setting, &path, value, laid)?;
        if place.holds {
            let (section, name) = (path[0], place.setting.name);
            self.origins
                .insert(format!("{section}.{name}"), laid.value_at.clone());
            let table = match section {
                "env" => &mut self.env.table,
                "algorithm" => &mut self.algorithm.table,
                "test" => &mut self.test,
                _ => &mut self.run,
            };
            table.insert(name.to_owned(), value);
        }
        Ok(())
    }

    fn is_another_world(&self, value: &toml::Value) -> bool {
        let name = value.as_str().unwrap_or_default();
        self.env.get("map").is_some() && self.registry.world(name).is_some()
    }

    /// The setting at a path, if there is one.
    fn place(&self, path: &[&str]) -> Option<Place> {
        let (setting, holds) = match *path {
            ["env", name] => (find(&self.env.kind.declared(), name), true),
            ["algorithm", name] => (find(&self.algorithm.kind.declared(), name), true),
            ["test", name] => (find(TestConfig::SETTINGS, name), true),
            ["run", name] => (find(RunConfig::SETTINGS, name), true),
            ["env", kind, name] => (
                find(&self.registry.world(kind)?.settings(), name),
                self.registry.holds_for(kind, self.env.name()),
            ),
            ["algorithm", kind, name] => (
                find(&self.registry.algorithm(kind)?.settings(), name),
                kind == self.algorithm.name(),
            ),
            _ => (None, false),
        };
        setting.map(|setting| Place { setting, holds })
    }

    /// What is wrong with a path at which there is no setting; nothing, if a preset speaks of what the chosen kind does not have.
    fn unplaced(&self, path: &[&str], value: &toml::Value, laid: &Laid) -> Result<(), ConfigError> {
        let (key, origin) = (path.join("."), laid.key_at.clone());
        if let ["env" | "algorithm" | "test" | "run"] = *path {
            return Err(ConfigError::WrongValue {
                origin: laid.value_at.clone(),
                key,
                found: shortened(&value.to_string()),
                expected: "a table of settings".to_owned(),
            });
        }
        if let [section, name] = *path
            && let Some((owner, chosen)) = self.owner(section, name)
        {
            return match origin {
                Origin::Preset { .. } => Ok(()),
                origin => Err(ConfigError::ForeignKey {
                    origin,
                    key,
                    owner: owner.into(),
                    section: section.into(),
                    chosen: chosen.into(),
                }),
            };
        }
        let owned: Vec<String> = path.iter().map(|&name| name.to_owned()).collect();
        if let Some(new) = renamed(&owned) {
            return Err(ConfigError::RenamedKey {
                origin,
                key: shortened(&key),
                new: shortened(&new),
            });
        }
        let known: Vec<String> = self.known_keys(path);
        Err(ConfigError::unknown_key(
            origin,
            &key,
            known.iter().map(String::as_str),
        ))
    }

    /// The first kind in `section` that has the setting `name`, and the one that is chosen.
    fn owner(&self, section: &str, name: &str) -> Option<(String, String)> {
        let (owner, chosen) = match section {
            "env" => {
                let mut worlds = self.registry.worlds();
                let owner = worlds.find(|kind| find(&kind.settings(), name).is_some())?;
                (owner.name().to_owned(), self.env.name())
            }
            "algorithm" => {
                let mut algorithms = self.registry.algorithms();
                let owner = algorithms.find(|kind| find(&kind.settings(), name).is_some())?;
                (owner.name().to_owned(), self.algorithm.name())
            }
            _ => return None,
        };
        Some((owner, chosen.to_owned()))
    }

    /// The keys that could have been meant by `path`.
    fn known_keys(&self, path: &[&str]) -> Vec<String> {
        let keys = |table: &str, settings: &[Setting]| -> Vec<String> {
            let keys = settings.iter();
            keys.map(|setting| format!("{table}.{}", setting.name))
                .collect()
        };
        let in_table = match *path {
            ["env", kind, _] => self.registry.world(kind).map(|kind| kind.settings()),
            ["algorithm", kind, _] => self.registry.algorithm(kind).map(|kind| kind.settings()),
            _ => None,
        };
        if let Some(settings) = in_table {
            return keys(&format!("{}.{}", path[0], path[1]), &settings);
        }
        [
            vec!["env.name".to_owned(), "algorithm.name".to_owned()],
            keys("env", &self.env.kind.declared()),
            keys("algorithm", &self.algorithm.kind.declared()),
            keys("test", TestConfig::SETTINGS),
            keys("run", RunConfig::SETTINGS),
        ]
        .concat()
    }
}

/// A setting, and whether what is written there holds for the kind that is chosen.
struct Place {
    setting: Setting,
    holds: bool,
}

fn find(settings: &[Setting], name: &str) -> Option<Setting> {
    settings
        .iter()
        .find(|setting| setting.name == name)
        .copied()
}

/// The kind that a value names.
fn named<'a, K: Kind + ?Sized + 'a>(
    kinds: impl Iterator<Item = &'a Arc<K>>,
    value: &toml::Value,
    laid: &Laid,
) -> Result<Arc<K>, ConfigError> {
    let name = value.as_str().unwrap_or_default();
    let kinds: Vec<&Arc<K>> = kinds.collect();
    if let Some(kind) = kinds.iter().find(|kind| kind.called() == name) {
        return Ok(Arc::clone(kind));
    }
    let names: Vec<&str> = kinds.iter().map(|kind| kind.called()).collect();
    Err(ConfigError::WrongValue {
        origin: laid.value_at.clone(),
        key: format!("{}.name", K::SECTION),
        found: shortened(&value.to_string()),
        expected: one_of(&names),
    })
}

/// `value` as the setting's type, whatever its range.
fn typed(
    setting: &Setting,
    path: &[&str],
    value: toml::Value,
    laid: &Laid,
) -> Result<toml::Value, ConfigError> {
    let value = as_asked(setting.accepts, value);
    let fits = match (setting.accepts, &value) {
        (Accepts::Integer { .. }, toml::Value::Integer(_))
        | (Accepts::Number { .. }, toml::Value::Float(_)) => true,
        (accepts, value) => accepts.admits(value),
    };
    if fits {
        return Ok(value);
    }
    Err(ConfigError::WrongValue {
        origin: laid.value_at.clone(),
        key: path.join("."),
        found: shortened(&value.to_string()),
        expected: setting.accepts.to_string(),
    })
}

/// A section that becomes a structure.
fn section<S: Settings>(
    name: &str,
    table: &toml::Table,
    origin_of: &dyn Fn(&str) -> Origin,
) -> Result<S, ConfigError> {
    ranges(name, S::DECLARED, table, origin_of)?;
    S::read(table).map_err(|error| settings_error(name, error, origin_of))
}
