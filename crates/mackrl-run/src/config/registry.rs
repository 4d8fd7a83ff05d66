//! The kinds of worlds and of algorithms that configurations can name.

use std::sync::{Arc, OnceLock};

use mackrl::algorithms::{self, AlgorithmKind, Preset};
use mackrl_env::{WorldKind, matrix_game::MatrixGameKind, sanity};
use mackrl_skirmish::{SKIRMISH, SkirmishKind};

use crate::config::{
    ConfigError, EnvironmentConfig, Kind, Origin, Setting, StarCraftKind,
    document::parse_document,
    error::{nearest, shortened},
    sections::{AlgorithmConfig, in_section, run_settings},
};

/// What can be named in a configuration. A value: programs make one, add kinds of their own and hand it on.
#[derive(Debug, Clone)]
pub struct Registry {
    worlds: Vec<Registered>,
    algorithms: Vec<Arc<dyn AlgorithmKind>>,
}

/// A kind of world, and the kind whose tables in presets and files hold for it too.
#[derive(Debug, Clone)]
struct Registered {
    kind: Arc<dyn WorldKind>,
    like: Option<&'static str>,
}

/// The preset that we recommend: its algorithm is the built-in one.
const RECOMMENDED: &str = "default";

/// The kinds that this program offers, once it has started.
static OFFERED: OnceLock<Registry> = OnceLock::new();

/// The kinds that this program offers: those that it [installed](Registry::install), else the built-in ones. Recorded runs are
/// read with them.
#[must_use]
pub fn registry() -> &'static Registry {
    OFFERED.get_or_init(Registry::built_in)
}

impl Default for Registry {
    fn default() -> Self {
        Self::built_in()
    }
}

impl Registry {
    /// Everything that is shipped. Where nothing names another, the first world is chosen, and the algorithm of the preset
    /// `default`.
    #[must_use]
    pub fn built_in() -> Self {
        let registry = Self {
            worlds: Vec::new(),
            algorithms: algorithms::built_in(),
        };
        registry
            .with_world(Arc::new(SkirmishKind))
            .with_world(Arc::new(MatrixGameKind))
            .with_worlds(sanity::kinds())
            .with_world_like(Arc::new(StarCraftKind), SKIRMISH)
    }

    /// Makes this what the program offers, from its start on; gives it back if something was read with another before.
    ///
    /// # Errors
    /// The registry itself, if [`registry`] was asked before.
    pub fn install(self) -> Result<(), Self> {
        OFFERED.set(self)
    }

    /// With another kind of world, in place of one that has its name.
    #[must_use]
    pub fn with_world(self, kind: Arc<dyn WorldKind>) -> Self {
        self.register(Registered { kind, like: None })
    }

    /// As [`Registry::with_world`], for a kind for which tables of the kind `like` in presets and files hold too.
    #[must_use]
    pub fn with_world_like(self, kind: Arc<dyn WorldKind>, like: &'static str) -> Self {
        let like = Some(like);
        self.register(Registered { kind, like })
    }

    fn with_worlds(self, kinds: Vec<Arc<dyn WorldKind>>) -> Self {
        kinds.into_iter().fold(self, Self::with_world)
    }

    fn register(mut self, world: Registered) -> Self {
        let same = |other: &&mut Registered| other.kind.name() == world.kind.name();
        match self.worlds.iter_mut().find(same) {
            Some(place) => *place = world,
            None => self.worlds.push(world),
        }
        self
    }

    /// With another algorithm, in place of one that has its name.
    #[must_use]
    pub fn with_algorithm(mut self, kind: Arc<dyn AlgorithmKind>) -> Self {
        let same = |other: &&mut Arc<dyn AlgorithmKind>| other.name() == kind.name();
        match self.algorithms.iter_mut().find(same) {
            Some(place) => *place = kind,
            None => self.algorithms.push(kind),
        }
        self
    }

    /// The kinds of worlds.
    pub fn worlds(&self) -> impl Iterator<Item = &Arc<dyn WorldKind>> {
        self.worlds.iter().map(|world| &world.kind)
    }

    /// The algorithms.
    pub fn algorithms(&self) -> impl Iterator<Item = &Arc<dyn AlgorithmKind>> {
        self.algorithms.iter()
    }

