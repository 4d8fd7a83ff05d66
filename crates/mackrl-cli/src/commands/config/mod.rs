//! `mackrl config`: the configuration that a run would have, what its settings mean, and what a machine has to know of them.

mod explanation;

use explanation::Explanation;
use mackrl_run::config::{Config, ConfigBuilder, Origin, schema};
use serde::Serialize;

use crate::{args::ConfigArgs, output};

pub(crate) fn run(args: &ConfigArgs) -> anyhow::Result<()> {
    if args.schema {
        return output::print_json(&schema());
    }
    let layers = args.configuration.layers()?;
    let config = layers.build()?;
    if let Some(name) = &args.explain {
        let text = format!("--explain {name}");
        let settings = Config::settings_called(name, Origin::CommandLine { text })?;
        let explanations = settings
            .iter()
            .map(|setting| Explanation::of(setting, &config, &layers))
            .collect::<Result<Vec<_>, _>>()?;
        if args.json {
            return output::print_json(&explanations);
        }
        let texts: Vec<String> = explanations.iter().map(Explanation::text).collect();
        return output::print(&texts.join("\n"));
    }
    if args.json {
        return output::print_json(&settled(&config, &layers));
    }
    output::print(&with_origins(&config, &layers))
}

/// A setting with its value.
#[derive(Debug, Serialize)]
struct Settled {
    key: String,
    value: Option<toml::Value>,
    /// Where the value was written.
    origin: String,
}

fn settled(config: &Config, layers: &ConfigBuilder) -> Vec<Settled> {
    let settings = Config::settings().into_iter();
    settings
        .map(|setting| Settled {
            value: config.get(&setting.key),
            origin: layers.origin(&setting.key).to_string(),
            key: setting.key,
        })
        .collect()
}

/// The configuration as TOML, with the origin of each value in a comment.
fn with_origins(config: &Config, layers: &ConfigBuilder) -> String {
    let mut text = String::new();
    let mut section = String::new();
    for Settled { key, value, origin } in settled(config, layers) {
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
    use super::*;

    #[test]
    fn what_is_printed_is_a_complete_configuration_file() {
        let layers = ConfigBuilder::new()
            .preset("paper-code")
            .unwrap()
            .flag("--map 2s3z\n", "env.map=2s3z")
            .unwrap();
        let config = layers.build().unwrap();
        let printed = with_origins(&config, &layers);
        let read = ConfigBuilder::new().file("printed", &printed).unwrap();
        assert_eq!(read.build().unwrap(), config);
    }
}
