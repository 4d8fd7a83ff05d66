//! Claims of the paper and the verdicts on them.

use std::fmt::{Formatter, Result};

use serde::{Deserialize, Serialize};

/// Columns of a terminal that evidence is broken to.
const COLUMNS: usize = 100;

/// A statement and the verdict on it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Claim {
    /// The statement.
    pub(crate) claim: String,
    /// Who makes it.
    pub(crate) source: ClaimSource,
    /// Whether it holds.
    pub(crate) verdict: Verdict,
    /// The rule and the numbers, or what is needed to judge.
    pub(crate) evidence: String,
}

/// What can be said of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Verdict {
    /// The numbers support it.
    Holds,
    /// They do not.
    DoesNotHold,
    /// There are too few runs, or they are too short, to say.
    NotTested,
}

impl Verdict {
    /// Of a rule that was applied to numbers enough.
    pub(crate) const fn of(holds: bool) -> Self {
        if holds {
            Self::Holds
        } else {
            Self::DoesNotHold
        }
    }

    /// As it is written in reports.
    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::DoesNotHold => "does not hold",
            Self::NotTested => "not tested",
        }
    }
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
        let texts = [&*self.claim, &*self.evidence];
        write_verdict(out, self.verdict, self.source, texts)
    }
}

/// Writes a verdict, a claim and the evidence, wrapped.
pub(super) fn write_verdict(
    out: &mut Formatter<'_>,
    verdict: Verdict,
    source: ClaimSource,
    [claim, evidence]: [&str; 2],
) -> Result {
    let source = match source {
        ClaimSource::Paper => "paper",
        ClaimSource::Reproduction => "ours ",
    };
    let verdict = verdict.words();
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
