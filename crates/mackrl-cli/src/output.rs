//! Writing results to stdout.

use std::{
    io::{self, Write},
    path::Path,
};

use anyhow::Context;
use mackrl_run::provenance::Provenance;
use serde::Serialize;

use crate::failure::Failure;

/// Writes `text` to stdout. Names of files and folders may stand in it, and anything may stand in them: what controls a terminal
/// is left out.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    let mut stdout = io::stdout().lock();
    let shown = text.replace(|c: char| c.is_control() && !matches!(c, '\n' | '\t'), " ");
    let written = stdout.write_all(shown.as_bytes());
    let flushed = written.and_then(|()| stdout.flush());
    Ok(flushed.map_err(Failure::Stdout)?)
}

/// Writes `value` to stdout as indented JSON.
pub(crate) fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    let json = serde_json::to_string_pretty(value).context("cannot write the result as JSON")?;
    print(&(json + "\n"))
}

/// Writes a file that was asked for by name, which may be a pipe or a device.
pub(crate) fn write_file(file: &Path, content: &[u8]) -> anyhow::Result<()> {
    std::fs::write(file, content).with_context(|| format!("cannot write {}", file.display()))
}

/// A result with where it comes from; as JSON, one object.
#[derive(Debug, Serialize)]
pub(crate) struct Sourced<T> {
    pub(crate) provenance: Provenance,
    #[serde(flatten)]
    pub(crate) result: T,
}

/// Lays out rows of cells in columns: the first to the left, the others to the right. The first row is the heading.
pub(crate) fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter()
            .filter_map(|row| row.get(column))
            .map(|cell| cell.chars().count())
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells: Vec<String> = row
            .iter()
            .enumerate()
            .map(|(column, cell)| match column {
                0 => format!("{cell:<0$}", widths[0]),
                _ => format!("{cell:>0$}", widths[column]),
            })
            .collect();
        cells.join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}

/// Text that stays text wherever it stands in a page.
pub(crate) fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stand_left_and_numbers_right() {
        let rows = [["map", "n"], ["2s3z", "10"]].map(|row| row.map(str::to_owned).to_vec());
        assert_eq!(table(&rows), "map    n\n2s3z  10\n");
    }
}
