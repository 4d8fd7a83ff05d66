//! `mackrl maps`: what can be played.

use std::path::Path;

use anyhow::Context;
use mackrl::config::ConfigError;
use mackrl_env::{Environment, EnvironmentSpec, registry, skirmish::SkirmishSettings};
use serde::Serialize;

use crate::{
    args::{MapsArgs, read_scenario},
    output,
};

/// A map as it is listed, with the names that SMAC users know.
#[derive(Debug, Serialize)]
struct MapRow {
    name: String,
    n_agents: usize,
    n_enemies: usize,
    n_actions: usize,
    obs_size: usize,
    state_size: usize,
    episode_limit: usize,
}

impl From<&EnvironmentSpec> for MapRow {
    fn from(spec: &EnvironmentSpec) -> Self {
        Self {
            name: spec.name.clone(),
            n_agents: spec.agents,
            n_enemies: if spec.name == registry::MATRIX_GAME {
                0 // Its third entity is the matrix.
            } else {
                spec.entities - spec.agents
            },
            n_actions: spec.actions,
            obs_size: spec.observation_size,
            state_size: spec.state_size,
            episode_limit: spec.episode_limit,
        }
    }
}

pub(crate) fn run(args: &MapsArgs) -> anyhow::Result<()> {
    let specs = match &args.check {
        Some(file) => vec![checked(file)?],
        None => registry::specs(&SkirmishSettings::default()).context("cannot list the maps")?,
    };
    let rows: Vec<MapRow> = specs.iter().map(MapRow::from).collect();
    if args.json {
        output::print_json(&rows)
    } else {
        output::print(&table(&rows))
    }
}

/// Sizes of the scenario in `file`, if nothing is wrong with it.
fn checked(file: &Path) -> anyhow::Result<EnvironmentSpec> {
    let text = read_scenario(file)?;
    let name = file.display().to_string();
    let skirmish = registry::make_custom(&name, &text, &SkirmishSettings::default());
    let skirmish = skirmish.map_err(|error| ConfigError::Scenario {
        message: error.to_string(),
    })?;
    Ok(skirmish.spec().clone())
}

fn table(rows: &[MapRow]) -> String {
    let heading = [
        "name",
        "n_agents",
        "n_enemies",
        "n_actions",
        "obs_size",
        "state_size",
        "episode_limit",
    ];
    let mut cells = vec![heading.map(str::to_owned).to_vec()];
    cells.extend(rows.iter().map(|row| {
        let numbers = [
            row.n_agents,
            row.n_enemies,
            row.n_actions,
            row.obs_size,
            row.state_size,
            row.episode_limit,
        ];
        let mut line = vec![row.name.clone()];
        line.extend(numbers.map(|number| number.to_string()));
        line
    }));
    output::table(&cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_listed_with_the_names_that_smac_users_know() {
        let spec = EnvironmentSpec {
            name: "3m".to_owned(),
            agents: 3,
            entities: 6,
            entity_features: 5,
            actions: 9,
            observation_size: 30,
            state_size: 48,
            episode_limit: 60,
            distance_scale: 9.0,
        };
        let row = MapRow::from(&spec);
        insta::assert_snapshot!(table(&[MapRow::from(&spec)]), @r"
        name  n_agents  n_enemies  n_actions  obs_size  state_size  episode_limit
        3m           3          3          9        30          48             60
        ");
        assert_eq!(
            serde_json::to_string(&row).unwrap(),
            r#"{"name":"3m","n_agents":3,"n_enemies":3,"n_actions":9,"obs_size":30,"state_size":48,"episode_limit":60}"#
        );
    }
}
