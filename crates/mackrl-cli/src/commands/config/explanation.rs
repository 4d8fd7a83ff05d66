//! What is to be known about one setting.

use mackrl_run::config::{Config, ConfigBuilder, ConfigError, Origin, Setting, presets};
use serde::Serialize;

/// A setting with its meaning, and its value wherever it has one.
#[derive(Debug, Serialize)]
pub(super) struct Explanation {
    key: String,
    meaning: &'static str,
    accepts: String,
    built_in: Option<toml::Value>,
    presets: Vec<PresetValue>,
    /// In the configuration that was asked about.
    value: Option<toml::Value>,
    /// Where that was written.
    origin: String,
    /// Whether a file or a flag changed what the preset says.
    #[serde(skip)]
    changed: bool,
}

/// A setting in a shipped preset.
#[derive(Debug, Serialize)]
struct PresetValue {
    preset: &'static str,
    value: Option<toml::Value>,
    /// Why it is so, and where the paper says it.
    remark: Option<&'static str>,
}

impl Explanation {
    /// Of a setting, in the configuration that `layers` gave.
    ///
    /// # Errors
    /// Never: shipped presets can be read.
    pub(super) fn of(
        setting: &Setting,
        config: &Config,
        layers: &ConfigBuilder,
    ) -> Result<Self, ConfigError> {
        let key = &setting.key;
        let in_presets = presets().iter().map(|preset| {
            let config = ConfigBuilder::new().preset(preset.name)?.build()?;
            Ok(PresetValue {
                preset: preset.name,
                value: config.get(key),
                remark: preset.remark(key),
            })
        });
        let origin = layers.origin(key);
        Ok(Self {
            key: key.clone(),
            meaning: setting.meaning,
            accepts: setting.accepts.to_string(),
            built_in: Config::default().get(key),
            presets: in_presets.collect::<Result<_, _>>()?,
            value: config.get(key),
            changed: !matches!(origin, Origin::BuiltIn | Origin::Preset { .. }),
            origin: origin.to_string(),
        })
    }

    /// For people.
    pub(super) fn text(&self) -> String {
        let shown = |value: &Option<toml::Value>| {
            value
                .as_ref()
                .map_or_else(String::new, |value| value.to_string())
        };
        let mut rows = vec![
            ("takes".to_owned(), self.accepts.clone(), ""),
            ("built-in".to_owned(), shown(&self.built_in), ""),
        ];
        for PresetValue {
            preset,
            value,
            remark,
        } in &self.presets
        {
            let name = format!("preset {preset}");
            rows.push((name, shown(value), remark.unwrap_or_default()));
        }
        if self.changed {
            rows.push(("here".to_owned(), shown(&self.value), &self.origin));
        }
        let values = rows[1..].iter().map(|(_, value, _)| value.chars().count());
        let width = values.max().unwrap_or(0);
        let mut text = format!("{}\n  {}\n", self.key, self.meaning);
        for (name, value, remark) in &rows {
            let line = format!("  {name:<17}  {value:<width$}  {remark}");
            text.push_str(line.trim_end());
            text.push('\n');
        }
        text
    }
}
