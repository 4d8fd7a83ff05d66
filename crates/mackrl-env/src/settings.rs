//! Declaring settings: name, type, built-in value, accepted values and meaning, once and together.
//!
//! Whoever checks a value, explains it or describes it to a machine (a JSON schema) reads the same declaration. The
//! alternative, a predicate beside a sentence that describes it, is shorter to write, and the two drift apart.

use std::{
    fmt,
    ops::Bound::{self, Excluded, Included, Unbounded},
};

use serde::{Serialize, de::DeserializeOwned};
use thiserror::Error;

/// 2⁵³: up to here every reader of TOML and JSON keeps integers exactly, those that hold them as f64 included.
pub const EXACT: u64 = 1 << 53;

/// Which values a setting takes; shown in words that follow "expected".
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Accepts {
    /// `true` or `false`.
    Flag,
    /// An integer in [least, greatest].
    Integer {
        /// The least.
        least: u64,
        /// The greatest.
        greatest: u64,
    },
    /// A finite number between two bounds.
    Number {
        /// From below.
        least: Bound<f64>,
        /// From above.
        greatest: Bound<f64>,
    },
    /// One of a few words.
    OneOf(&'static [&'static str]),
    /// Text that its own reader checks.
    Text {
        /// Which, in words that follow "expected".
        expects: &'static str,
        /// The same as a regular expression, if there is one.
        pattern: Option<&'static str>,
    },
}

impl Accepts {
    /// Integers in [least, greatest].
    #[must_use]
    pub const fn integer(least: u64, greatest: u64) -> Self {
        Self::Integer { least, greatest }
    }

    /// Numbers in [least, greatest].
    #[must_use]
    pub const fn within(least: f64, greatest: f64) -> Self {
        Self::Number {
            least: Included(least),
            greatest: Included(greatest),
        }
    }

    /// Numbers in (least, greatest].
    #[must_use]
    pub const fn above_within(least: f64, greatest: f64) -> Self {
        Self::Number {
            least: Excluded(least),
            greatest: Included(greatest),
        }
    }

    /// Finite numbers greater than this.
    #[must_use]
    pub const fn above(least: f64) -> Self {
        Self::Number {
            least: Excluded(least),
            greatest: Unbounded,
        }
    }

    /// Whether this is one of the values. Text is checked by its own reader.
    #[must_use]
    pub fn admits(&self, value: &toml::Value) -> bool {
        match (*self, value) {
            (Self::Flag, toml::Value::Boolean(_)) | (Self::Text { .. }, toml::Value::String(_)) => {
                true
            }
            (Self::Integer { least, greatest }, toml::Value::Integer(value)) => {
                u64::try_from(*value).is_ok_and(|value| (least..=greatest).contains(&value))
            }
            (Self::Number { least, greatest }, toml::Value::Float(value)) => {
                value.is_finite() && std::ops::RangeBounds::contains(&(least, greatest), value)
            }
            (Self::OneOf(words), toml::Value::String(value)) => words.contains(&value.as_str()),
            _ => false,
        }
    }
}

impl fmt::Display for Accepts {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flag => formatter.write_str("`true` or `false`"),
            Self::Integer { least, greatest } => match *greatest {
                EXACT => write!(formatter, "an integer in [{least}, 2^53]"),
                greatest => write!(formatter, "an integer in [{least}, {greatest}]"),
            },
            Self::Number { least, greatest } => match (least, greatest) {
                (Excluded(least), Unbounded) => write!(formatter, "a finite number > {least}"),
                (Included(least), Unbounded) => write!(formatter, "a finite number >= {least}"),
                _ => write!(
                    formatter,
                    "a number in {}, {}",
                    opening(*least),
                    closing(*greatest)
                ),
            },
            Self::OneOf(words) => formatter.write_str(&alternatives(words)),
            Self::Text { expects, .. } => formatter.write_str(expects),
        }
    }
}

fn opening(bound: Bound<f64>) -> String {
    match bound {
        Included(least) => format!("[{}", short(least)),
        Excluded(least) => format!("({}", short(least)),
        Unbounded => "(-∞".to_owned(),
    }
}

fn closing(bound: Bound<f64>) -> String {
    match bound {
        Included(greatest) => format!("{}]", short(greatest)),
        Excluded(greatest) => format!("{})", short(greatest)),
        Unbounded => "∞)".to_owned(),
    }
}

