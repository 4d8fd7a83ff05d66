//! Skirmishes as a kind of world: a table of settings names the map and how it is played.

use std::sync::Arc;

use mackrl_env::{
    Prototype, World, WorldError, WorldKind, declare_settings,
    settings::{Accepts, Setting, Settings, SettingsError, WrongSetting},
};

use crate::{
    MakeError, SIMULATOR_VERSION, Skirmish, SkirmishError, SkirmishSettings, make, make_custom,
    scenario,
};

/// The name by which configurations call this kind.
pub const SKIRMISH: &str = "skirmish";

declare_settings! {
    /// Where a skirmish is played.
    pub struct PlaceSettings {
        /// Name of the map, or a scenario file ending in .toml.
        map: String = "3m".to_owned(), Accepts::Text { expects: EXPECTED_MAP, pattern: None };
        /// Text of a scenario that is played instead of a shipped map; filled in from the file that map names. It is stored, not its
        /// file's name alone, so that a run's configuration holds all that its result depends on.
        scenario: String = String::new(), Accepts::Text { expects: "the text of a scenario file, as `mackrl maps --check` accepts it", pattern: None };
    }
}

const EXPECTED_MAP: &str = "a name that `mackrl maps` lists, or a file ending in .toml";

/// Skirmishes as a kind of world. Its settings are those of [`PlaceSettings`], then those of [`SkirmishSettings`].
#[derive(Debug, Clone, Copy, Default)]
pub struct SkirmishKind;

impl SkirmishKind {
    /// Reads where a skirmish is played and how.
    ///
    /// # Errors
    /// [`SettingsError`] if a name is unknown, a value is none that its setting takes, or two do not go together.
    pub fn read(table: &toml::Table) -> Result<(PlaceSettings, SkirmishSettings), SettingsError> {
        let is_place = |name: &String| PlaceSettings::DECLARED.iter().any(|s| s.name == name);
        let (place, others): (toml::Table, toml::Table) = table
            .clone()
            .into_iter()
            .partition(|(name, _)| is_place(name));
        let place = PlaceSettings::read(&place)?;
        let settings = SkirmishSettings::read(&others)?;
        settings.check_ranges()?;
        Ok((place, settings))
    }

    /// Builds the skirmish that `table` describes, whose units can be looked at.
    ///
    /// # Errors
    /// As [`WorldKind::build`].
    pub fn skirmish(table: &toml::Table) -> Result<Skirmish, WorldError> {
        let (place, settings) = Self::read(table)?;
        place.skirmish(&settings)
    }
}

impl PlaceSettings {
    /// Builds the skirmish that is played here under `settings`.
    ///
    /// # Errors
    /// [`WorldError`] if there is no such map, the scenario is faulty, or a setting has a value that it does not take.
    pub fn skirmish(&self, settings: &SkirmishSettings) -> Result<Skirmish, WorldError> {
        if !self.scenario.is_empty() {
            return make_custom(&self.map, &self.scenario, settings).map_err(WorldError::from);
        }
        if self.map.ends_with(".toml") {
            return Err(wrong_setting(WrongSetting {
                name: "scenario".to_owned(),
                found: "\"\"".to_owned(),
                expected: format!("the text of {}", self.map),
                nearest: None,
            }));
        }
        make(&self.map, settings).map_err(WorldError::from)
    }

    /// The world of the skirmish that is played here under `settings`.
    ///
    /// # Errors
    /// As [`PlaceSettings::skirmish`].
    pub fn world(&self, settings: &SkirmishSettings) -> Result<Arc<dyn World>, WorldError> {
        let world = Prototype::new(SKIRMISH, self.skirmish(settings)?)?
            .version(SIMULATOR_VERSION.to_string())
            .data(self.data(settings));
        Ok(Arc::new(world))
    }

    /// The data that the skirmish is made of, as text: the map's file or the scenario, then the file of unit statistics.
    #[must_use]
    pub fn data(&self, settings: &SkirmishSettings) -> String {
        let map = if self.scenario.is_empty() {
            scenario::map_text(&self.map).unwrap_or_default()
        } else {
            &self.scenario
        };
        map.to_owned() + settings.units.text()
    }
}

impl WorldKind for SkirmishKind {
    fn name(&self) -> &str {
        SKIRMISH
    }

    fn summary(&self) -> &str {
        "StarCraft micromanagement on SMAC's maps or on your own, in the built-in simulator"
    }

    fn settings(&self) -> Vec<Setting> {
        [PlaceSettings::DECLARED, SkirmishSettings::DECLARED].concat()
    }

    fn defaults(&self) -> toml::Table {
        let mut defaults = PlaceSettings::defaults();
        defaults.extend(SkirmishSettings::defaults());
        defaults
    }

    fn build(&self, table: &toml::Table) -> Result<Arc<dyn World>, WorldError> {
        let (place, settings) = Self::read(table)?;
        place.world(&settings)
    }
}

