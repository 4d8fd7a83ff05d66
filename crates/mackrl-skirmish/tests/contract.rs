//! Every map keeps the contract of environments and has the sizes of SMAC's.

use mackrl_env::{
    Environment,
    contract::{Coverage, check_environment},
};
use mackrl_skirmish::{MakeError, SkirmishSettings};

/// The table of the SMAC client.
const SMAC_MAPS: &str = include_str!("golden/smac_maps.md");

#[test]
fn every_map_keeps_the_contract() {
    let mut total = Coverage::default();
    for name in mackrl_skirmish::map_names() {
        let mut environment = mackrl_skirmish::make(name, &SkirmishSettings::default()).unwrap();
        let coverage = check_environment(&mut environment, 3);
        total.alterations += coverage.alterations;
        total.other_actions += coverage.other_actions;
    }
    // Not on every map: some episodes end before anybody is out of somebody's sight.
    assert!(total.alterations > 30, "{total:?}");
    assert!(total.other_actions > 50, "{total:?}");
}

#[test]
fn maps_have_the_sizes_of_smac() {
    let mut names = Vec::new();
    for line in SMAC_MAPS
        .lines()
        .filter(|line| line.starts_with("| "))
        .skip(1)
    {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        // The last number of "4+3x5+2x5+1 = **30**" is the size.
        let number = |cell: usize| -> usize {
            let last = cells[cell]
                .rsplit(' ')
                .next()
                .expect("a cell has a last word");
            last.trim_matches('*').parse().expect("a number")
        };
        let environment = mackrl_skirmish::make(cells[1], &SkirmishSettings::default())
            .unwrap_or_else(|error| panic!("{}: {error}", cells[1]));
        let spec = environment.spec();
        let found = [
            spec.agents,
            spec.entities - spec.agents,
            spec.episode_limit,
            spec.actions,
            spec.observation_size,
            spec.state_size,
        ];
        assert_eq!(found, [2, 3, 5, 9, 10, 11].map(number), "{}", cells[1]);
        names.push(cells[1]);
    }
    assert_eq!(mackrl_skirmish::map_names(), names);
}

#[test]
fn every_option_keeps_the_contract_and_changes_sizes_as_smac_says() {
    let default = SkirmishSettings::default;
    // Changes of the sizes of an observation and of the state of MMM: 10 agents, 10 enemies, 3 type bits, no shields.
    let options = [
        (
            "obs_own_health",
            SkirmishSettings {
                obs_own_health: false,
                ..default()
            },
            159,
            290,
        ),
        (
            "obs_all_health",
            SkirmishSettings {
                obs_all_health: false,
                ..default()
            },
            141,
            290,
        ),
        (
            "obs_pathing_grid",
            SkirmishSettings {
                obs_pathing_grid: true,
                ..default()
            },
            168,
            290,
        ),
        (
            "obs_terrain_height",
            SkirmishSettings {
                obs_terrain_height: true,
                ..default()
            },
            169,
            290,
        ),
        (
            "obs_timestep_number",
            SkirmishSettings {
                obs_timestep_number: true,
                ..default()
            },
            161,
            290,
        ),
        (
            "obs_last_action",
            SkirmishSettings {
                obs_last_action: true,
                ..default()
            },
            304,
            290,
        ),
        (
            "state_last_action",
            SkirmishSettings {
                state_last_action: false,
                ..default()
            },
            160,
            130,
        ),
        (
            "state_timestep_number",
            SkirmishSettings {
                state_timestep_number: true,
                ..default()
            },
            160,
            291,
        ),
        (
            "obs_instead_of_state",
            SkirmishSettings {
                obs_instead_of_state: true,
                ..default()
            },
            160,
            1600,
        ),
    ];
    for (option, settings, observation, state) in options {
        let mut environment = mackrl_skirmish::make("MMM", &settings).unwrap();
        let spec = environment.spec();
        assert_eq!(
            (spec.observation_size, spec.state_size),
            (observation, state),
            "{option}"
        );
        check_environment(&mut environment, 1);
    }
}

#[test]
fn a_misspelt_name_is_answered_with_the_nearest() {
    let error = mackrl_skirmish::make("2z3s", &SkirmishSettings::default()).err();
    assert_eq!(
        error,
        Some(MakeError::UnknownName {
            name: "2z3s".to_owned(),
            nearest: "2s3z"
        })
    );
}
