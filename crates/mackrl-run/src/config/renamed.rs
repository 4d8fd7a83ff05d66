//! Keys of version 0.1.0: what they are called now, and how files that it recorded are read.
//!
//! Until then there was one closed list of settings, in which those of battles stood flat in `env` whatever the world was, and
//! those of the learners in `policy`, `exploration` and `learner`.

use mackrl_env::matrix_game::MATRIX_GAME;
use mackrl_skirmish::SKIRMISH;
use toml::Value;

use crate::config::{Leaf, STAR_CRAFT};

/// Environments of a shard, which was no setting.
const SHARD_SIZE: i64 = 4;

/// What the key of 0.1.0 is called now, if it has another name.
pub(super) fn renamed(path: &[String]) -> Option<String> {
    let names: Vec<&str> = path.iter().map(String::as_str).collect();
    match names[..] {
        ["policy", "algorithm"] => Some("algorithm.name".to_owned()),
        ["policy" | "learner", name] => Some(format!("algorithm.{name}")),
        ["exploration", name] => Some(format!("algorithm.exploration_{name}")),
        ["env", "engine"] => Some("env.name".to_owned()),
        ["env", "matrix_game", name] => Some(format!("env.{name}")),
        _ => None,
    }
}

/// The values of a complete configuration that some version recorded, under the keys that they have now.
pub(super) fn upgraded(leaves: Vec<Leaf>) -> Vec<Leaf> {
    let has = |path: &[&str]| leaves.iter().any(|leaf| leaf.path == path);
    if has(&["env", "name"]) || has(&["algorithm", "name"]) {
        return leaves;
    }
    let text = |name: &str| {
        let leaf = leaves.iter().find(|leaf| leaf.path == ["env", name]);
        leaf.and_then(|leaf| leaf.value.as_str())
            .unwrap_or_default()
    };
    let is_game = text("engine") == STAR_CRAFT;
    let is_matrix_game = text("map") == MATRIX_GAME && text("scenario").is_empty();
    let world = if is_matrix_game {
        MATRIX_GAME
    } else if is_game {
        STAR_CRAFT
    } else {
        SKIRMISH
    };
    let mut upgraded = Vec::with_capacity(leaves.len() + 2);
    let first = |path: [&str; 2], value: Value| Leaf {
        path: path.map(str::to_owned).to_vec(),
        value,
        key_at: 0,
        value_at: 0,
    };
    upgraded.push(first(["env", "name"], world.into()));
    for leaf in leaves {
        let path = match leaf.path.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            ["env", "engine"] => continue,
            ["env", "game_version"] if !is_game => continue,
            ["env", "game_version"] => format!("env.{STAR_CRAFT}.game_version"),
            ["env", "map"] if is_matrix_game => continue,
            ["env", name] => format!("env.{SKIRMISH}.{name}"),
            ["env", "matrix_game", name] => format!("env.{MATRIX_GAME}.{name}"),
            [
                "policy",
                name @ ("common_knowledge" | "partitions" | "selector" | "delegation"),
            ] => {
                format!("algorithm.mackrl.{name}")
            }
            ["learner", "environments"] => {
                let environments = leaf.value.as_integer().unwrap_or(1).max(1);
                let shards = environments.saturating_add(SHARD_SIZE - 1) / SHARD_SIZE;
                upgraded.push(first(["algorithm", "shards"], shards.into()));
                "algorithm.environments".to_owned()
            }
            _ => renamed(&leaf.path).unwrap_or_else(|| leaf.path.join(".")),
        };
        upgraded.push(Leaf {
            path: path.split('.').map(str::to_owned).collect(),
            ..leaf
        });
    }
    upgraded
}
