//! The pages of reference, from what the program prints.

use std::{collections::BTreeMap, fmt::Write};

use serde_json::Value;

use crate::shell::mackrl;

/// Says where a page comes from, for those who want to change it.
const ORIGIN: &str =
    "\n<!-- Written by `INSTA_UPDATE=always cargo test -p mackrl --test documents`. -->\n\n";

/// Every command with its help.
pub(crate) fn commands() -> String {
    let mut page = format!(
        "# Commands\n{ORIGIN}What `mackrl COMMAND --help` says. Results go to stdout, everything else to stderr; [exit codes](exit-codes.md) are the same for \
         all commands.\n"
    );
    describe(&mut page, "");
    page
}

/// The help of a command, then that of the commands below it.
fn describe(page: &mut String, command: &str) {
    let help = mackrl(&format!("{command} --help"));
    if !command.is_empty() {
        page.push_str(&format!(
            "\n## mackrl {command}\n\n```text\n{}\n```\n",
            trimmed(&help)
        ));
    }
    for below in below(&help) {
        describe(page, format!("{command} {below}").trim_start());
    }
}

fn trimmed(text: &str) -> String {
    let lines: Vec<&str> = text.trim_end().lines().map(str::trim_end).collect();
    lines.join("\n")
}

/// The names under "Commands:".
fn below(help: &str) -> Vec<&str> {
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    listed
        .take_while(|line| !line.is_empty())
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect()
}

/// Every setting of every section, of every kind of world and of every algorithm.
pub(crate) fn settings() -> String {
    let schema = json(&mackrl("config --schema"));
    let mut page = format!(
        "# Settings\n{ORIGIN}A setting is given in a file (`--config FILE`), by `--set KEY=VALUE`, or in a sweep's plan. Built-in values stand last here; a preset lies over \
         them, and `--preset default` unless another is named. `mackrl config --explain KEY` tells the value of a setting in each preset, and why; `mackrl config --print` \
         tells which value a run would have, and where it comes from; `mackrl config --schema` is the source of this page, for editors and programs.\n"
    );
    for section in ["run", "test", "env", "algorithm"] {
        let properties = object(&schema["properties"][section]["properties"]);
        let kinds: BTreeMap<&str, &Value> = (properties.iter())
            .filter(|(_, setting)| setting["properties"].is_object())
            .map(|(name, setting)| (&**name, setting))
            .collect();
        let _ = writeln!(page, "\n## {section}\n");
        if kinds.is_empty() {
            page.push_str("| setting | meaning | takes | built-in |\n|---|---|---|---|\n");
            for (name, setting) in properties {
                page.push_str(&row(
                    &format!("{section}.{name}"),
                    setting,
                    None,
                    &value(&setting["default"]),
                ));
            }
            continue;
        }
        let names: Vec<String> = kinds.keys().map(|kind| format!("`{kind}`")).collect();
        let _ = writeln!(
            page,
            "`{section}.name` is {}. Which other settings there are depends on it.\n",
            names.join(", ")
        );
        page.push_str("| setting | of | meaning | takes | built-in |\n|---|---|---|---|---|\n");
        for (key, kinds_with, setting, defaults) in shared(&kinds) {
            let of = if kinds_with.len() == kinds.len() {
                "all".to_owned()
            } else {
                kinds_with.join(", ")
            };
            page.push_str(&row(
                &format!("{section}.{key}"),
                setting,
                Some(&of),
                &defaults,
            ));
        }
    }
    page
}

/// Settings of several kinds: a row for each name and meaning, with the kinds that have it and their built-in values.
fn shared<'a>(
    kinds: &BTreeMap<&'a str, &'a Value>,
) -> Vec<(&'a str, Vec<&'a str>, &'a Value, String)> {
    let mut rows: BTreeMap<(&str, String), (Vec<&str>, &Value)> = BTreeMap::new();
    for (kind, described) in kinds {
        for (key, setting) in object(&described["properties"]) {
            let meaning = (&**key, text(&setting["description"]) + &takes(setting));
            rows.entry(meaning)
                .or_insert_with(|| (Vec::new(), setting))
                .0
                .push(kind);
        }
    }
    let value_of = |kind: &str, key: &str| value(&kinds[kind]["properties"][key]["default"]);
    rows.into_iter()
        .map(|((key, _), (of, setting))| {
            let mut values: Vec<(String, Vec<&str>)> = Vec::new();
            for kind in &of {
                let here = value_of(kind, key);
                match values.iter_mut().find(|(value, _)| *value == here) {
                    Some((_, with)) => with.push(kind),
                    None => values.push((here, vec![kind])),
                }
            }
            let defaults = match &*values {
                [(value, _)] => value.clone(),
                several => {
                    let several = several
                        .iter()
                        .map(|(value, with)| format!("{value} ({})", with.join(", ")));
                    several.collect::<Vec<_>>().join("<br>")
                }
            };
            (key, of, setting, defaults)
        })
        .collect()
}

