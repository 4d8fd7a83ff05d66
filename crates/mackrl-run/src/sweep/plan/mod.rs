//! The plan of a sweep: a TOML file that says which runs there are.
//!
//! A plan names maps, algorithms and seeds, and every combination of them is a run. `[settings]` holds for all runs, `[on.MAP]` for
//! those on one map, which may have seeds of its own; each list in `[vary]` multiplies the runs; each table in `[variants]` is a
//! kind of run with settings of its own. Files may come from anybody: length and number of runs are bounded, names of runs cannot
//! lead out of the sweep's folder, and nothing is run but this program. The sweep's folder itself, `out`, may be any path: read it, or give `--out`, before making a stranger's plan.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use serde::{Deserialize, de::IgnoredAny};

use crate::{
    bounded,
    config::{
        Config, ConfigBuilder, ConfigError, Leaf, Origin, line_and_column, parse_document, registry,
    },
    error::{Result, RunError},
    scenario_file::with_scenario,
    sweep::Entry,
};

/// Longest plan that is read, in bytes.
const LENGTH_MAX: usize = 1 << 20;
/// Most runs that a plan may have.
const RUNS_MAX: usize = 10_000;
/// Longest part of a run's name.
const NAME_MAX: usize = 60;
/// What stands at the top of a plan.
const OWN: [&str; 10] = [
    "out",
    "preset",
    "maps",
    "algorithms",
    "seeds",
    "order",
    "settings",
    "vary",
    "variants",
    "on",
];
/// Settings that are given by lists of their own.
const LISTED: [(&str, &str); 3] = [
    ("env.map", "maps"),
    ("algorithm.name", "algorithms"),
    ("run.seed", "seeds"),
];

/// A plan as it is written; where its values stand is looked up among its leaves.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    out: Option<PathBuf>,
    #[serde(default = "default_preset")]
    preset: String,
    maps: Vec<String>,
    algorithms: Option<Vec<String>>,
    seeds: Seeds,
    #[serde(default)]
    order: Order,
    #[serde(default, rename = "settings")]
    _settings: BTreeMap<String, IgnoredAny>,
    #[serde(default, rename = "vary")]
    _vary: BTreeMap<String, IgnoredAny>,
    #[serde(default)]
    variants: BTreeMap<String, BTreeMap<String, IgnoredAny>>,
    #[serde(default)]
    on: BTreeMap<String, OnMap>,
}

/// What holds on one map.
#[derive(Debug, Deserialize)]
struct OnMap {
    seeds: Option<Seeds>,
    #[serde(flatten)]
    _settings: BTreeMap<String, IgnoredAny>,
}

/// What comes first among the runs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Order {
    /// All runs on the first map.
    #[default]
    ByMap,
    /// The first seed of everything, so that whatever is made can be compared at every moment.
    BySeed,
}

/// So many seeds from 1, or these.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged, expecting = "expected a number of seeds, or a list of seeds")]
enum Seeds {
    Count(u64),
    List(Vec<u64>),
}

/// What a sweep does.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Folder of the run folders.
    pub out: PathBuf,
    /// All runs: maps, then algorithms, then variants and varied settings, then seeds, the last innermost; or, if the plan says so,
    /// the first seed of all of them, then the second.
    pub entries: Vec<Entry>,
}

/// A kind of run: what is laid over the settings that all have, and how that is called.
#[derive(Debug, Clone, Default)]
struct Kind {
    names: Vec<String>,
    settings: Vec<Setting>,
}

/// A setting and where it stands.
#[derive(Debug, Clone)]
struct Setting {
    key: String,
    value: toml::Value,
    origin: Origin,
}

/// A plan that is being read.
struct Reading<'a> {
    name: &'a str,
    text: &'a str,
    document: Document,
    leaves: Vec<Leaf>,
}

fn default_preset() -> String {
    "default".to_owned()
}

