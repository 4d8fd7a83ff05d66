//! The report for people.

use std::fmt::{Display, Formatter, Result};

use mackrl::tabular::Learner;

use super::{
    findings::name,
    report::{Figure5Report, Quantity, StateDelegation},
};
use crate::reproduce::{entry, number, write_verdicts};

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
        write_verdicts(out, &self.claims)
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
                write!(
                    out,
                    "   {:<13} {published:>9}",
                    entry(curve.mean[point], curve.sem[point])
                )?;
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
