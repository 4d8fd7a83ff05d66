//! The report for people.

use std::fmt::{Display, Formatter, Result};

use mackrl::tabular::{Curve, Learner};

use super::{
    findings::name,
    report::{Claim, ClaimSource, Figure5Report, Quantity, StateDelegation},
};

/// Columns of a terminal that evidence is broken to.
const COLUMNS: usize = 100;

impl Display for Figure5Report {
    fn fmt(&self, out: &mut Formatter<'_>) -> Result {
        let quantity = match self.quantity {
            Quantity::Train => "expected return",
            Quantity::Test => "expected return of the greedy policy",
        };
        writeln!(
            out,
            "Figure 5, {quantity}: mean ± standard error of {} runs",
            self.runs
        )?;
        writeln!(out, "{}\n", self.command)?;
        self.write_curves(out)?;
        self.write_delegation(out)?;
        writeln!(out, "Verdicts")?;
        self.claims
            .iter()
            .try_for_each(|claim| write_claim(claim, out))
    }
}

impl Figure5Report {
    fn write_curves(&self, out: &mut Formatter<'_>) -> Result {
        let learners = [
            (Learner::Mackrl, &self.curves.mackrl),
            (Learner::Iac, &self.curves.iac),
            (Learner::Jal, &self.curves.jal),
        ];
        write!(out, "{:>4}", "")?;
        for (learner, _) in learners {
            write!(out, "   {:<23}", name(learner))?;
        }
        writeln!(out, "   optimum")?;
        write!(out, "{:>4}", "p")?;
        for _ in learners {
            write!(out, "   {:<13} {:>9}", "ours", "published")?;
        }
        writeln!(out, "   {:>11} {:>6}", "MACKRL, IAC", "JAL")?;
        for (point, &p) in self.points.iter().enumerate() {
            write!(out, "{p:>4.1}")?;
            for (learner, curve) in learners {
                let published = number(self.published.at(learner, p));
                write!(out, "   {:<13} {published:>9}", entry(curve, point))?;
            }
            let (mackrl, jal) = (self.optimum.mackrl[point], self.optimum.jal[point]);
            writeln!(out, "   {mackrl:>11.3} {jal:>6.3}")?;
        }
        writeln!(out, "published: {}\n", self.published.source)
    }

    fn write_delegation(&self, out: &mut Formatter<'_>) -> Result {
        writeln!(
            out,
            "Probability that MACKRL's pair controller delegates, by what is common knowledge"
        )?;
        writeln!(
            out,
            "{:>4}   {:>8}   {:>8}   {:>8}   runs as described",
            "p", "nothing", "matrix A", "matrix B"
        )?;
        let states = &self.delegation;
        for (point, p) in self.points.iter().enumerate() {
            let of = |state: &StateDelegation| number(state.mean[point]);
            let (nothing, a, b) = (
                of(&states.nothing),
                of(&states.matrix_a),
                of(&states.matrix_b),
            );
            let share = 100.0 * states.runs_as_described[point];
            writeln!(
                out,
                "{p:>4.1}   {nothing:>8}   {a:>8}   {b:>8}   {share:>15.0} %"
            )?;
        }
        writeln!(out)
    }
}

fn write_claim(claim: &Claim, out: &mut Formatter<'_>) -> Result {
    let verdict = if claim.holds {
        "holds        "
    } else {
        "does not hold"
    };
    let source = match claim.source {
        ClaimSource::Paper => "paper",
        ClaimSource::Reproduction => "ours ",
    };
    let mut heading = format!("  {verdict}  {source}  ");
    let indent = " ".repeat(heading.chars().count());
    for line in wrapped(&claim.claim, COLUMNS - indent.len()) {
        writeln!(out, "{heading}{line}")?;
        heading.clone_from(&indent);
    }
    for line in wrapped(&claim.evidence, COLUMNS - 6) {
        writeln!(out, "      {line}")?;
    }
    Ok(())
}

fn entry(curve: &Curve, point: usize) -> String {
    format!("{:.3} ± {:.3}", curve.mean[point], curve.sem[point])
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "–".into(), |value| format!("{value:.3}"))
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