fn short(number: f64) -> String {
    if number.abs() < 1e6 {
        number.to_string()
    } else {
        format!("{number:e}")
    }
}

/// "`a`, `b` or `c`"
fn alternatives(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().map(|word| format!("`{word}`")).collect();
    match quoted.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => quoted.concat(),
    }
}

/// What is known about a setting besides its value. Declarations live as long as the program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// Its name within its section.
    pub name: &'static str,
    /// What it means, with its unit: the documentation of its field.
    pub meaning: &'static str,
    /// Which values it takes.
    pub accepts: Accepts,
}

impl Setting {
    /// What is wrong with `value` as the value of this setting, if anything is.
    #[must_use]
    pub fn check(&self, value: &(impl Serialize + fmt::Debug)) -> Option<Violation> {
        let found = match toml::Value::try_from(value) {
            Ok(value) if self.accepts.admits(&value) => return None,
            Ok(value) => value.to_string(),
            // An integer that TOML cannot hold.
            Err(_) => format!("{value:?}"),
        };
        Some(self.refuse(found))
    }

    /// What is wrong with `found`, which it does not take.
    const fn refuse(&self, found: String) -> Violation {
        Violation {
            name: self.name,
            found,
            accepts: self.accepts,
        }
    }
}

/// A value that its setting does not take.
#[derive(Debug, Clone, PartialEq)]
pub struct Violation {
    /// Name of the setting within its section.
    pub name: &'static str,
    /// The value.
    pub found: String,
    /// Which values it takes.
    pub accepts: Accepts,
}

/// A section of settings that [`declare_settings!`](crate::declare_settings) has declared.
pub trait Settings: Default + Serialize + DeserializeOwned {
    /// Every setting with its meaning and the values that it takes, in the order of declaration.
    const DECLARED: &'static [Setting];

    /// The first setting with a value that it does not take.
    fn first_violation(&self) -> Option<Violation>;

    /// The built-in values by their names, in the order of declaration.
    #[must_use]
    fn defaults() -> toml::Table {
        // By way of the text, in which a number of single precision is what its reader sees: 0.02, not the nearest number.
        let text = toml::to_string(&Self::default()).expect("settings are values that TOML has");
        toml::from_str(&text).expect("what was written can be read")
    }

    /// Reads a table; what it does not set has its built-in value. Integers are taken for numbers, as people write them.
    ///
    /// # Errors
    /// [`SettingsError`] if a name is unknown, or a value is none that its setting takes.
    fn read(table: &toml::Table) -> Result<Self, SettingsError> {
        let mut values = Self::defaults();
        for (name, value) in table {
            let Some(setting) = Self::DECLARED.iter().find(|setting| setting.name == name) else {
                return Err(SettingsError::Unknown(name.clone()));
            };
            let value = as_number_if_asked(setting, value);
            let one = toml::Table::from_iter([(name.clone(), value.clone())]);
            if !setting.accepts.admits(&value) || Self::deserialize(one).is_err() {
                return Err(setting.refuse(value.to_string()).into());
            }
            values.insert(name.clone(), value);
        }
        let settings = Self::deserialize(values).expect("each value was read alone");
        match settings.first_violation() {
            Some(violation) => Err(violation.into()),
            None => Ok(settings),
        }
    }
}

/// `value`, but for an integer as a number if `setting` takes numbers.
fn as_number_if_asked(setting: &Setting, value: &toml::Value) -> toml::Value {
    match (setting.accepts, value) {
        (Accepts::Number { .. }, toml::Value::Integer(integer)) => {
            toml::Value::Float(*integer as f64)
        }
        _ => value.clone(),
    }
}

/// Why a table of settings was not read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SettingsError {
    /// No setting has this name.
    #[error("no setting is called `{0}`")]
    Unknown(String),
    /// A setting has a value that it does not take.
    #[error(transparent)]
    Wrong(#[from] WrongSetting),
    /// Two values do not go together, each of which would be taken beside another. Which of them is to blame is for those to
    /// say who can tell which was written later.
    #[error("{}", .0[0])]
    AtOdds(Box<[WrongSetting; 2]>),
}