    /// The kind of world called `name`.
    #[must_use]
    pub fn world(&self, name: &str) -> Option<&Arc<dyn WorldKind>> {
        self.worlds().find(|kind| kind.name() == name)
    }

    /// The algorithm called `name`.
    #[must_use]
    pub fn algorithm(&self, name: &str) -> Option<&Arc<dyn AlgorithmKind>> {
        self.algorithms().find(|kind| kind.name() == name)
    }

    /// Whether a table for worlds of the kind `table` holds for those of the kind `chosen`.
    pub(super) fn holds_for(&self, table: &str, chosen: &str) -> bool {
        let is_like = |world: &Registered| world.kind.name() == chosen && world.like == Some(table);
        table == chosen || self.worlds.iter().any(is_like)
    }

    /// The built-in world.
    pub(super) fn default_environment(&self) -> EnvironmentConfig {
        let first = self.worlds.first().map(|world| Arc::clone(&world.kind));
        EnvironmentConfig::new(first.unwrap_or_else(|| Arc::new(SkirmishKind)))
    }

    /// The built-in algorithm: the one that brings the preset `default` along.
    pub(super) fn default_algorithm(&self) -> AlgorithmConfig {
        let is_recommended = |kind: &&Arc<dyn AlgorithmKind>| {
            let mut presets = kind.presets().iter();
            presets.any(|preset| preset.name == RECOMMENDED)
        };
        let mut algorithms = self.algorithms.iter();
        let recommended = algorithms.find(is_recommended).map(Arc::clone);
        AlgorithmConfig::new(recommended.unwrap_or_else(|| Arc::new(algorithms::MackrlPpo)))
    }

    /// All shipped presets, `default` first, which is what we recommend.
    pub fn presets(&self) -> impl Iterator<Item = Preset> {
        let presets = self.algorithms.iter().flat_map(|kind| kind.presets());
        let mut presets: Vec<Preset> = presets.copied().collect();
        presets.sort_by_key(|preset| preset.name != RECOMMENDED);
        presets.into_iter()
    }

    /// The preset called `name`.
    ///
    /// # Errors
    /// [`ConfigError::UnknownPreset`] names the nearest one.
    pub fn preset(&self, name: &str) -> Result<Preset, ConfigError> {
        let found = self.presets().find(|preset| preset.name == name);
        found.ok_or_else(|| {
            let names: Vec<&str> = self.presets().map(|preset| preset.name).collect();
            ConfigError::UnknownPreset {
                name: shortened(name),
                expected: names.join(", "),
                nearest: nearest(name, names),
            }
        })
    }

    /// Every setting of every kind, each key once, in the order of a configuration.
    #[must_use]
    pub fn settings(&self) -> Vec<Setting> {
        let mut settings: Vec<Setting> = Vec::new();
        let worlds = self.worlds().map(|kind| all_of(&**kind));
        let algorithms = self.algorithms().map(|kind| all_of(&**kind));
        for setting in worlds.chain(algorithms).flatten().chain(run_settings()) {
            if !settings.iter().any(|known| known.key == setting.key) {
                settings.push(setting);
            }
        }
        settings
    }

    /// The setting called `name`, or those in the section called so.
    ///
    /// # Errors
    /// [`ConfigError::UnknownKey`] at `origin`, with the nearest key.
    pub fn settings_called(&self, name: &str, origin: Origin) -> Result<Vec<Setting>, ConfigError> {
        let mut settings = self.settings();
        let section = format!("{name}.");
        let is_meant = |setting: &Setting| setting.key == name || setting.key.starts_with(&section);
        if !settings.iter().any(is_meant) {
            let keys = settings.iter().map(|setting| setting.key.as_str());
            return Err(ConfigError::unknown_key(origin, name, keys));
        }
        settings.retain(is_meant);
        Ok(settings)
    }
}

/// The setting that names the kind is declared by the configuration itself.
fn all_of<K: Kind + ?Sized>(kind: &K) -> Vec<Setting> {
    let mut settings = vec![Setting::name_of::<K>()];
    settings.extend(in_section(K::SECTION, kind.declared()));
    settings
}

