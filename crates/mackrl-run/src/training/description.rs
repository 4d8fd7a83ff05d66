//! What a file of weights says of itself: enough to act with it, beside the world's observations.
//!
//! The texts lie where safetensors keeps them, in `__metadata__`. They are a function of the configuration and the versions, as the
//! weights are, so the whole file is: nothing of a machine, a clock or a build stands in it.

use std::collections::BTreeMap;

use mackrl::policy::Policy;
use safetensors::SafeTensors;
use serde::Serialize;
use serde_json::json;

use super::assembly::RunWorld;
use crate::{
    config::Config,
    provenance::{Provenance, Versions},
};

/// Version of the description; it changes when a reader of the former would be misled.
const FORMAT: &str = "mackrl/3";
/// Under which name the steps of training stand.
const STEPS: &str = "trained_steps_env";

/// The texts of a team that has trained for `steps_env` steps and ends with exploration ε.
pub(super) fn description(
    config: &Config,
    world: &RunWorld,
    policy: &dyn Policy,
    (steps_env, exploration): (u64, f32),
) -> BTreeMap<&'static str, String> {
    let Provenance {
        map,
        map_sha256,
        config_sha256,
        ..
    } = Provenance::of_run(config);
    BTreeMap::from([
        ("format", FORMAT.to_owned()),
        ("algorithm", config.algorithm.name().to_owned()),
        ("map", map),
        ("map_sha256", map_sha256),
        ("config_sha256", config_sha256),
        ("versions", Versions::OWN.to_string()),
        ("env", json(&config.env.without_folder())),
        ("spec", json(world.spec())),
        ("controllers", json(&policy.description())),
        ("partitions", json(&policy.partitions())),
        (STEPS, steps_env.to_string()),
        ("exploration", exploration.to_string()),
    ])
}

/// The environment steps of training that a file of weights says its team has seen, if it describes itself.
#[must_use]
pub fn trained_steps_env(file: &[u8]) -> Option<u64> {
    let (_, header) = SafeTensors::read_metadata(file).ok()?;
    header.metadata().as_ref()?.get(STEPS)?.parse().ok()
}

fn json(value: &impl Serialize) -> String {
    json!(value).to_string()
}

/// The safetensors file `file`, which has no description, with one.
///
/// The crate that writes the file keeps descriptions in an order that is drawn anew for every run of a program, so they are put in here.
pub(super) fn with_description(file: &[u8], texts: &BTreeMap<&'static str, String>) -> Vec<u8> {
    const LENGTH: usize = size_of::<u64>();
    let (length, rest) = file
        .split_first_chunk::<LENGTH>()
        .expect("a safetensors file begins with a length");
    let length = usize::try_from(u64::from_le_bytes(*length)).expect("the file is in memory");
    let (header, tensors) = rest.split_at(length);
    let entries = header.trim_ascii().strip_prefix(b"{").expect("an object");
    let mut header = format!("{{\"__metadata__\":{}", json(texts)).into_bytes();
    if entries != b"}" {
        header.push(b',');
    }
    header.extend(entries);
    header.resize(header.len().next_multiple_of(LENGTH), b' ');
    let mut described = (header.len() as u64).to_le_bytes().to_vec();
    described.extend(header);
    described.extend(tensors);
    described
}

#[cfg(test)]
mod tests {
    use mackrl::nn::ParameterLayout;

    use super::*;
    use crate::training::write_weights;

    #[test]
    fn a_description_comes_back_and_changes_no_tensor() {
        let texts = BTreeMap::from([("a", "\"1\" \\ é".to_owned()), ("b", "2".to_owned())]);
        let mut layout = ParameterLayout::new();
        layout.add("critic.input.bias", &[3]);
        for models in [vec![], vec![(&layout, &[0.5, 7.0, -1.0][..])]] {
            let bare = write_weights(&models);
            let described = with_description(&bare, &texts);
            let (_, metadata) = SafeTensors::read_metadata(&described).unwrap();
            let found = metadata.metadata().as_ref().unwrap();
            assert_eq!(found.len(), texts.len());
            assert!(texts.iter().all(|(name, text)| found[*name] == *text));
            let [before, after] = [&bare, &described].map(|f| SafeTensors::deserialize(f).unwrap());
            assert_eq!(before.tensors(), after.tensors());
            assert_eq!(trained_steps_env(&bare), None);
            let texts = BTreeMap::from([(STEPS, "123".to_owned())]);
            assert_eq!(
                trained_steps_env(&with_description(&bare, &texts)),
                Some(123)
            );
        }
    }
}
