//! What is known about a setting besides its value.

use mackrl_env::settings::{self, Accepts};

/// A setting as it is explained to users.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Dotted key, such as `learner.gamma`.
    pub key: String,
    /// What it means, with its unit.
    pub meaning: &'static str,
    /// Which values it takes, in words that follow "expected".
    pub accepts: Accepts,
}

/// The settings of a section, declared under their own names.
pub(super) fn in_section(
    section: &str,
    declared: &'static [settings::Setting],
) -> impl Iterator<Item = Setting> {
    let section = section.to_owned();
    declared.iter().map(move |declared| Setting {
        key: format!("{section}.{}", declared.name),
        meaning: declared.meaning,
        accepts: declared.accepts,
    })
}