impl Plan {
    /// Reads the plan in the file `path`; `out` takes the place of the folder that the plan names.
    ///
    /// # Errors
    /// What cannot be read or understood, with line and column.
    pub fn read(path: &Path, out: Option<&Path>) -> Result<Self> {
        let bytes = bounded::read(path, LENGTH_MAX)?;
        let name = path.display().to_string();
        let text = bounded::text(&name, bytes).map_err(|message| ConfigError::Syntax {
            origin: Origin::Unknown,
            message,
        })?;
        let stem = path.file_stem().unwrap_or_default();
        Self::parse(&name, &text, out, &Path::new("runs").join(stem))
    }

    /// Reads the plan `text` of the file called `name`; `otherwise` is the folder if none is named.
    ///
    /// # Errors
    /// What cannot be understood, with line and column.
    pub fn parse(name: &str, text: &str, out: Option<&Path>, otherwise: &Path) -> Result<Self> {
        let syntax_error = |at, message: String| ConfigError::Syntax {
            origin: origin(name, text, at),
            message,
        };
        let leaves = parse_document(text).map_err(|error| syntax_error(error.at, error.message))?;
        if let Some((at, message)) = misplaced(&leaves) {
            return Err(syntax_error(at, message).into());
        }
        let document: Document = toml::from_str(text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            syntax_error(at, error.message().to_owned())
        })?;
        let out = out
            .or(document.out.as_deref())
            .unwrap_or(otherwise)
            .to_owned();
        let reading = Reading {
            name,
            text,
            document,
            leaves,
        };
        let entries = reading.entries(&out)?;
        Ok(Self { out, entries })
    }
}

