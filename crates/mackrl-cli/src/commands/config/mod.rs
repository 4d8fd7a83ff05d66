//! `mackrl config`: the configuration that a run would have, what its settings mean, and what a machine has to know of them.

mod explanation;

use explanation::{Explainer, Explanation};
use mackrl_run::{
    config::{Config, Origin, Resolved, Setting, schema},
    training::explained,
};
use serde::Serialize;

use crate::{args::ConfigArgs, output};

pub(crate) fn run(args: &ConfigArgs) -> anyhow::Result<()> {
    if args.schema {
        return output::print_json(&schema(crate::registry()));
    }
    let resolved = args.configuration.layers()?.resolve()?;
    if let Some(name) = &args.explain {
        let text = format!("--explain {name}");
        let settings = crate::registry().settings_called(name, Origin::CommandLine { text })?;
        // Settings of kinds that are not chosen are explained if nothing else was asked for.
        let has = |setting: &Setting| resolved.config().get(&setting.key).is_some();
        let (here, elsewhere): (Vec<_>, Vec<_>) = settings.into_iter().partition(has);
        let settings = if here.is_empty() { elsewhere } else { here };
        let explainer = Explainer::new(crate::registry(), &resolved)?;
        let explanations: Vec<_> = (settings.iter())
            .map(|setting| explainer.explain(setting))
            .collect();
        if args.json {
            return output::print_json(&explanations);
        }
        let texts: Vec<String> = explanations.iter().map(Explanation::text).collect();
        return output::print(&texts.join("\n"));
    }
    if args.metrics {
        return print_metrics(resolved.config(), args.json);
    }
    if args.json {
        return output::print_json(&settled(&resolved));
    }
    output::print(&with_origins(&resolved))
}

/// A metric's name, or the part before a number, and what it means.
#[derive(Debug, Serialize)]
struct Metric {
    name: String,
    meaning: String,
}

fn print_metrics(config: &Config, json: bool) -> anyhow::Result<()> {
    let metrics = explained(config)?.into_iter();
    let metrics: Vec<Metric> = metrics
        .map(|(name, meaning)| Metric { name, meaning })
        .collect();
    if json {
        return output::print_json(&metrics);
    }
    let text = |Metric { name, meaning }: &Metric| format!("{name}\n  {meaning}\n");
    output::print(&metrics.iter().map(text).collect::<String>())
}

/// A setting with its value.
#[derive(Debug, Serialize)]
struct Settled {
    key: String,
    value: Option<toml::Value>,
    /// Where the value was written.
    origin: String,
}

fn settled(resolved: &Resolved) -> Vec<Settled> {
    let config = resolved.config();
    let settings = config.settings().into_iter();
    settings
        .map(|setting| Settled {
            value: config.get(&setting.key),
            origin: resolved.origin(&setting.key).to_string(),
            key: setting.key,
        })
        .collect()
}

/// The configuration as TOML, with the origin of each value in a comment.
fn with_origins(resolved: &Resolved) -> String {
    let mut text = String::new();
    let mut section = String::new();
    for Settled { key, value, origin } in settled(resolved) {
        let Some((table, name)) = key.split_once('.') else {
            continue;
        };
        if section != table {
            let gap = if section.is_empty() { "" } else { "\n" };
            text.push_str(&format!("{gap}[{table}]\n"));
            table.clone_into(&mut section);
        }
        let value = value.map_or_else(String::new, |value| value.to_string());
        // A comment ends with its line, whatever was typed.
        let origin = origin.replace(char::is_control, " ");
        text.push_str(&format!(
            "{:<40}  # {origin}\n",
            format!("{name} = {value}")
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use mackrl_run::config::ConfigBuilder;

    use super::*;

    #[test]
    fn what_is_printed_is_a_complete_configuration_file() {
        let layers = ConfigBuilder::new(crate::registry())
            .preset("paper-code")
            .unwrap()
            .map("--map 2s3z\n", "2s3z");
        let resolved = layers.resolve().unwrap();
        let printed = with_origins(&resolved);
        let read = ConfigBuilder::new(crate::registry()).file("printed", &printed);
        assert_eq!(read.unwrap().build().unwrap(), *resolved.config());
    }
}
