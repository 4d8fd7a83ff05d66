//! What is to be known about one setting.

use mackrl_run::config::{
    Config, ConfigBuilder, ConfigError, Origin, Preset, Registry, Resolved, Setting, remark,
};
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

/// Settings are explained with their values here, and with those that they have otherwise.
#[derive(Debug)]
pub(super) struct Explainer<'a> {
    resolved: &'a Resolved,
    built_in: Config,
    presets: Vec<(Preset, Config)>,
}

impl<'a> Explainer<'a> {
    /// For the kinds of world and algorithm that `resolved` has.
    ///
    /// # Errors
    /// Never: shipped presets can be read.
    pub(super) fn new(registry: &Registry, resolved: &'a Resolved) -> Result<Self, ConfigError> {
        let Config { env, algorithm, .. } = resolved.config();
        let same = |builder: ConfigBuilder| {
            builder
                .set(&format!("env.name={}", env.name()))?
                .set(&format!("algorithm.name={}", algorithm.name()))?
                .build()
        };
        let of_preset = |preset: Preset| {
            let builder = ConfigBuilder::new(registry).preset(preset.name)?;
            Ok((preset, same(builder)?))
        };
        Ok(Self {
            resolved,
            built_in: same(ConfigBuilder::new(registry))?,
            presets: registry
                .presets()
                .map(of_preset)
                .collect::<Result<_, _>>()?,
        })
    }

    /// What is to be known about a setting.
    pub(super) fn explain(&self, setting: &Setting) -> Explanation {
        let key = &setting.key;
        let in_presets = self.presets.iter().map(|(preset, config)| PresetValue {
            preset: preset.name,
            value: config.get(key),
            remark: remark(*preset, key),
        });
        let origin = self.resolved.origin(key);
        // Two algorithms may call different things by one name.
        let chosen = self.resolved.config().settings();
        let chosen = chosen.iter().find(|own| own.key == *key).unwrap_or(setting);
        Explanation {
            key: key.clone(),
            meaning: chosen.meaning,
            accepts: chosen.accepts.to_string(),
            built_in: self.built_in.get(key),
            presets: in_presets.collect(),
            value: self.resolved.config().get(key),
            changed: !matches!(origin, Origin::BuiltIn | Origin::Preset { .. }),
            origin: origin.to_string(),
        }
    }
}

impl Explanation {
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
