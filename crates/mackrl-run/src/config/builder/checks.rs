//! What takes more than one value to check: ranges by declaration, the world, and the algorithm in it.

use std::sync::Arc;

use mackrl_env::{
    World, WorldError,
    settings::{Setting, SettingsError, WrongSetting},
};

use crate::config::{Config, ConfigError, EnvironmentConfig, Origin, error::shortened};

/// Checks a configuration, puts what is in force into it, and gives its world.
pub(in crate::config) fn check(
    config: &mut Config,
    origin_of: &dyn Fn(&str) -> Origin,
) -> Result<Arc<dyn World>, ConfigError> {
    let world = check_environment(&config.env, origin_of)?;
    check_in(config, &*world, origin_of)?;
    Ok(world)
}

/// As [`check`], in a world that is built already.
pub(super) fn check_in(
    config: &mut Config,
    world: &dyn World,
    origin_of: &dyn Fn(&str) -> Origin,
) -> Result<(), ConfigError> {
    let Config {
        algorithm,
        test,
        run,
        ..
    } = config;
    let declared = algorithm.kind.settings();
    ranges("algorithm", &declared, &algorithm.table, origin_of)?;
    for (section, violation) in [("test", test.violation()), ("run", run.violation())] {
        if let Some(violation) = violation {
            return Err(settings_error(section, violation.into(), origin_of));
        }
    }
    algorithm.table = (algorithm.kind)
        .check(&algorithm.table, world.spec())
        .map_err(|error| settings_error("algorithm", error, origin_of))?;
    Ok(())
}

/// Checks the world's settings and gives the world, in the built-in simulator where there is a choice.
pub(in crate::config) fn check_environment(
    env: &EnvironmentConfig,
    origin_of: impl Fn(&str) -> Origin,
) -> Result<Arc<dyn World>, ConfigError> {
    ranges("env", &env.kind.settings(), &env.table, &origin_of)?;
    if let Some(file) = env.missing_scenario() {
        return Err(ConfigError::Scenario {
            message: format!("the text of {file} is missing, expected it in env.scenario"),
        });
    }
    let simulated = env.simulated();
    let built = simulated.kind.build(&simulated.table);
    built.map_err(|error| world_error(error, &origin_of))
}

/// The first value of a complete table that its setting does not take.
pub(super) fn ranges(
    section: &str,
    declared: &[Setting],
    table: &toml::Table,
    origin_of: &dyn Fn(&str) -> Origin,
) -> Result<(), ConfigError> {
    let wrong = declared.iter().find_map(|setting| {
        let value = table.get(setting.name)?;
        (!setting.accepts.admits(value)).then_some((setting, value))
    });
    let Some((setting, value)) = wrong else {
        return Ok(());
    };
    let key = format!("{section}.{}", setting.name);
    Err(ConfigError::WrongValue {
        origin: origin_of(&key),
        key,
        found: shortened(&value.to_string()),
        expected: setting.accepts.to_string(),
    })
}

/// What the world has against its settings, with the place where they were written.
pub(in crate::config) fn world_error(
    error: WorldError,
    origin_of: &dyn Fn(&str) -> Origin,
) -> ConfigError {
    match error {
        WorldError::Settings(SettingsError::Wrong(wrong)) if wrong.name == "map" => {
            // The world names its most similar map, however different that is.
            let name = wrong.found.trim_matches('"');
            ConfigError::unknown_map(origin_of("env.map"), name, wrong.nearest.as_deref())
        }
        WorldError::Settings(error) => settings_error("env", error, origin_of),
        WorldError::Text { problem, .. } => ConfigError::Scenario { message: problem },
        error => ConfigError::World {
            message: error.to_string(),
        },
    }
}

/// What a kind has against its settings, with the place where they were written. Of two values that do not go together it
/// names the one that was written later.
pub(super) fn settings_error(
    section: &str,
    error: SettingsError,
    origin_of: &dyn Fn(&str) -> Origin,
) -> ConfigError {
    let key_of = |wrong: &WrongSetting| format!("{section}.{}", wrong.name);
    let wrong = match error {
        SettingsError::Wrong(wrong) => wrong,
        SettingsError::AtOdds(both) => {
            let [one, other] = *both;
            if origin_of(&key_of(&other)) > origin_of(&key_of(&one)) {
                other
            } else {
                one
            }
        }
        SettingsError::Unknown(name) => {
            let key = format!("{section}.{name}");
            return ConfigError::UnknownKey {
                origin: origin_of(&key),
                key: shortened(&key),
                nearest: None,
            };
        }
        error => {
            return ConfigError::World {
                message: error.to_string(),
            };
        }
    };
    let key = key_of(&wrong);
    ConfigError::WrongValue {
        origin: origin_of(&key),
        key,
        found: shortened(&wrong.found),
        expected: wrong.expected,
    }
}