/// A setting with a value that it does not take.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("setting `{name}` is {found}, expected {expected}{}", suggestion(nearest.as_deref()))]
pub struct WrongSetting {
    /// Name of the setting.
    pub name: String,
    /// The value.
    pub found: String,
    /// Which values are taken, in words.
    pub expected: String,
    /// The value that was probably meant, if one is similar to what was found.
    pub nearest: Option<String>,
}

fn suggestion(nearest: Option<&str>) -> String {
    nearest.map_or_else(String::new, |name| format!(", did you mean `{name}`?"))
}

impl From<Violation> for SettingsError {
    fn from(violation: Violation) -> Self {
        Self::Wrong(WrongSetting {
            name: violation.name.to_owned(),
            found: violation.found,
            expected: violation.accepts.to_string(),
            nearest: None,
        })
    }
}

/// Declares a choice of a few words: an enum, and how each of its cases is written, once.
///
/// A case reads `Case = "word"`. The enum is read and written by these words; `WORDS` lists them, and `ACCEPTS` is what a
/// setting of this type accepts.
#[macro_export]
macro_rules! declare_words {
    (
        $(#[$attribute:meta])*
        $visibility:vis enum $name:ident {
            $( $(#[$case_attribute:meta])* $case:ident = $word:literal, )+
        }
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, $crate::serde::Serialize, $crate::serde::Deserialize)]
        #[serde(crate = "mackrl_env::serde")]
        $visibility enum $name {
            $(
                $(#[$case_attribute])*
                #[serde(rename = $word)]
                $case,
            )+
        }

        impl $name {
            /// How the cases are written, in the order of declaration.
            $visibility const WORDS: &'static [&'static str] = &[$($word),+];

            /// What a setting of this type accepts.
            $visibility const ACCEPTS: $crate::settings::Accepts = $crate::settings::Accepts::OneOf(Self::WORDS);

            /// How this case is written.
            #[must_use]
            $visibility const fn word(self) -> &'static str {
                match self {
                    $(Self::$case => $word,)+
                }
            }
        }
    };
}

