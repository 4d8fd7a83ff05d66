//! What can be wrong with a configuration, and where it was written.

use std::fmt;

use thiserror::Error;

/// Where a value was written; later layers are greater.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Origin {
    /// The built-in values.
    BuiltIn,
    /// A shipped preset.
    Preset {
        /// Its name.
        name: &'static str,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
    },
    /// A file.
    File {
        /// Its name, as the user wrote it.
        name: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
    },
    /// The command line.
    CommandLine {
        /// The flag with its value, such as `--set algorithm.gamma=2`.
        text: String,
    },
    /// A value that follows from the world, because no other was asked for.
    Automatic {
        /// Why it is what it is.
        why: &'static str,
    },
    /// A value that a program set.
    Unknown,
}

impl fmt::Display for Origin {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BuiltIn => formatter.write_str("built-in"),
            Self::Preset { name, line, column } => {
                write!(formatter, "preset {name}:{line}:{column}")
            }
            Self::File { name, line, column } => write!(formatter, "{name}:{line}:{column}"),
            Self::Automatic { why } => write!(formatter, "automatic: {why}"),
            Self::CommandLine { text } => formatter.write_str(text),
            Self::Unknown => formatter.write_str("configuration"),
        }
    }
}

/// What is wrong with a configuration.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// A file is not TOML, or an override is not `key=value`.
    #[error("{origin}: {message}")]
    Syntax {
        /// Where.
        origin: Origin,
        /// What was found and expected.
        message: String,
    },
    /// A key that no setting has.
    #[error("{origin}: unknown key `{key}`{}", suggestion(nearest.as_deref()))]
    UnknownKey {
        /// Where.
        origin: Origin,
        /// The key.
        key: String,
        /// The most similar key, if one is similar at all.
        nearest: Option<String>,
    },
    /// A key that is called otherwise now.
    #[error("{origin}: `{key}` is called `{new}` now")]
    RenamedKey {
        /// Where.
        origin: Origin,
        /// The key.
        key: String,
        /// Its name now.
        new: String,
    },
    /// A key that the chosen kind of world or algorithm does not have, but another has.
    #[error("{origin}: `{key}` is a setting of `{owner}`, but `{section}.name` is `{chosen}`")]
    ForeignKey {
        /// Where.
        origin: Origin,
        /// The key.
        key: String,
        /// The kind that has it.
        owner: Box<str>,
        /// The section.
        section: Box<str>,
        /// The kind that is chosen.
        chosen: Box<str>,
    },
    /// A value of the wrong type or out of its range.
    #[error("{origin}: `{key}` is {found}, expected {expected}")]
    WrongValue {
        /// Where.
        origin: Origin,
        /// The key.
        key: String,
        /// The value.
        found: String,
        /// Which values are accepted.
        expected: String,
    },
    /// A map that is not in the registry.
    #[error("{origin}: unknown map `{name}`{}", suggestion(nearest.as_deref()))]
    UnknownMap {
        /// Where.
        origin: Origin,
        /// Its name.
        name: String,
        /// The most similar name, if one is similar at all.
        nearest: Option<String>,
    },
    /// A scenario that a user wrote is broken.
    #[error("{message}")]
    Scenario {
        /// File, line and column, what was found and what was expected.
        message: String,
    },
    /// A world that cannot be had here, whatever its settings.
    #[error("{message}")]
    World {
        /// What is missing or broken.
        message: String,
    },
    /// A preset that is not shipped.
    #[error("unknown preset `{name}`, expected {expected}{}", suggestion(nearest.as_deref()))]
    UnknownPreset {
        /// Its name.
        name: String,
        /// The shipped presets.
        expected: String,
        /// The most similar name, if one is similar at all.
        nearest: Option<String>,
    },
}

impl ConfigError {
    /// The error for a `key` that is not among the `known` ones.
    pub(super) fn unknown_key<'a>(
        origin: Origin,
        key: &str,
        known: impl IntoIterator<Item = &'a str>,
    ) -> Self {
        Self::UnknownKey {
            origin,
            key: shortened(key),
            nearest: nearest(key, known),
        }
    }

    /// The error for a map `name` that is not among the `known` ones.
    #[must_use]
    pub fn unknown_map<'a>(
        origin: Origin,
        name: &str,
        known: impl IntoIterator<Item = &'a str>,
    ) -> Self {
        Self::UnknownMap {
            origin,
            name: shortened(name),
            nearest: nearest(name, known),
        }
    }
}

impl From<ConfigError> for mackrl::Error {
    fn from(error: ConfigError) -> Self {
        Self::Config(error.to_string())
    }
}

/// What somebody wrote, fit for a message: no longer than a line.
pub(super) fn shortened(text: &str) -> String {
    const LENGTH_MAX: usize = 80;
    let mut characters = text.chars();
    let mut short: String = characters.by_ref().take(LENGTH_MAX).collect();
    if characters.next().is_some() {
        short.push('…');
    }
    short
}

/// "`a`, `b` or `c`"
pub(super) fn one_of(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match quoted.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => quoted.concat(),
    }
}

fn suggestion(nearest: Option<&str>) -> String {
    nearest.map_or_else(String::new, |name| format!(", did you mean `{name}`?"))
}

/// The name among `candidates` that is most similar to `name`, if one is similar at all.
///
/// Dotted keys are compared as a whole and by their last part, so that `gama` finds `algorithm.gamma`.
#[must_use]
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    const SIMILAR: f64 = 0.6;
    /// Longer than any name; comparing takes time and memory proportional to the length.
    const LENGTH_MAX: usize = 100;
    if name.len() > LENGTH_MAX {
        return None;
    }
    let last = |key: &str| key.rsplit('.').next().unwrap_or_default().to_owned();
    let similarity = |candidate: &str| {
        let whole = strsim::normalized_damerau_levenshtein(name, candidate);
        let ends = strsim::normalized_damerau_levenshtein(&last(name), &last(candidate));
        // Equal ends must not hide which section was meant, hence the small share of the whole.
        whole.max(0.9f64.mul_add(ends, 0.1 * whole))
    };
    candidates
        .into_iter()
        .map(|candidate| (similarity(candidate), candidate))
        .filter(|(similarity, candidate)| {
            // Names as short as `3m` are half different after one slip.
            *similarity >= SIMILAR || strsim::damerau_levenshtein(name, candidate) <= 1
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEYS: [&str; 3] = ["algorithm.gamma", "algorithm.lambda", "test.episodes"];

    #[test]
    fn a_misspelt_key_finds_its_neighbour() {
        for name in [
            "algorithm.gama",
            "gamma",
            "gama",
            "algoritm.gamma",
            "run.gamma",
        ] {
            assert_eq!(
                nearest(name, KEYS).as_deref(),
                Some("algorithm.gamma"),
                "{name}"
            );
        }
    }

    #[test]
    fn one_slip_in_a_short_name_is_forgiven() {
        assert_eq!(nearest("3n", ["8m", "3m", "2s3z"]).as_deref(), Some("3m"));
    }

    #[test]
    fn what_is_endless_is_shortened_and_not_compared() {
        let endless = "gamma".repeat(1000);
        assert_eq!(nearest(&endless, KEYS), None);
        assert_eq!(shortened(&endless).chars().count(), 81);
        assert_eq!(shortened("gamma"), "gamma");
    }

    #[test]
    fn a_key_unlike_any_other_finds_none() {
        assert_eq!(nearest("colour", KEYS), None);
    }
}
