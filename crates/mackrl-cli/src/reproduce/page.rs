//! Tables in pages that people write: the part between two marks is made by a command, the rest is theirs.

use std::path::Path;

use anyhow::Context as _;
use mackrl_run::{bounded, run_folder};

use crate::failure::Failure;

/// Greatest length of a page in bytes.
const LENGTH_MAX: usize = 1 << 20;

/// The marks around the part called `name`: comments, which no reader of the page sees.
fn marks(name: &str) -> [String; 2] {
    ["begin", "end"].map(|side| format!("<!-- {name}: {side} -->"))
}

/// Puts `text` between the marks of the page, in place of what stands there.
///
/// # Errors
/// [`Failure::BadData`] if the page lacks the marks; otherwise what cannot be read or written.
pub(super) fn fill(page: &Path, name: &str, text: &str) -> anyhow::Result<()> {
    let old = bounded::read_text(page, LENGTH_MAX)?;
    let filled = filled(&old, name, text).ok_or_else(|| {
        let [begin, end] = marks(name);
        let message = format!("{} has no lines {begin} and {end}", page.display());
        Failure::BadData { message }
    })?;
    run_folder::replace(page, filled.as_bytes())
        .with_context(|| format!("cannot fill in {}", page.display()))
}

fn filled(old: &str, name: &str, text: &str) -> Option<String> {
    let [begin, end] = marks(name);
    let (before, rest) = old.split_once(&begin)?;
    let (_, after) = rest.split_once(&end)?;
    Some(format!(
        "{before}{begin}\n{}\n{end}{after}",
        text.trim_end()
    ))
}

/// A table in Markdown: the first column to the left, the others to the right.
pub(super) fn table(heading: &[&str], rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let headings: Vec<String> = heading.iter().map(|&word| word.to_owned()).collect();
    let sides = format!("|---|{}\n", "---:|".repeat(heading.len().saturating_sub(1)));
    let rows = rows.iter().map(|row| line(row));
    [line(&headings), sides].into_iter().chain(rows).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_stands_between_the_marks_is_replaced() {
        let page = "# Mine\n\n<!-- x: begin -->\nold\n<!-- x: end -->\n\nMore.\n";
        let expected = "# Mine\n\n<!-- x: begin -->\nnew\nlines\n<!-- x: end -->\n\nMore.\n";
        let once = filled(page, "x", "new\nlines\n").unwrap();
        assert_eq!(once, expected);
        assert_eq!(filled(&once, "x", "new\nlines\n").unwrap(), expected);
        assert_eq!(filled(page, "y", "new"), None);
    }

    #[test]
    fn a_table_is_markdown() {
        let rows = vec![vec!["3m".to_owned(), "1.00".to_owned()]];
        assert_eq!(
            table(&["map", "won"], &rows),
            "| map | won |\n|---|---:|\n| 3m | 1.00 |\n"
        );
    }
}