/// Declares a section of settings: the struct, its built-in values, what it accepts and what that means.
///
/// A field reads `name: type = built-in value, accepted values;`, after its meaning and, if need be, how serde treats it. The result is a plain struct with public fields that is
/// read and written by its names and refuses others.
#[macro_export]
macro_rules! declare_settings {
    (
        $(#[$attribute:meta])*
        $visibility:vis struct $section:ident {
            $(
                $(#[doc = $meaning:literal])+
                $(#[serde($($how:tt)+)])?
                $field:ident: $type:ty = $value:expr, $accepts:expr;
            )+
        }
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, PartialEq, $crate::serde::Serialize, $crate::serde::Deserialize)]
        #[serde(crate = "mackrl_env::serde", default, deny_unknown_fields)]
        $visibility struct $section {
            $(
                $(#[doc = $meaning])+
                #[doc = concat!("\n\nAccepts `", stringify!($accepts), "`; `", stringify!($value), "` unless set.")]
                $(#[serde($($how)+)])?
                $visibility $field: $type,
            )+
        }

        impl Default for $section {
            fn default() -> Self {
                Self { $($field: $value),+ }
            }
        }

        impl $crate::settings::Settings for $section {
            const DECLARED: &'static [$crate::settings::Setting] = Self::SETTINGS;

            fn first_violation(&self) -> Option<$crate::settings::Violation> {
                self.violation()
            }
        }

        impl $section {
            /// Every setting of this section with its meaning and the values that it takes, in the order of declaration.
            $visibility const SETTINGS: &'static [$crate::settings::Setting] = &[$(
                $crate::settings::Setting {
                    name: stringify!($field),
                    meaning: concat!($($meaning),+).trim_ascii_start(),
                    accepts: $accepts,
                },
            )+];

            /// The first setting with a value that it does not take.
            #[must_use]
            $visibility fn violation(&self) -> Option<$crate::settings::Violation> {
                let mut settings = Self::SETTINGS.iter();
                $(
                    let violation = settings.next().and_then(|setting| setting.check(&self.$field));
                    if violation.is_some() {
                        return violation;
                    }
                )+
                None
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    fn float(value: f64) -> toml::Value {
        toml::Value::Float(value)
    }

    #[test]
    fn bounds_are_in_or_out_as_they_are_written() {
        let rate = Accepts::above_within(0.0, 1.0);
        assert_eq!(rate.to_string(), "a number in (0, 1]");
        assert!(rate.admits(&float(1.0)) && !rate.admits(&float(0.0)));
        let share = Accepts::within(0.0, 1.0);
        assert_eq!(share.to_string(), "a number in [0, 1]");
        assert!(share.admits(&float(0.0)) && !share.admits(&float(1.5)));
        let norm = Accepts::above(0.0);
        assert_eq!(norm.to_string(), "a finite number > 0");
        assert!(norm.admits(&float(1e300)) && !norm.admits(&float(0.0)));
        let reward = Accepts::within(-1e9, 1e9);
        assert_eq!(reward.to_string(), "a number in [-1e9, 1e9]");
    }

    #[test]
    fn what_is_no_number_is_never_accepted() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(!Accepts::above(0.0).admits(&float(value)), "{value}");
            assert!(!Accepts::within(0.0, 1.0).admits(&float(value)), "{value}");
        }
    }

    #[test]
    fn integers_and_words_are_told_in_words() {
        let seed = Accepts::integer(0, EXACT);
        assert_eq!(seed.to_string(), "an integer in [0, 2^53]");
        assert!(!seed.admits(&toml::Value::Integer(-1)));
        let three = Accepts::OneOf(&["a", "b", "c"]);
        assert_eq!(three.to_string(), "`a`, `b` or `c`");
        assert!(!three.admits(&toml::Value::String("d".into())));
    }

    declare_words! {
        /// A pace.
        enum Pace {
            /// One foot before the other.
            #[default]
            Walk = "at-a-walk",
            /// Both off the ground.
            Run = "running",
        }
    }

    declare_settings! {
        /// How one moves.
        struct Moving {
            /// The pace.
            pace: Pace = Pace::Walk, Pace::ACCEPTS;
            /// Metres of a step.
            stride: f32 = 0.7, Accepts::above(0.0);
        }
    }

    #[test]
    fn a_word_is_written_once_and_read_accepted_and_listed() {
        assert_eq!(Pace::ACCEPTS.to_string(), "`at-a-walk` or `running`");
        for word in Pace::WORDS {
            let table = toml::Table::from_iter([("pace".to_owned(), (*word).into())]);
            assert_eq!(Moving::read(&table).unwrap().pace.word(), *word);
        }
    }

    #[test]
    fn defaults_stand_in_the_order_of_declaration_and_as_readers_see_numbers() {
        assert_eq!(
            Moving::defaults().to_string(),
            "pace = \"at-a-walk\"\nstride = 0.7\n"
        );
    }

    #[test]
    fn an_integer_beyond_toml_is_refused_and_shown() {
        let setting = Setting {
            name: "seed",
            meaning: "",
            accepts: Accepts::integer(0, EXACT),
        };
        let violation = setting.check(&u64::MAX).unwrap();
        assert_eq!(violation.found, u64::MAX.to_string());
        assert_eq!(setting.check(&EXACT), None);
    }

    declare_settings! {
        /// Two settings.
        struct Lamp {
            /// How bright it is.
            brightness: f32 = 1.0, Accepts::within(0.0, 2.0);
            /// What colour it has.
            colour: String = "red".to_owned(), Accepts::OneOf(&["red", "blue"]);
        }
    }

    fn read(text: &str) -> Result<Lamp, SettingsError> {
        Lamp::read(&text.parse().unwrap())
    }

    #[test]
    fn a_table_is_read_over_the_built_in_values() {
        assert_eq!(read(""), Ok(Lamp::default()));
        let lamp = read("brightness = 2").unwrap();
        assert_eq!((lamp.brightness, &*lamp.colour), (2.0, "red"));
    }

    #[test]
    fn a_table_is_refused_with_the_setting_what_was_found_and_what_was_expected() {
        let message = |text| read(text).unwrap_err().to_string();
        assert_eq!(message("hue = 1"), "no setting is called `hue`");
        assert_eq!(
            message("brightness = 2.5"),
            "setting `brightness` is 2.5, expected a number in [0, 2]"
        );
        assert_eq!(
            message("brightness = true"),
            "setting `brightness` is true, expected a number in [0, 2]"
        );
        assert_eq!(
            message("colour = \"green\""),
            "setting `colour` is \"green\", expected `red` or `blue`"
        );
    }
}
