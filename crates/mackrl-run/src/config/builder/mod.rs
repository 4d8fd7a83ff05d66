//! Putting a configuration together from layers.

mod checks;
mod draft;

use std::{collections::BTreeMap, sync::Arc};

use mackrl_env::World;

use crate::config::{
    Config, ConfigError, EnvironmentConfig, Leaf, Origin, Registry,
    document::{SyntaxError, line_and_column, parse_assignment, parse_document},
    error::shortened,
    renamed::upgraded,
};

pub(super) use checks::{check, check_environment, world_error};
use draft::Draft;

/// Collects settings in layers, later ones over earlier ones, each with the place where it was written.
///
/// Nothing is looked up while layers are collected, because any layer may name another world or algorithm, with other
/// settings. [`ConfigBuilder::build`] looks at all of them together, in the order in which they were laid, so the first error is
/// the first in reading order; ranges are checked at the end, because they can depend on one another.
///
/// # Examples
/// ```
/// use mackrl_run::config::{ConfigBuilder, Registry};
///
/// let config = ConfigBuilder::new(&Registry::built_in())
///     .preset("paper")?
///     .file("mine.toml", "[algorithm]\ngamma = 0.95\n")?
///     .set("env.map=2s3z")?
///     .build()?;
/// assert_eq!(config.algorithm.get("gamma"), Some(&0.95.into()));
/// assert_eq!(config.env.map(), "2s3z");
/// # Ok::<(), mackrl_run::config::ConfigError>(())
/// ```
#[derive(Debug, Clone)]
pub struct ConfigBuilder {
    registry: Registry,
    layers: Vec<Laid>,
}

/// Something that was written, and where.
#[derive(Debug, Clone)]
struct Laid {
    what: What,
    key_at: Origin,
    value_at: Origin,
}

#[derive(Debug, Clone)]
enum What {
    /// A value at a path of keys.
    Value {
        path: Vec<String>,
        value: toml::Value,
    },
    /// A map, or a kind of world that needs none.
    Map(String),
}

/// A configuration, and where each of its values comes from.
#[derive(Debug, Clone)]
pub struct Resolved {
    config: Config,
    world: Arc<dyn World>,
    origins: BTreeMap<String, Origin>,
}

impl Resolved {
    /// The configuration.
    #[must_use]
    pub const fn config(&self) -> &Config {
        &self.config
    }

    /// The world, in the built-in simulator where there is a choice. It was built to check the configuration.
    #[must_use]
    pub const fn world(&self) -> &Arc<dyn World> {
        &self.world
    }

    /// Where the value at `key` comes from.
    #[must_use]
    pub fn origin(&self, key: &str) -> Origin {
        origin_in(&self.origins, key)
    }
}

impl ConfigBuilder {
    /// Starts from the built-in values of the first world and the first algorithm of `registry`.
    #[must_use]
    pub fn new(registry: &Registry) -> Self {
        Self {
            registry: registry.clone(),
            layers: Vec::new(),
        }
    }

    /// Lays a shipped preset over what there is. What it says of settings that the chosen world or algorithm does not have is
    /// left out.
    ///
    /// # Errors
    /// If no preset has this name.
    pub fn preset(self, name: &str) -> Result<Self, ConfigError> {
        let preset = self.registry.preset(name)?;
        let name = preset.name;
        let origin = |line, column| Origin::Preset { name, line, column };
        self.document(preset.text, origin, |leaves| leaves)
    }

    /// Lays the TOML `text` of the file called `name` over what there is.
    ///
    /// # Errors
    /// If it is not TOML.
    pub fn file(self, name: &str, text: &str) -> Result<Self, ConfigError> {
        let origin = |line, column| Origin::File {
            name: name.to_owned(),
            line,
            column,
        };
        self.document(text, origin, |leaves| leaves)
    }

    /// As [`ConfigBuilder::file`], for a complete configuration that some version of the program wrote: keys that are called
    /// otherwise now are read all the same.
    ///
    /// # Errors
    /// If it is not TOML.
    pub fn recorded(self, name: &str, text: &str) -> Result<Self, ConfigError> {
        let origin = |line, column| Origin::File {
            name: name.to_owned(),
            line,
            column,
        };
        self.document(text, origin, upgraded)
    }

    /// Lays a section `env` that some version of the program wrote, such as that of a replay.
    #[must_use]
    pub fn recorded_environment(mut self, section: &toml::Table) -> Self {
        let mut leaves = Vec::new();
        flatten(&mut vec!["env".to_owned()], section, &mut leaves);
        for leaf in upgraded(leaves) {
            self.lay(leaf, Origin::Unknown, Origin::Unknown);
        }
        self
    }