impl Reading<'_> {
    fn entries(&self, out: &Path) -> Result<Vec<Entry>> {
        let maps = &self.document.maps;
        if let Some(map) = self.document.on.keys().find(|map| !maps.contains(map)) {
            let message = format!("`on.{map}` is about a map that `maps` does not list");
            return Err(self.error("on", message));
        }
        let (kinds, base) = (self.kinds()?, self.base()?);
        // Without a list, the preset decides.
        let algorithms: Vec<Option<&str>> = match &self.document.algorithms {
            Some(listed) => listed.iter().map(|name| Some(&**name)).collect(),
            None => vec![None],
        };
        let seeds = maps.iter().map(|map| self.seeds_on(map));
        let seeds = seeds.collect::<Result<Vec<_>>>()?;
        let of_a_seed = algorithms.len().saturating_mul(kinds.len());
        let count = (seeds.iter().map(Vec::len))
            .fold(0, usize::saturating_add)
            .saturating_mul(of_a_seed);
        if !(1..=RUNS_MAX).contains(&count) {
            let message = format!("the plan has {count} runs, expected 1 to {RUNS_MAX}");
            return Err(self.error("maps", message));
        }
        // Each with the place of its seed among those of its kind.
        let mut placed: Vec<(usize, Entry)> = Vec::with_capacity(count);
        for (map, seeds) in maps.iter().zip(&seeds) {
            let on_map = base.clone().map_at(self.origin_of("maps"), map);
            let on_map = lay(on_map, &self.settings_in(&["on", map]))?;
            refuse(&on_map, &LISTED[1..])?;
            for algorithm in &algorithms {
                let builder = match algorithm {
                    Some(name) => {
                        self.assign(on_map.clone(), "algorithms", "algorithm.name", name)?
                    }
                    None => on_map.clone(),
                };
                for kind in &kinds {
                    let entries = self.repetitions(builder.clone(), kind, seeds, out)?;
                    placed.extend(entries.into_iter().enumerate());
                }
            }
        }
        if self.document.order == Order::BySeed {
            placed.sort_by_key(|(place, _)| *place);
        }
        let entries: Vec<Entry> = placed.into_iter().map(|(_, entry)| entry).collect();
        let mut names = BTreeSet::new();
        match entries.iter().find(|entry| !names.insert(&entry.name)) {
            None => Ok(entries),
            Some(twin) => {
                let message = format!(
                    "two runs would be called {}: something is listed twice",
                    twin.name
                );
                Err(self.error("maps", message))
            }
        }
    }

    /// The runs of one kind, on one map, with one algorithm.
    fn repetitions(
        &self,
        builder: ConfigBuilder,
        kind: &Kind,
        seeds: &[u64],
        out: &Path,
    ) -> Result<Vec<Entry>> {
        let builder = lay(builder, &kind.settings)?;
        refuse(&builder, &LISTED[2..])?;
        let builder = with_scenario(builder)?;
        let of_seed = |seed: &u64| {
            let origin = self.origin_of("seeds");
            let config = builder
                .clone()
                .assign(origin, &format!("run.seed={seed}"))?
                .build()?;
            let name = name(&config, kind);
            Ok(Entry {
                folder: out.join(&name),
                name,
                config,
            })
        };
        seeds.iter().map(of_seed).collect()
    }

    /// What all runs have in common.
    fn base(&self) -> Result<ConfigBuilder> {
        let builder = ConfigBuilder::new(registry())
            .preset(&self.document.preset)
            .map_err(|error| self.error("preset", error.to_string()))?;
        let builder = lay(builder, &self.settings_in(&["settings"]))?;
        refuse(&builder, &LISTED)?;
        Ok(builder)
    }

    /// The seeds of the runs on a map.
    fn seeds_on(&self, map: &str) -> Result<Vec<u64>> {
        let own = self.document.on.get(map).and_then(|on| on.seeds.clone());
        let key = if own.is_some() { "on" } else { "seeds" };
        match own.unwrap_or_else(|| self.document.seeds.clone()) {
            Seeds::Count(count) if (1..=RUNS_MAX as u64).contains(&count) => {
                Ok((1..=count).collect())
            }
            Seeds::List(seeds) if !seeds.is_empty() => Ok(seeds),
            _ => {
                let message =
                    format!("`seeds` is not a number in 1 to {RUNS_MAX} or a list with a seed");
                Err(self.error(key, message))
            }
        }
    }

    /// Every variant with every combination of varied settings.
    fn kinds(&self) -> Result<Vec<Kind>> {
        let mut kinds = Vec::new();
        for name in self.document.variants.keys() {
            if *name != plain(name) || name.is_empty() {
                let message = format!(
                    "`{name}` is not a name of 1 to {NAME_MAX} letters, digits, - and _, after which folders can be called"
                );
                return Err(self.error("variants", message));
            }
            kinds.push(Kind {
                names: vec![name.clone()],
                settings: self.settings_in(&["variants", name]),
            });
        }
        if kinds.is_empty() {
            kinds.push(Kind::default());
        }
        for varied in self.settings_in(&["vary"]) {
            kinds = multiplied(&kinds, &varied)?;
        }
        Ok(kinds)
    }

    /// The settings in a table, by their dotted keys.
    fn settings_in(&self, table: &[&str]) -> Vec<Setting> {
        let leaves = self.leaves.iter().filter_map(|leaf| {
            let inside = leaf.path.get(..table.len())? == table;
            inside.then(|| Setting {
                key: leaf.path[table.len()..].join("."),
                value: leaf.value.clone(),
                origin: origin(self.name, self.text, leaf.value_at),
            })
        });
        // The seeds of a map are no setting.
        leaves.filter(|setting| setting.key != "seeds").collect()
    }

    fn assign(
        &self,
        builder: ConfigBuilder,
        list: &str,
        key: &str,
        value: &str,
    ) -> Result<ConfigBuilder> {
        let quoted = toml::Value::String(value.to_owned());
        Ok(builder.assign(self.origin_of(list), &format!("{key}={quoted}"))?)
    }

    /// Where a key of the plan itself stands, or a table of it.
    fn origin_of(&self, key: &str) -> Origin {
        let mut leaves = self.leaves.iter();
        let leaf = leaves.find(|leaf| leaf.path.first().is_some_and(|first| first == key));
        origin(self.name, self.text, leaf.map_or(0, |leaf| leaf.value_at))
    }

    fn error(&self, key: &str, message: String) -> RunError {
        let origin = self.origin_of(key);
        ConfigError::Syntax { origin, message }.into()
    }
}

