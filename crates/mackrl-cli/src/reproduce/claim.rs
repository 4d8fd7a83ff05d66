//! Claims of the paper and the verdicts on them.

use std::fmt::{Formatter, Result};

use serde::{Deserialize, Serialize};

/// Columns of a terminal that evidence is broken to.
const COLUMNS: usize = 100;

/// A statement and whether it holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Claim {
    /// The statement.
    pub(crate) claim: String,
    /// Who makes it.
    pub(crate) source: ClaimSource,
    /// The verdict.
    pub(crate) holds: bool,
    /// The rule and the numbers.
    pub(crate) evidence: String,
}

/// Who makes a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ClaimSource {
    /// The paper's text.
    Paper,
    /// This project, about the paper's figure or the game.
    Reproduction,
}

impl Claim {
    /// Writes the verdict, the claim and the evidence, wrapped.
    fn write(&self, out: &mut Formatter<'_>) -> Result {
        let verdict = if self.holds { "holds" } else { "does not hold" };
        write_verdict(out, verdict, self.source, [&self.claim, &self.evidence])
    }
}

/// Writes a verdict, a claim and the evidence, wrapped.
pub(super) fn write_verdict(
    out: &mut Formatter<'_>,
    verdict: &str,
    source: ClaimSource,
    [claim, evidence]: [&str; 2],
) -> Result {
    let source = match source {
        ClaimSource::Paper => "paper",
        ClaimSource::Reproduction => "ours ",
    };
    let mut heading = format!("  {verdict:<13}  {source}  ");
    let indent = " ".repeat(heading.chars().count());
    for line in wrapped(claim, COLUMNS - indent.len()) {
        writeln!(out, "{heading}{line}")?;
        heading.clone_from(&indent);
    }
    for line in wrapped(evidence, COLUMNS - 6) {
        writeln!(out, "      {line}")?;
    }
    Ok(())
}

/// Writes all verdicts, below a heading.
pub(crate) fn write_verdicts(out: &mut Formatter<'_>, claims: &[Claim]) -> Result {
    writeln!(out, "Verdicts")?;
    claims.iter().try_for_each(|claim| claim.write(out))
}

/// Breaks `text` at spaces into lines of at most `columns` characters, unless a word is longer.
fn wrapped(text: &str, columns: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= columns => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}