/// What the file of a preset says behind the value of the setting `key`: why it is so, and where the paper says it.
#[must_use]
pub fn remark(preset: Preset, key: &str) -> Option<&'static str> {
    let leaves = parse_document(preset.text).ok()?;
    let (section, name) = key.split_once('.')?;
    // The setting of one kind may stand in a table of its own: [algorithm.mackrl].
    let is_meant = |path: &[String]| {
        let ends = (
            path.first().map(String::as_str),
            path.last().map(String::as_str),
        );
        ends == (Some(section), Some(name))
    };
    let leaf = leaves.iter().find(|leaf| is_meant(&leaf.path))?;
    let line = preset.text.get(leaf.value_at..)?.lines().next()?;
    let (_, remark) = line.split_once('#')?;
    Some(remark.trim())
}

#[cfg(test)]
mod tests {
    use crate::config::{Config, ConfigBuilder};

    use super::*;

    #[test]
    fn every_preset_loads_and_sets_every_setting_of_the_run() {
        let registry = Registry::built_in();
        for preset in registry.presets() {
            let builder = ConfigBuilder::new(&registry).preset(preset.name).unwrap();
            let resolved = builder.resolve().unwrap();
            // A preset goes with any world, and changes of worlds what the paper's code changes.
            let settings = resolved.config().settings().into_iter();
            let chosen_by_presets = |key: &str| {
                ["env.name", "env.map"].contains(&key)
                    || !key.starts_with("env.") && key != "run.initial_weights"
            };
            for setting in settings.filter(|setting| chosen_by_presets(&setting.key)) {
                assert_ne!(
                    resolved.origin(&setting.key),
                    Origin::BuiltIn,
                    "preset {} leaves {} out",
                    preset.name,
                    setting.key
                );
            }
        }
    }

    #[test]
    fn a_preset_goes_with_any_world_and_any_algorithm() {
        let registry = Registry::built_in();
        for preset in registry.presets() {
            for world in registry.worlds() {
                for algorithm in registry.algorithms() {
                    let builder = ConfigBuilder::new(&registry)
                        .preset(preset.name)
                        .and_then(|builder| builder.set(&format!("env.name={}", world.name())))
                        .and_then(|builder| {
                            builder.set(&format!("algorithm.name={}", algorithm.name()))
                        });
                    let built = builder.unwrap().build();
                    if algorithm.name() == "jal"
                        && let Err(refused) = &built
                    {
                        // The team of the preset's map is too large for one controller.
                        assert!(refused.to_string().contains("joint actions"), "{refused}");
                        continue;
                    }
                    let config = built.unwrap();
                    let names = (config.env.name(), config.algorithm.name());
                    assert_eq!(names, (world.name(), algorithm.name()));
                    let moves = config.get("env.move_amount");
                    let expected = match (world.name(), preset.name) {
                        ("skirmish" | "sc2", "paper-code" | "paper-figures" | "fours") => {
                            Some(toml::Value::Float(5.0))
                        }
                        ("skirmish" | "sc2", _) => Some(toml::Value::Float(2.0)),
                        _ => None,
                    };
                    assert_eq!(moves, expected, "{} in {}", preset.name, world.name());
                }
            }
        }
    }

    #[test]
    fn what_is_built_in_is_the_default_preset() {
        let preset = ConfigBuilder::new(&Registry::built_in()).preset(RECOMMENDED);
        assert_eq!(preset.unwrap().build().unwrap(), Config::default());
    }

    #[test]
    fn a_preset_says_where_the_paper_says_so() {
        let paper = Registry::built_in().preset("paper").unwrap();
        let lambda = remark(paper, "algorithm.lambda");
        assert_eq!(lambda, Some("\"TD-lambda of 0.8\""));
        assert!(remark(paper, "algorithm.partitions").is_some());
        assert_eq!(remark(paper, "algorithm.lambd"), None);
    }

    #[test]
    fn every_preset_says_how_to_run_it() {
        for preset in Registry::built_in().presets() {
            let command = format!(" --preset {}", preset.name);
            let mut lines = preset.text.lines();
            let says =
                lines.any(|line| line.contains("mackrl train --map ") && line.contains(&command));
            assert!(says, "{}", preset.name);
        }
    }
}
