//! `mackrl config`: the configuration that a run would have.

use mackrl::config::{Config, ConfigBuilder};

use crate::{args::ConfigArgs, output};

pub(crate) fn run(args: &ConfigArgs) -> anyhow::Result<()> {
    let layers = args.configuration.layers()?;
    let config = layers.build()?;
    output::print(&with_origins(&config, &layers))
}

/// The configuration as TOML, with the origin of each value in a comment.
fn with_origins(config: &Config, layers: &ConfigBuilder) -> String {
    let mut text = String::new();
    let mut section = String::new();
    for key in Config::keys() {
        let Some((table, name)) = key.split_once('.') else {
            continue;
        };
        if section != table {
            let gap = if section.is_empty() { "" } else { "\n" };
            text.push_str(&format!("{gap}[{table}]\n"));
            table.clone_into(&mut section);
        }
        let value = config
            .get(&key)
            .map_or_else(String::new, |value| value.to_string());
        // A comment ends with its line, whatever was typed.
        let origin = layers.origin(&key).to_string();
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
