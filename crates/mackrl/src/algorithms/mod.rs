//! What can learn: a registry of algorithms, and a folder for each.
//!
//! An algorithm declares its own settings, what they mean and which go together, and brings its presets along, so that
//! configurations, help texts, explanations and schemas follow from its folder. Adding one takes that folder and a line in
//! [`built_in`].

mod actor_critic;
mod central_v;
mod mackrl;

use std::{fmt::Debug, sync::Arc};

use mackrl_env::{
    EnvironmentSpec,
    settings::{Setting, SettingsError},
};

pub use actor_critic::{ActorCriticSettings, OptimiserName};
pub use central_v::CentralV;
pub use mackrl::{Mackrl, MackrlSettings, PartitionChoice};

/// An algorithm that configurations can name, with the settings that it declares.
pub trait AlgorithmKind: Send + Sync + Debug {
    /// How configurations call it, such as `mackrl`.
    fn name(&self) -> &'static str;

    /// What it is, in one sentence.
    fn summary(&self) -> &'static str;

    /// Its settings, in the order in which they are shown.
    fn settings(&self) -> Vec<Setting>;

    /// The built-in value of each of them, in the same order.
    fn defaults(&self) -> toml::Table;

    /// Values that a world of these sizes asks for and that take the place of those in `table`, unless a user chose a value:
    /// presets are written for small teams.
    fn automatic(&self, table: &toml::Table, spec: &EnvironmentSpec) -> Vec<Automatic> {
        let _ = (table, spec);
        Vec::new()
    }

    /// Checks a complete table: ranges, combinations, and what depends on the sizes of the world. Gives the table that is in
    /// force.
    ///
    /// # Errors
    /// [`SettingsError`] with the first setting that is out of its range, or does not go with another or with the world.
    fn check(
        &self,
        table: &toml::Table,
        spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError>;

    /// Configurations that are shipped with it.
    fn presets(&self) -> &'static [Preset] {
        &[]
    }
}

/// A value that follows from the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Automatic {
    /// Name of the setting.
    pub name: &'static str,
    /// Its value.
    pub value: toml::Value,
    /// Why it is what it is.
    pub why: &'static str,
}

/// A shipped configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Preset {
    /// Name, as given to `--preset`.
    pub name: &'static str,
    /// The file, with its comments.
    pub text: &'static str,
}

/// The algorithms of this crate, the recommended one first.
#[must_use]
pub fn built_in() -> Vec<Arc<dyn AlgorithmKind>> {
    vec![Arc::new(Mackrl), Arc::new(CentralV)]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_algorithm_gives_each_of_its_settings_a_value_that_it_takes() {
        for kind in built_in() {
            let defaults = kind.defaults();
            let names: Vec<&str> = defaults.keys().map(String::as_str).collect();
            let declared: Vec<&str> = kind.settings().iter().map(|one| one.name).collect();
            assert_eq!(names, declared, "{}", kind.name());
            for setting in kind.settings() {
                assert!(setting.accepts.admits(&defaults[setting.name]));
                assert!(setting.meaning.ends_with('.'), "{}", setting.name);
            }
        }
    }

    #[test]
    fn names_of_algorithms_and_of_presets_are_their_own() {
        let kinds = built_in();
        let presets = kinds.iter().flat_map(|kind| kind.presets());
        let mut seen = BTreeSet::new();
        let names = presets.map(|preset| preset.name);
        for name in names.chain(kinds.iter().map(|kind| kind.name())) {
            assert!(seen.insert(name), "{name} stands for two things");
        }
    }
}
