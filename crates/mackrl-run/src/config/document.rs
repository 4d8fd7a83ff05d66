//! Reading TOML into single values that know where they were written.

use std::ops::Range;

use serde::Deserialize;
use toml::{
    Spanned,
    de::{DeTable, DeValue, ValueDeserializer},
};

/// One value of a document, with the tables around it flattened into a path.
#[derive(Debug, Clone, PartialEq)]
pub struct Leaf {
    /// Names from the outermost table to the value.
    pub path: Vec<String>,
    /// The value; never a table.
    pub value: toml::Value,
    /// Byte offset of the key.
    pub key_at: usize,
    /// Byte offset of the value.
    pub value_at: usize,
}

/// A document that is not TOML.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SyntaxError {
    /// What was found and expected.
    pub message: String,
    /// Byte offset.
    pub at: usize,
}

impl From<toml::de::Error> for SyntaxError {
    fn from(error: toml::de::Error) -> Self {
        Self {
            message: error.message().to_owned(),
            at: error.span().map_or(0, |span| span.start),
        }
    }
}

/// The values of a TOML document, in the order in which they were written.
///
/// # Errors
/// If it is not TOML, or an integer does not fit.
pub fn parse_document(text: &str) -> Result<Vec<Leaf>, SyntaxError> {
    let mut leaves = Vec::new();
    collect(DeTable::parse(text)?.get_ref(), &[], &mut leaves)?;
    leaves.sort_by_key(|leaf| leaf.key_at);
    Ok(leaves)
}

/// The values of a `key=value` override; a value that is not TOML is a string.
pub(super) fn parse_assignment(text: &str) -> Result<Vec<Leaf>, SyntaxError> {
    let Some((key, value)) = text.split_once('=') else {
        return Err(SyntaxError {
            message: "expected key=value".to_owned(),
            at: 0,
        });
    };
    let path: Vec<String> = key.trim().split('.').map(str::to_owned).collect();
    let bare = || Spanned::new(0..0, DeValue::String(value.trim().into()));
    let parsed = DeValue::parse(value.trim()).unwrap_or_else(|_| bare());
    let mut leaves = Vec::new();
    collect_value(&parsed, 0..0, path, &mut leaves)?;
    Ok(leaves)
}

fn collect(
    table: &DeTable<'_>,
    parents: &[String],
    leaves: &mut Vec<Leaf>,
) -> Result<(), SyntaxError> {
    for (key, value) in table {
        let mut path = parents.to_vec();
        path.push(key.get_ref().to_string());
        collect_value(value, key.span(), path, leaves)?;
    }
    Ok(())
}

fn collect_value(
    value: &Spanned<DeValue<'_>>,
    key_span: Range<usize>,
    path: Vec<String>,
    leaves: &mut Vec<Leaf>,
) -> Result<(), SyntaxError> {
    if let DeValue::Table(table) = value.get_ref() {
        return collect(table, &path, leaves);
    }
    leaves.push(Leaf {
        path,
        value: toml::Value::deserialize(ValueDeserializer::from(value.clone()))?,
        key_at: key_span.start,
        value_at: value.span().start,
    });
    Ok(())
}

/// Line and column, both from 1, of a byte offset; columns count characters.
#[must_use]
pub fn line_and_column(text: &str, at: usize) -> (usize, usize) {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    let before = &text[..at];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (
        before.matches('\n').count() + 1,
        before[line_start..].chars().count() + 1,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_know_their_place_however_their_table_is_written() {
        let text = "run.seed = 3\n[learner]\ngamma = 0.5\n";
        let leaves = parse_document(text).unwrap();
        let places: Vec<_> = leaves
            .iter()
            .map(|leaf| (leaf.path.join("."), line_and_column(text, leaf.value_at)))
            .collect();
        assert_eq!(
            places,
            [
                ("run.seed".to_owned(), (1, 12)),
                ("learner.gamma".to_owned(), (3, 9))
            ]
        );
    }

    #[test]
    fn columns_count_characters() {
        assert_eq!(line_and_column("ε = 1", "ε = ".len()), (1, 5));
    }

    #[test]
    fn an_override_takes_toml_and_bare_words() {
        let value = |text: &str| parse_assignment(text).unwrap()[0].value.clone();
        assert_eq!(value("a.b=0.5"), toml::Value::Float(0.5));
        assert_eq!(value("a.b=true"), toml::Value::Boolean(true));
        assert_eq!(value("a.b=2s3z"), toml::Value::String("2s3z".into()));
        assert_eq!(value("a.b = \"3m\""), toml::Value::String("3m".into()));
        assert_eq!(
            value("a.b=sampled:5"),
            toml::Value::String("sampled:5".into())
        );
    }

    #[test]
    fn an_integer_that_does_not_fit_is_refused() {
        assert!(parse_document("a = 99999999999999999999999").is_err());
    }
}