    /// Lays one `key=value` over what there is: a dotted key, and a TOML value or a bare word.
    ///
    /// # Errors
    /// If it has no `=`.
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
            self.lay(leaf, origin.clone(), origin.clone());
        }
        Ok(self)
    }

    /// Chooses a world as users name it: the kind of world called `name`, or else the map called so, of the kind that is chosen
    /// if it has maps and of the first kind that has otherwise.
    #[must_use]
    pub fn map(self, typed: &str, name: &str) -> Self {
        let origin = Origin::CommandLine {
            text: shortened(typed),
        };
        self.map_at(origin, name)
    }

    /// As [`ConfigBuilder::map`], for a name that was written at `origin`.
    #[must_use]
    pub fn map_at(mut self, origin: Origin, name: &str) -> Self {
        self.layers.push(Laid {
            what: What::Map(name.to_owned()),
            key_at: origin.clone(),
            value_at: origin,
        });
        self
    }

    /// The scenario file that the map names and whose text has still to be laid with [`ConfigBuilder::scenario`], if any.
    #[must_use]
    pub fn missing_scenario(&self) -> Option<String> {
        let draft = Draft::new(&self.registry, &self.layers).ok()?;
        draft.env.missing_scenario().map(str::to_owned)
    }

    /// Lays the text of the scenario file that the map names, so that the configuration needs the file no more.
    #[must_use]
    pub fn scenario(mut self, text: &str) -> Self {
        let of_map = Draft::new(&self.registry, &self.layers)
            .ok()
            .and_then(|draft| draft.origins.get("env.map").cloned());
        let origin = of_map.unwrap_or(Origin::Unknown);
        let leaf = Leaf {
            path: ["env", "scenario"].map(str::to_owned).to_vec(),
            value: text.into(),
            key_at: 0,
            value_at: 0,
        };
        self.lay(leaf, origin.clone(), origin);
        self
    }

    /// Where the value at `key` was written last, if any layer has it.
    #[must_use]
    pub fn written(&self, key: &str) -> Option<&Origin> {
        let last = self.layers.iter().rev().find(|laid| match &laid.what {
            What::Value { path, .. } => path.join(".") == key,
            What::Map(_) => key == "env.map",
        });
        last.map(|laid| &laid.value_at)
    }

    /// Checks everything, and gives the configuration.
    ///
    /// # Errors
    /// If a key is unknown, or a value has the wrong type, is out of its range or does not go with another.
    pub fn build(&self) -> Result<Config, ConfigError> {
        Ok(self.resolve()?.config)
    }

    /// As [`ConfigBuilder::build`], with the origin of each value. The world is built once, to see what it asks for.
    ///
    /// # Errors
    /// As [`ConfigBuilder::build`].
    pub fn resolve(&self) -> Result<Resolved, ConfigError> {
        let draft = Draft::new(&self.registry, &self.layers)?;
        let (mut config, mut origins) = draft.configuration()?;
        let world = check_environment(&config.env, |key| origin_in(&origins, key))?;
        for automatic in (config.algorithm.kind).automatic(&config.algorithm.table, world.spec()) {
            let key = format!("algorithm.{}", automatic.name);
            if matches!(
                origin_in(&origins, &key),
                Origin::BuiltIn | Origin::Preset { .. }
            ) {
                let name = automatic.name.to_owned();
                config.algorithm.table.insert(name, automatic.value);
                origins.insert(key, Origin::Automatic { why: automatic.why });
            }
        }
        checks::check_in(&mut config, &*world, &|key| origin_in(&origins, key))?;
        Ok(Resolved {
            config,
            world,
            origins,
        })
    }

    /// As [`ConfigBuilder::build`], where the world alone is needed: no algorithm has to suit it.
    ///
    /// # Errors
    /// If a key is unknown, or a setting of the world is out of its range or does not go with another.
    pub fn build_environment(&self) -> Result<EnvironmentConfig, ConfigError> {
        let Draft { env, origins, .. } = Draft::new(&self.registry, &self.layers)?;
        check_environment(&env, |key| origin_in(&origins, key))?;
        Ok(env)
    }

    fn document(
        mut self,
        text: &str,
        origin: impl Fn(usize, usize) -> Origin,
        change: impl Fn(Vec<Leaf>) -> Vec<Leaf>,
    ) -> Result<Self, ConfigError> {
        let origin_at = |at: usize| {
            let (line, column) = line_and_column(text, at);
            origin(line, column)
        };
        let leaves = parse_document(text).map_err(|error| ConfigError::Syntax {
            origin: origin_at(error.at),
            message: error.message,
        })?;
        for leaf in change(leaves) {
            let (key_at, value_at) = (origin_at(leaf.key_at), origin_at(leaf.value_at));
            self.lay(leaf, key_at, value_at);
        }
        Ok(self)
    }

    fn lay(&mut self, leaf: Leaf, key_at: Origin, value_at: Origin) {
        let Leaf { path, value, .. } = leaf;
        self.layers.push(Laid {
            what: What::Value { path, value },
            key_at,
            value_at,
        });
    }
}

/// Where the value at `key` was written.
fn origin_in(origins: &BTreeMap<String, Origin>, key: &str) -> Origin {
    origins.get(key).cloned().unwrap_or(Origin::BuiltIn)
}

/// The values of a table, with the tables around them as a path.
fn flatten(path: &mut Vec<String>, table: &toml::Table, leaves: &mut Vec<Leaf>) {
    for (name, value) in table {
        path.push(name.clone());
        match value {
            toml::Value::Table(table) => flatten(path, table, leaves),
            value => leaves.push(Leaf {
                path: path.clone(),
                value: value.clone(),
                key_at: 0,
                value_at: 0,
            }),
        }
        path.pop();
    }
}

#[cfg(test)]
mod tests;