/// The first thing that stands at the top of a plan and is none of a plan's own words, and where it belongs.
fn misplaced(leaves: &[Leaf]) -> Option<(usize, String)> {
    let foreign = leaves
        .iter()
        .find(|leaf| !OWN.contains(&leaf.path[0].as_str()))?;
    let word = foreign.path.join(".");
    let last = foreign.path.last().map_or("", String::as_str);
    let settings = registry().settings();
    let named = |key: &str| settings.iter().any(|setting| setting.key == key);
    let key = match &*word {
        "steps" => Some("run.steps_env".to_owned()),
        whole if named(whole) => Some(whole.to_owned()),
        _ => {
            let ending = format!(".{last}");
            let mut keys = settings.iter().map(|setting| &setting.key);
            keys.find(|key| key.ends_with(&ending)).cloned()
        }
    };
    let listed = |key: &str| {
        let mut listed = LISTED.iter();
        listed.find(|(setting, _)| *setting == key)
    };
    let place = match (&*word, key) {
        ("map" | "algorithm" | "seed", _) => format!("; write `{word}s`"),
        (_, Some(key)) => match listed(&key) {
            Some((_, list)) => format!("; write `{list}`"),
            None => format!("; write `{key} = {}` below [settings]", foreign.value),
        },
        (_, None) => format!(", expected {}", OWN.join(", ")),
    };
    let message = format!("`{word}` is not a word of plans{place}");
    Some((foreign.key_at, message))
}

fn origin(name: &str, text: &str, at: usize) -> Origin {
    let (line, column) = line_and_column(text, at);
    Origin::File {
        name: name.to_owned(),
        line,
        column,
    }
}

fn lay(builder: ConfigBuilder, settings: &[Setting]) -> Result<ConfigBuilder> {
    settings.iter().try_fold(builder, |builder, setting| {
        let assignment = format!("{}={}", setting.key, setting.value);
        Ok(builder.assign(setting.origin.clone(), &assignment)?)
    })
}

/// Refuses settings that lists of their own would replace.
fn refuse(builder: &ConfigBuilder, listed: &[(&str, &str)]) -> Result<()> {
    for (key, list) in listed {
        if let Some(origin @ Origin::File { .. }) = builder.written(key) {
            let origin = origin.clone();
            let message = format!("`{key}` is given by `{list}`");
            return Err(ConfigError::Syntax { origin, message }.into());
        }
    }
    Ok(())
}

/// Every kind with every value of a list.
fn multiplied(kinds: &[Kind], varied: &Setting) -> Result<Vec<Kind>> {
    let Setting { key, value, origin } = varied;
    let error = |message: String| ConfigError::Syntax {
        origin: origin.clone(),
        message,
    };
    let Some(values) = value.as_array().filter(|values| !values.is_empty()) else {
        return Err(error(format!("`{key}` is {value}, expected a list of values")).into());
    };
    if kinds.len().saturating_mul(values.len()) > RUNS_MAX {
        return Err(error(format!("the plan has more than {RUNS_MAX} runs")).into());
    }
    let last = key.rsplit('.').next().unwrap_or(key);
    let with = |kind: &Kind| -> Vec<Kind> {
        let of_value = |value: &toml::Value| {
            let mut kind = kind.clone();
            kind.names
                .push(format!("{}-{}", plain(last), plain(&word(value))));
            kind.settings.push(Setting {
                key: key.clone(),
                value: value.clone(),
                origin: origin.clone(),
            });
            kind
        };
        values.iter().map(of_value).collect()
    };
    Ok(kinds.iter().flat_map(with).collect())
}

/// Map, algorithm, kind and seed.
fn name(config: &Config, kind: &Kind) -> String {
    let map = Path::new(config.env.map()).file_stem().unwrap_or_default();
    let mut parts = vec![
        plain(&map.to_string_lossy()),
        plain(config.algorithm.name()),
    ];
    parts.extend(kind.names.iter().cloned());
    parts.push(format!("seed{}", config.run.seed));
    parts.join("-")
}

/// A value as it is typed.
fn word(value: &toml::Value) -> String {
    value
        .as_str()
        .map_or_else(|| value.to_string(), str::to_owned)
}

/// Text with nothing in it that folders cannot be called after.
fn plain(text: &str) -> String {
    let character = |character: char| match character {
        'a'..='z' | 'A'..='Z' | '0'..='9' | '_' | '.' => character,
        _ => '-',
    };
    let plain: String = text.chars().take(NAME_MAX).map(character).collect();
    plain.trim_start_matches('.').to_owned()
}

#[cfg(test)]
mod tests;