fn row(key: &str, setting: &Value, of: Option<&str>, built_in: &str) -> String {
    let of = of.map(|of| format!("{of} | ")).unwrap_or_default();
    let meaning = text(&setting["description"]).replace('|', "\\|");
    format!(
        "| `{key}` | {of}{meaning} | {} | {built_in} |\n",
        takes(setting)
    )
}

/// What a setting accepts, in words.
fn takes(setting: &Value) -> String {
    if let Some(words) = setting["enum"].as_array() {
        return words.iter().map(value).collect::<Vec<_>>().join(", ");
    }
    let kind = setting["type"].as_str().unwrap_or("text");
    let low = bound(setting, "minimum", "[").or_else(|| bound(setting, "exclusiveMinimum", "("));
    let high = (!setting["maximum"].is_null()).then(|| format!("{}]", plain(&setting["maximum"])));
    match (low, high) {
        (None, None) => kind.to_owned(),
        (low, high) => format!(
            "{kind} in {}, {}",
            low.unwrap_or_else(|| "(−∞".to_owned()),
            high.unwrap_or_else(|| "∞)".to_owned()),
        ),
    }
}

fn bound(setting: &Value, name: &str, bracket: &str) -> Option<String> {
    (!setting[name].is_null()).then(|| format!("{bracket}{}", plain(&setting[name])))
}

/// A number as people write it.
fn plain(number: &Value) -> String {
    match number.as_f64() {
        Some(9_007_199_254_740_992.0) => "2⁵³".to_owned(),
        Some(number) => number.to_string(),
        None => number.to_string(),
    }
}

fn value(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) if text.is_empty() => "empty".to_owned(),
        Value::String(text) => format!("`{text}`"),
        Value::Number(_) => plain(value),
        other => other.to_string(),
    }
}

/// Every metric that some learner reports on a map or in the matrix game.
pub(crate) fn metrics() -> String {
    let schema = json(&mackrl("config --schema"));
    let algorithms = object(&schema["properties"]["algorithm"]["properties"]);
    let algorithms: Vec<&str> = (algorithms.iter())
        .filter(|(_, setting)| setting["properties"].is_object())
        .map(|(name, _)| &**name)
        .collect();
    let mut page = format!(
        "# Metrics\n{ORIGIN}`metrics.jsonl` has a JSON object in each line. Names under `test_` are of greedy tests, which give rows of their own; names under `sys/` depend on \
         the clock, and on nothing else. `mackrl config --metrics` says which of these a run would report.\n"
    );
    let mut seen: Vec<(String, String, Vec<&str>)> = Vec::new();
    for (world, options) in [
        ("On maps", "--map 3m"),
        ("In the matrix game alone", "--map matrix-game"),
    ] {
        let mut rows: Vec<(String, String, Vec<&str>)> = Vec::new();
        for algorithm in &algorithms {
            for metric in json(&mackrl(&format!(
                "config --metrics --json {options} --algorithm {algorithm}"
            )))
            .as_array()
            .expect("an array")
            {
                let (name, meaning) = (text(&metric["name"]), text(&metric["meaning"]));
                if seen.iter().any(|(known, ..)| *known == name) {
                    continue;
                }
                match rows
                    .iter_mut()
                    .find(|(known, what, _)| (known, what) == (&name, &meaning))
                {
                    Some((_, _, of)) => of.push(algorithm),
                    None => rows.push((name, meaning, vec![algorithm])),
                }
            }
        }
        let _ = writeln!(
            page,
            "\n## {world}\n\n| metric | of | meaning |\n|---|---|---|"
        );
        for (name, meaning, of) in &rows {
            let of = if of.len() == algorithms.len() {
                "all".to_owned()
            } else {
                of.join(", ")
            };
            let _ = writeln!(
                page,
                "| `{name}` | {of} | {} |",
                meaning.replace('|', "\\|")
            );
        }
        seen.append(&mut rows);
    }
    page
}

/// The maps with the sizes of their arrays.
pub(crate) fn maps() -> String {
    let mut page = format!(
        "# Maps\n{ORIGIN}SMAC's 23 maps, with the sizes of their arrays. [Which StarCraft is this](../game.md) says who fights on which ground. `mackrl maps NAME` shows \
         a map with its armies, orders and terrain, and `--json` gives every number; [Your own map](../own-map.md) says how to write one.\n\n"
    );
    let maps = json(&mackrl("maps --json"));
    page.push_str("| map | agents | enemies | actions | observation | state | limit of steps |\n|---|---:|---:|---:|---:|---:|---:|\n");
    for map in maps.as_array().expect("an array") {
        let number = |key: &str| {
            map[key]
                .as_u64()
                .unwrap_or_else(|| panic!("{key} in {map}"))
        };
        let _ = writeln!(
            page,
            "| `{}` | {} | {} | {} | {} | {} | {} |",
            text(&map["name"]),
            number("n_agents"),
            number("n_enemies"),
            number("n_actions"),
            number("obs_size"),
            number("state_size"),
            number("episode_limit"),
        );
    }
    page
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

fn object(value: &Value) -> &serde_json::Map<String, Value> {
    value.as_object().expect("an object")
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}
