//! The settings as a JSON schema, for editors and for programs that write configurations.

use std::ops::Bound::{self, Excluded, Included, Unbounded};

use mackrl_env::settings::{Accepts, Setting};
use serde_json::{Map, Value, json};

use crate::config::{Kind, Registry, RunConfig, TestConfig};

/// A JSON schema (draft 2020-12) of configuration files: every key with its meaning, its values and its built-in value.
///
/// A section that names a kind takes the settings of every kind, and a table for each kind. What depends on another key or on a
/// file, such as that the chosen kind has a setting or that a map exists, cannot be said there;
/// [`Config::validate`](crate::config::Config::validate) checks it.
#[must_use]
pub fn schema(registry: &Registry) -> Value {
    let mut root = object();
    root["properties"] = json!({
        "env": kinds(
            registry.worlds().map(|kind| &**kind),
            registry.default_environment().name(),
        ),
        "algorithm": kinds(
            registry.algorithms().map(|kind| &**kind),
            registry.default_algorithm().name(),
        ),
        "test": section(TestConfig::SETTINGS, &table(&TestConfig::default())),
        "run": section(RunConfig::SETTINGS, &table(&RunConfig::default())),
    });
    root["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    root["title"] = json!("Configuration of a mackrl run");
    root
}

fn object() -> Value {
    json!({ "type": "object", "additionalProperties": false, "properties": {} })
}

fn table(settings: &impl mackrl_env::settings::Settings) -> toml::Table {
    toml::Table::try_from(settings).unwrap_or_default()
}

/// A table of settings.
fn section(declared: &[Setting], built_in: &toml::Table) -> Value {
    let mut section = object();
    for setting in declared {
        section["properties"][setting.name] = property(setting, built_in.get(setting.name));
    }
    section
}

/// The section in which one of these kinds is named, or else the one called `default`.
fn kinds<'a, K: Kind + ?Sized + 'a>(kinds: impl Iterator<Item = &'a K>, default: &str) -> Value {
    let mut whole = object();
    let mut names = Vec::new();
    for kind in kinds {
        let own = section(&kind.declared(), &kind.built_in());
        for (name, property) in own["properties"].as_object().into_iter().flatten() {
            let place = &mut whole["properties"][name];
            if place.is_null() {
                *place = property.clone();
            } else if *place != *property {
                *place = either(place.take(), property.clone());
            }
        }
        names.push((kind.called().to_owned(), own));
    }
    let all: Vec<&String> = names.iter().map(|(name, _)| name).collect();
    whole["properties"]["name"] = json!({
        "enum": all,
        "default": default,
        "description": "What is chosen; which other settings there are depends on it.",
    });
    for (name, mut own) in names {
        own["description"] = json!(format!("Holds only if name is {name}."));
        whole["properties"][&name] = own;
    }
    whole
}

/// What one of two kinds takes.
fn either(one: Value, other: Value) -> Value {
    match one.get("anyOf").and_then(Value::as_array) {
        Some(any) => {
            let all = [&any[..], &[other]].concat();
            json!({ "anyOf": all })
        }
        None => json!({ "anyOf": [one, other] }),
    }
}

fn property(setting: &Setting, built_in: Option<&toml::Value>) -> Value {
    let mut property = accepted(setting.accepts);
    property.insert("description".to_owned(), json!(setting.meaning));
    if let Some(built_in) = built_in {
        property.insert("default".to_owned(), json!(built_in));
    }
    Value::Object(property)
}

fn accepted(accepts: Accepts) -> Map<String, Value> {
    let mut accepted = Map::new();
    let mut say = |name: &str, value: Value| accepted.insert(name.to_owned(), value);
    match accepts {
        Accepts::Flag => {
            say("type", json!("boolean"));
        }
        Accepts::Integer { least, greatest } => {
            say("type", json!("integer"));
            say("minimum", json!(least));
            say("maximum", json!(greatest));
        }
        Accepts::Number { least, greatest } => {
            say("type", json!("number"));
            bound(&mut say, least, ["minimum", "exclusiveMinimum"]);
            bound(&mut say, greatest, ["maximum", "exclusiveMaximum"]);
        }
        Accepts::OneOf(words) => {
            say("enum", json!(words));
        }
        Accepts::Text { pattern, .. } => {
            say("type", json!("string"));
            if let Some(pattern) = pattern {
                say("pattern", json!(pattern));
            }
        }
        // The list of kinds grows in another crate; a schema that says less is still true.
        _ => {}
    }
    accepted
}

fn bound(
    say: &mut impl FnMut(&str, Value) -> Option<Value>,
    bound: Bound<f64>,
    [included, excluded]: [&str; 2],
) {
    match bound {
        Included(number) => say(included, json!(number)),
        Excluded(number) => say(excluded, json!(number)),
        Unbounded => None,
    };
}

#[cfg(test)]
mod tests {
    use crate::config::{Config, ConfigBuilder};

    use super::*;

    /// Whether `value` is what `schema` describes, for the words that are used here; gives the path of the first difference.
    fn differs(schema: &Value, value: &Value, path: &str) -> Option<String> {
        if let Some(any) = schema.get("anyOf").and_then(Value::as_array) {
            // What one of them takes is right.
            let found = any.iter().map(|schema| differs(schema, value, path));
            return found.collect::<Option<Vec<_>>>()?.pop();
        }
        let number = |name: &str| schema.get(name).and_then(Value::as_f64);
        let right_type = match schema.get("type").and_then(Value::as_str) {
            Some("object") => value.is_object(),
            Some("boolean") => value.is_boolean(),
            Some("integer") => value.is_u64() || value.is_i64(),
            Some("number") => value.is_number(),
            Some("string") => value.is_string(),
            None => true,
            Some(other) => panic!("the schema speaks of {other}"),
        };
        let in_range = value.as_f64().is_none_or(|value| {
            number("minimum").is_none_or(|least| value >= least)
                && number("maximum").is_none_or(|greatest| value <= greatest)
                && number("exclusiveMinimum").is_none_or(|least| value > least)
                && number("exclusiveMaximum").is_none_or(|greatest| value < greatest)
        });
        let listed = schema["enum"]
            .as_array()
            .is_none_or(|words| words.contains(value));
        if !(right_type && in_range && listed) {
            return Some(path.to_owned());
        }
        value.as_object()?.iter().find_map(|(name, value)| {
            let path = format!("{path}.{name}");
            match schema["properties"].get(name) {
                Some(schema) => differs(schema, value, &path),
                None => Some(path),
            }
        })
    }

    #[test]
    fn every_shipped_configuration_is_as_the_schema_says() {
        let registry = Registry::built_in();
        let schema = schema(&registry);
        for preset in registry.presets() {
            let config = ConfigBuilder::new(&registry).preset(preset.name).unwrap();
            let complete = serde_json::to_value(config.build().unwrap()).unwrap();
            assert_eq!(differs(&schema, &complete, ""), None, "{}", preset.name);
            let written: toml::Table = preset.text.parse().unwrap();
            let written = serde_json::to_value(written).unwrap();
            assert_eq!(differs(&schema, &written, ""), None, "{}", preset.name);
        }
    }

    #[test]
    fn the_schema_refuses_what_the_program_refuses() {
        let registry = Registry::built_in();
        let schema = schema(&registry);
        for (text, path) in [
            ("[algorithm]\ngamma = 1.5", ".algorithm.gamma"),
            (
                "[algorithm]\nlearning_rate = 0.0",
                ".algorithm.learning_rate",
            ),
            ("[algorithm]\ngama = 0.5", ".algorithm.gama"),
            ("[run]\nseed = -1", ".run.seed"),
            ("[algorithm]\nname = \"maddpg\"", ".algorithm.name"),
            ("[env.matrix-game]\npayoffs = 3", ".env.matrix-game.payoffs"),
            ("[env]\nreward_sparse = 1", ".env.reward_sparse"),
        ] {
            let value = serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap();
            assert_eq!(differs(&schema, &value, "").as_deref(), Some(path));
            let read = ConfigBuilder::new(&registry).file("x", text);
            assert!(read.and_then(|builder| builder.build()).is_err(), "{text}");
        }
    }

    #[test]
    fn every_key_of_a_complete_configuration_is_declared_and_explained() {
        let declared: Vec<String> = Config::default()
            .settings()
            .into_iter()
            .map(|setting| {
                assert!(setting.meaning.ends_with('.'), "{}", setting.key);
                setting.key
            })
            .collect();
        // A file has it only where it says something.
        let mut written = vec!["run.initial_weights".to_owned()];
        let complete = Config::default().to_table();
        collect_keys("", &toml::Value::Table(complete), &mut written);
        let sorted = |mut keys: Vec<String>| {
            keys.sort();
            keys
        };
        assert_eq!(sorted(declared), sorted(written));
    }

    fn collect_keys(path: &str, value: &toml::Value, keys: &mut Vec<String>) {
        match value {
            toml::Value::Table(table) => {
                for (name, value) in table {
                    collect_keys(&format!("{path}.{name}"), value, keys);
                }
            }
            _ => keys.push(path.trim_start_matches('.').to_owned()),
        }
    }
}