impl From<MakeError> for WorldError {
    fn from(error: MakeError) -> Self {
        match error {
            MakeError::UnknownName { name, nearest } => wrong_setting(WrongSetting {
                name: "map".to_owned(),
                found: toml::Value::String(name).to_string(),
                expected: EXPECTED_MAP.to_owned(),
                nearest: Some(nearest.to_owned()),
            }),
            MakeError::Skirmish(error) => error.into(),
        }
    }
}

impl From<SkirmishError> for WorldError {
    fn from(error: SkirmishError) -> Self {
        match error {
            SkirmishError::Setting {
                key,
                found,
                expected,
            } => wrong_setting(WrongSetting {
                name: key.to_owned(),
                found,
                expected,
                nearest: None,
            }),
            SkirmishError::Scenario { .. } => Self::Text {
                setting: "scenario".to_owned(),
                problem: error.to_string(),
            },
            SkirmishError::UnitFile(_)
            | SkirmishError::MapFile { .. }
            | SkirmishError::ReferenceFile(_) => Self::Unavailable(error.to_string()),
        }
    }
}

fn wrong_setting(wrong: WrongSetting) -> WorldError {
    SettingsError::from(wrong).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn build(text: &str) -> Result<Arc<dyn World>, WorldError> {
        SkirmishKind.build(&text.parse().unwrap())
    }

    fn message(text: &str) -> String {
        build(text).unwrap_err().to_string()
    }

    #[test]
    fn a_table_names_the_map_and_how_it_is_played() {
        let world = build("map = \"2s3z\"\nsight_range = 8\nunits = \"lotv\"").unwrap();
        assert_eq!((world.kind(), world.name()), ("skirmish", "2s3z"));
        assert_eq!(world.spec().agents, 5);
        assert_eq!(world.spec().distance_scale, 8.0);
        assert_eq!(world.version(), SIMULATOR_VERSION.to_string());
        let files = [
            include_str!("../maps/2s3z.toml"),
            include_str!("../units/lotv.toml"),
        ];
        assert_eq!(world.data(), files.concat());
    }

    #[test]
    fn every_declared_setting_has_a_default_that_builds() {
        let defaults = SkirmishKind.defaults();
        let mut names: Vec<&str> = SkirmishKind.settings().iter().map(|s| s.name).collect();
        names.sort_unstable();
        let mut of_defaults: Vec<&String> = defaults.keys().collect();
        of_defaults.sort_unstable();
        assert_eq!(names, of_defaults);
        assert_eq!(SkirmishKind.build(&defaults).unwrap().name(), "3m");
    }

    #[test]
    fn a_table_is_refused_with_the_setting_what_was_found_and_what_was_expected() {
        assert_eq!(
            message("sight_rang = 9.0"),
            "no setting is called `sight_rang`"
        );
        assert_eq!(
            message("map = \"3n\""),
            "setting `map` is \"3n\", expected a name that `mackrl maps` lists, or a file ending in .toml, did you mean `3m`?"
        );
        assert_eq!(
            message("step_mul = 0"),
            "setting `step_mul` is 0, expected an integer in [1, 64]"
        );
        assert_eq!(
            message("map = \"duel.toml\""),
            "setting `scenario` is \"\", expected the text of duel.toml"
        );
        assert!(
            matches!(
                build("shoot_range = 9.5"),
                Err(WorldError::Settings(SettingsError::AtOdds(both)))
                    if (&*both[0].name, &*both[1].name) == ("shoot_range", "sight_range")
            ),
            "aiming beyond sight is a matter of two settings"
        );
    }

    #[test]
    fn a_faulty_scenario_is_told_with_its_place() {
        let error = build("map = \"duel.toml\"\nscenario = \"terrain = 3\"").unwrap_err();
        assert!(
            matches!(&error, WorldError::Text { setting, problem }
                if setting == "scenario" && problem.starts_with("duel.toml:1:")),
            "{error}"
        );
    }

    #[test]
    fn environments_of_one_world_share_nothing_that_moves() {
        use mackrl_env::{EpisodeKey, Observations, Stream};
        let world = build("").unwrap();
        let [mut one, mut other] = [world.make(), world.make()];
        let mut observations = Observations::new(world.spec(), 2);
        one.reset(
            EpisodeKey::new(1, Stream::Other, 0),
            &mut observations.row_mut(0),
        );
        let before = observations.clone();
        other.reset(
            EpisodeKey::new(2, Stream::Other, 7),
            &mut observations.row_mut(1),
        );
        one.reset(
            EpisodeKey::new(1, Stream::Other, 0),
            &mut observations.row_mut(0),
        );
        assert_eq!(before.state(0), observations.state(0));
        assert_ne!(observations.state(0), observations.state(1));
    }
}
