//! Where in a text a value was written.

use std::ops::Range;

use serde_path_to_error::Segment;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{ScenarioProblem, words::plain};

/// Keys and positions that lead from the document to a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Path(Vec<Part>);

#[derive(Debug, Clone, PartialEq, Eq)]
enum Part {
    Field(String),
    Item(usize),
}

impl Path {
    /// The value of a key of the document.
    pub(super) fn new(field: &str) -> Self {
        Self(Vec::new()).field(field)
    }

    /// The value of a key of this table.
    pub(super) fn field(mut self, name: &str) -> Self {
        self.0.push(Part::Field(name.to_owned()));
        self
    }

    /// The value that a reader of this value stumbled over.
    pub(super) fn down_to(mut self, stumble: &serde_path_to_error::Path) -> Self {
        for segment in stumble {
            self = match segment {
                Segment::Map { key } | Segment::Enum { variant: key } => self.field(key),
                Segment::Seq { index } => self.item(*index),
                Segment::Unknown => break,
            };
        }
        self
    }

    /// An element of this array.
    pub(super) fn item(mut self, index: usize) -> Self {
        self.0.push(Part::Item(index));
        self
    }
}

/// A parsed text that knows where its values are.
#[derive(Debug)]
pub(super) struct Places<'a> {
    text: &'a str,
    document: Spanned<DeTable<'a>>,
}

impl<'a> Places<'a> {
    /// Parses `text`; an error is what is wrong with it as TOML.
    pub(super) fn new(text: &'a str) -> Result<Self, ScenarioProblem> {
        let document = DeTable::parse(text).map_err(|error| problem_of(text, &error))?;
        Ok(Self { text, document })
    }

    /// An error of reading the text into types.
    pub(super) fn of_error(&self, error: &toml::de::Error) -> ScenarioProblem {
        problem_of(self.text, error)
    }

    /// A problem with the value at `path`, or with the innermost table around it that was written.
    pub(super) fn problem(&self, path: &Path, message: String) -> ScenarioProblem {
        let span = self.span(path).unwrap_or(0..0);
        problem_at(self.text, span.start, message)
    }

    fn span(&self, path: &Path) -> Option<Range<usize>> {
        let Some((Part::Field(first), rest)) = path.0.split_first() else {
            return None;
        };
        let mut value = field(self.document.get_ref(), first)?;
        for part in rest {
            let inner = match (part, value.get_ref()) {
                (Part::Field(name), DeValue::Table(table)) => field(table, name),
                (Part::Item(index), DeValue::Array(array)) => array.get(*index),
                _ => None,
            };
            match inner {
                Some(inner) => value = inner,
                None => break,
            }
        }
        Some(value.span())
    }
}

fn field<'t, 'a>(table: &'t DeTable<'a>, name: &str) -> Option<&'t Spanned<DeValue<'a>>> {
    let found = table.iter().find(|(key, _)| key.get_ref() == name);
    found.map(|(_, value)| value)
}

fn problem_of(text: &str, error: &toml::de::Error) -> ScenarioProblem {
    let at = error.span().map_or(0, |span| span.start);
    problem_at(text, at, plain(error.message()))
}

fn problem_at(text: &str, at: usize, message: String) -> ScenarioProblem {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    let before = &text[..at];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    ScenarioProblem {
        line: before.matches('\n').count() + 1,
        column: before[line_start..].chars().count() + 1,
        message,
    }
}
