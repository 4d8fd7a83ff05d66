//! The shipped presets: complete, commented configurations.

use crate::config::{ConfigError, document::parse_document, error::nearest};

/// A shipped configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Preset {
    /// Name, as given to `--preset`.
    pub name: &'static str,
    /// The file, with its comments.
    pub text: &'static str,
}

/// All shipped presets, the recommended one first.
#[must_use]
pub const fn presets() -> &'static [Preset] {
    &[
        Preset {
            name: "default",
            text: include_str!("../../presets/default.toml"),
        },
        Preset {
            name: "paper",
            text: include_str!("../../presets/paper.toml"),
        },
        Preset {
            name: "paper-code",
            text: include_str!("../../presets/paper-code.toml"),
        },
    ]
}

impl Preset {
    /// What the file says behind the value of the setting `key`: why it is so, and where the paper says it.
    #[must_use]
    pub fn remark(&self, key: &str) -> Option<&'static str> {
        let leaves = parse_document(self.text).ok()?;
        let leaf = leaves.iter().find(|leaf| leaf.path.join(".") == key)?;
        let line = self.text.get(leaf.value_at..)?.lines().next()?;
        let (_, remark) = line.split_once('#')?;
        Some(remark.trim())
    }

    /// The preset called `name`.
    ///
    /// # Errors
    /// [`ConfigError::UnknownPreset`] names the nearest one.
    pub fn named(name: &str) -> Result<Self, ConfigError> {
        let names = presets().iter().map(|preset| preset.name);
        presets()
            .iter()
            .find(|preset| preset.name == name)
            .copied()
            .ok_or_else(|| ConfigError::UnknownPreset {
                name: name.to_owned(),
                expected: names.clone().collect::<Vec<_>>().join(", "),
                nearest: nearest(name, names),
            })
    }
}

#[cfg(test)]
mod tests {
    use crate::config::{Config, ConfigBuilder, Origin};

    use super::*;

    #[test]
    fn every_preset_loads_and_sets_every_setting_of_the_run() {
        for preset in presets() {
            let builder = ConfigBuilder::new().preset(preset.name).unwrap();
            builder.build().unwrap();
            // A preset goes with any world, and changes of worlds what the paper's code changes.
            let settings = Config::settings().into_iter();
            let chosen_by_presets = |key: &str| key == "env.map" || !key.starts_with("env.");
            for setting in settings.filter(|setting| chosen_by_presets(&setting.key)) {
                assert_ne!(
                    builder.origin(&setting.key),
                    Origin::BuiltIn,
                    "preset {} leaves {} out",
                    preset.name,
                    setting.key
                );
            }
        }
    }

    #[test]
    fn the_default_preset_is_what_is_built_in() {
        let preset = ConfigBuilder::new().preset("default").unwrap();
        assert_eq!(preset.build().unwrap(), Config::default());
    }

    #[test]
    fn a_preset_says_where_the_paper_says_so() {
        let paper = Preset::named("paper").unwrap();
        assert_eq!(paper.remark("learner.lambda"), Some("\"TD-lambda of 0.8\""));
        assert_eq!(paper.remark("learner.lambd"), None);
    }

    #[test]
    fn every_preset_file_is_shipped_and_says_how_to_run_it() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../presets");
        let mut files: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        files.sort();
        let mut shipped: Vec<String> = presets()
            .iter()
            .map(|preset| format!("{}.toml", preset.name))
            .collect();
        shipped.sort();
        assert_eq!(files, shipped);
        for preset in presets() {
            let command = format!("mackrl train --map 3m --preset {}", preset.name);
            assert!(preset.text.contains(&command), "{}", preset.name);
        }
    }
}
