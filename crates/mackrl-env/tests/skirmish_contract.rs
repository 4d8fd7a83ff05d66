//! Every registered environment, the matrix game included, keeps the contract, and skirmishes have the sizes of SMAC's maps.

use mackrl_env::{
    contract::check_environment,
    matrix_game::{InvalidProbability, MatrixGameSettings},
    registry::{self, MakeError},
    skirmish::SkirmishSettings,
};

/// Name, agents, enemies, actions, observation size, state size, episode limit: the table of the SMAC client.
const TABLE: &[(&str, [usize; 6])] = &[
    ("3m", [3, 3, 9, 30, 48, 60]),
    ("8m", [8, 8, 14, 80, 168, 120]),
    ("25m", [25, 25, 31, 250, 950, 150]),
    ("5m_vs_6m", [5, 6, 12, 55, 98, 70]),
    ("8m_vs_9m", [8, 9, 15, 85, 179, 120]),
    ("10m_vs_11m", [10, 11, 17, 105, 243, 150]),
    ("27m_vs_30m", [27, 30, 36, 285, 1170, 180]),
    ("MMM", [10, 10, 16, 160, 290, 150]),
    ("MMM2", [10, 12, 18, 176, 322, 180]),
    ("2s3z", [5, 5, 11, 80, 120, 120]),
    ("3s5z", [8, 8, 14, 128, 216, 150]),
    ("3s5z_vs_3s6z", [8, 9, 15, 136, 230, 170]),
    ("3s_vs_3z", [3, 3, 9, 36, 54, 150]),
    ("3s_vs_4z", [3, 4, 10, 42, 61, 200]),
    ("3s_vs_5z", [3, 5, 11, 48, 68, 250]),
    ("1c3s5z", [9, 9, 15, 162, 270, 180]),
    ("2m_vs_1z", [2, 1, 7, 16, 26, 150]),
    ("corridor", [6, 24, 30, 156, 282, 400]),
    ("6h_vs_8z", [6, 8, 14, 78, 140, 150]),
    ("2s_vs_1sc", [2, 1, 7, 17, 27, 300]),
    ("so_many_baneling", [7, 32, 38, 202, 397, 100]),
    ("bane_vs_bane", [24, 24, 30, 336, 984, 200]),
    ("2c_vs_64zg", [2, 64, 70, 332, 342, 400]),
];

#[test]
fn every_registered_environment_keeps_the_contract() {
    for name in registry::names() {
        let mut environment = registry::make(name, &SkirmishSettings::default()).unwrap();
        check_environment(environment.as_mut(), 2);
    }
}

#[test]
fn the_matrix_game_is_registered_with_its_default_settings() {
    assert_eq!(registry::names().last(), Some(&registry::MATRIX_GAME));
    let game = registry::make(registry::MATRIX_GAME, &SkirmishSettings::default()).unwrap();
    assert_eq!(
        (game.spec().name.as_str(), game.spec().agents),
        (registry::MATRIX_GAME, 2)
    );
    let settings = MatrixGameSettings {
        common_knowledge: 1.5,
        ..MatrixGameSettings::default()
    };
    assert_eq!(
        registry::make_matrix_game(settings).err(),
        Some(MakeError::MatrixGame(InvalidProbability(1.5)))
    );
}

#[test]
fn maps_have_the_sizes_of_smac() {
    let names: Vec<&str> = TABLE.iter().map(|(name, _)| *name).collect();
    assert_eq!(registry::map_names(), names);
    for (name, sizes) in TABLE {
        let environment = registry::make(name, &SkirmishSettings::default())
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let spec = environment.spec();
        let found = [
            spec.agents,
            spec.entities - spec.agents,
            spec.actions,
            spec.observation_size,
            spec.state_size,
            spec.episode_limit,
        ];
        assert_eq!(found, *sizes, "{name}");
    }
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
        let mut environment = registry::make("MMM", &settings).unwrap();
        let spec = environment.spec();
        assert_eq!(
            (spec.observation_size, spec.state_size),
            (observation, state),
            "{option}"
        );
        check_environment(environment.as_mut(), 1);
    }
}

#[test]
fn a_misspelt_name_is_answered_with_the_nearest() {
    let error = registry::make("2z3s", &SkirmishSettings::default()).err();
    assert_eq!(
        error,
        Some(MakeError::UnknownName {
            name: "2z3s".to_owned(),
            nearest: "2s3z"
        })
    );
}
