//! What is known about a setting besides its value, and the macro that declares both together.

/// A setting as it is explained to users.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Setting {
    /// Dotted key, such as `learner.gamma`.
    pub key: &'static str,
    pub(super) documentation: &'static str,
    /// Which values are accepted, in words that follow "expected".
    pub expects: &'static str,
}

impl Setting {
    /// What it means, with its unit: the documentation of its field.
    #[must_use]
    pub fn meaning(&self) -> &'static str {
        self.documentation.trim_start()
    }
}

/// A value outside its range.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Violation {
    /// Dotted key.
    pub(super) key: &'static str,
    /// Which values are accepted.
    pub(super) expects: &'static str,
}

/// Declares a section of the configuration: the struct, its built-in values, its ranges and their explanation.
///
/// A field reads `name: type = built-in value, "accepted values", predicate;`. The result is a plain struct with public
/// fields that refuses unknown keys.
macro_rules! section {
    (
        $(#[doc = $summary:literal])+
        $section:literal $name:ident {
            $( $(#[doc = $meaning:literal])+ $field:ident: $type:ty = $value:expr, $expects:literal, $accepts:expr; )+
        }
    ) => {
        $(#[doc = $summary])+
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $(
                $(#[doc = $meaning])+
                #[doc = concat!("\n\nExpects ", $expects, "; `", stringify!($value), "` unless set.")]
                pub $field: $type,
            )+
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $value),+ }
            }
        }

        impl $name {
            const SETTINGS: &[$crate::config::Setting] = &[$(
                $crate::config::Setting {
                    key: concat!($section, ".", stringify!($field)),
                    documentation: concat!($($meaning),+),
                    expects: $expects,
                },
            )+];

            fn violations(&self) -> Vec<$crate::config::settings::Violation> {
                let mut violations = Vec::new();
                $(
                    let accepts: fn(&$type) -> bool = $accepts;
                    if !accepts(&self.$field) {
                        violations.push($crate::config::settings::Violation {
                            key: concat!($section, ".", stringify!($field)),
                            expects: $expects,
                        });
                    }
                )+
                violations
            }
        }
    };
}

pub(super) use section;
