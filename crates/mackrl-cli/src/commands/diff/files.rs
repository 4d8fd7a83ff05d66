//! Two checkpoints, or two files of results.

use std::path::Path;

use anyhow::Context;
use mackrl_run::{
    bounded,
    run_folder::read_checkpoint,
    training::{Checkpoint, Difference, compare_tensors},
};
use serde::Serialize;
use serde_json::Value;

use super::{Comparison, Differing};
use crate::failure::Failure;

/// Greatest length of a JSON file.
const JSON_MAX: usize = 1 << 28;

/// Two JSON files.
#[derive(Debug, Serialize)]
pub(super) struct JsonFiles {
    equal: bool,
    /// The first value that tells where the results come from and differs.
    provenance: Option<Differing>,
    /// The first other value that differs.
    value: Option<Differing>,
}

/// Two checkpoints.
#[derive(Debug, Serialize)]
pub(super) struct Checkpoints {
    equal: bool,
    /// The first counter that differs.
    counters: Option<Differing>,
    /// The first number of the tensors that differs.
    tensors: Option<Difference>,
}

/// Compares two JSON files, what depends on the clock aside.
pub(super) fn compare_json(a: &Path, b: &Path) -> anyhow::Result<JsonFiles> {
    let [mut a, mut b] = [read(a)?, read(b)?];
    let [from_a, from_b] = [&mut a, &mut b].map(|result| match result {
        Value::Object(object) => object.remove("provenance").unwrap_or_default(),
        _ => Value::Null,
    });
    let provenance = first_difference("provenance", &from_a, &from_b);
    let value = first_difference("", &a, &b);
    Ok(JsonFiles {
        equal: provenance.is_none() && value.is_none(),
        provenance,
        value,
    })
}

/// Compares two checkpoints.
pub(super) fn compare_checkpoints(a: &Path, b: &Path) -> anyhow::Result<Checkpoints> {
    let [own, other] = [read_checkpoint(a)?, read_checkpoint(b)?];
    let counters = first_difference("", &counters(a, &own)?, &counters(b, &other)?);
    let tensors = compare_tensors(&own.tensors, &other.tensors)
        .with_context(|| format!("cannot compare {} with {}", a.display(), b.display()))?;
    Ok(Checkpoints {
        equal: counters.is_none() && tensors.is_none(),
        counters,
        tensors,
    })
}

fn counters(path: &Path, checkpoint: &Checkpoint) -> anyhow::Result<Value> {
    parse(path, &checkpoint.counters)
}

fn read(path: &Path) -> anyhow::Result<Value> {
    parse(path, &bounded::read(path, JSON_MAX)?)
}

fn parse(path: &Path, json: &[u8]) -> anyhow::Result<Value> {
    serde_json::from_slice(json).map_err(|error| {
        let message = format!("{}: {error}", path.display());
        Failure::BadData { message }.into()
    })
}

/// The first value in which two JSON values differ, by its path. Ids follow from what they name, so they are left out.
fn first_difference(path: &str, a: &Value, b: &Value) -> Option<Differing> {
    let below = |name: &str| match path {
        "" => name.to_owned(),
        path => format!("{path}.{name}"),
    };
    match (a, b) {
        (Value::Object(own), Value::Object(others)) => {
            let names = own
                .keys()
                .chain(others.keys().filter(|name| !own.contains_key(*name)));
            names
                .filter(|name| *name != "id" && !name.starts_with("sys/"))
                .find_map(|name| {
                    let of = |object: &serde_json::Map<String, Value>| {
                        object.get(name).cloned().unwrap_or_default()
                    };
                    first_difference(&below(name), &of(own), &of(others))
                })
        }
        (Value::Array(own), Value::Array(others)) => {
            (0..own.len().max(others.len())).find_map(|index| {
                let of = |array: &[Value]| array.get(index).cloned().unwrap_or_default();
                first_difference(&below(&index.to_string()), &of(own), &of(others))
            })
        }
        _ => (a != b).then(|| Differing::new(path, a.clone(), b.clone())),
    }
}

impl Comparison for JsonFiles {
    fn first(&self) -> Option<String> {
        let first = self.provenance.as_ref().or(self.value.as_ref());
        first.map(Differing::words)
    }

    fn lines(&self) -> Vec<(&'static str, String)> {
        let words = |found: &Option<Differing>| found.as_ref().map_or_else(same, Differing::words);
        vec![
            ("provenance", words(&self.provenance)),
            ("values", words(&self.value)),
        ]
    }
}

impl Comparison for Checkpoints {
    fn first(&self) -> Option<String> {
        let tensors = || self.tensors.as_ref().map(in_words);
        let counters = self.counters.as_ref().map(Differing::words);
        counters.or_else(tensors)
    }

    fn lines(&self) -> Vec<(&'static str, String)> {
        let counters = self.counters.as_ref();
        let tensors = self.tensors.as_ref();
        vec![
            ("counters", counters.map_or_else(same, Differing::words)),
            ("tensors", tensors.map_or_else(same, in_words)),
        ]
    }
}

/// "WHAT at AXIS INDEX, …: A, B"
pub(super) fn in_words(difference: &Difference) -> String {
    let axes = difference.place.iter();
    let place: Vec<String> = axes
        .map(|(axis, index)| format!("{axis} {index}"))
        .collect();
    let at = if place.is_empty() { "" } else { " at " };
    let [a, b] = difference.values;
    format!("{}{at}{}: {a}, {b}", difference.what, place.join(", "))
}

pub(super) fn same() -> String {
    "the same".to_owned()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn the_first_value_that_differs_is_named_by_its_path() {
        let a = json!({ "id": 1, "sys/sps": 5.0, "runs": [{ "seed": 1 }, { "seed": 2 }] });
        let b = json!({ "id": 2, "runs": [{ "seed": 1 }, { "seed": 3 }, {}] });
        let found = first_difference("", &a, &b).unwrap();
        assert_eq!(found, Differing::new("runs.1.seed", 2, 3));
        assert_eq!(first_difference("", &a, &a), None);
        let longer = first_difference("", &json!([1]), &json!([1, "x"])).unwrap();
        assert_eq!(longer.words(), "1: nothing, x");
    }
}
