//! An explanation as text.

use std::fmt;

use mackrl::policy::GroupChoice;

use super::{Controllers, Explanation, Knowledge, Pair};
use crate::output;

/// Pairs up to which those that know nothing in common are listed one by one.
const PAIRS_LISTED: usize = 28;

impl fmt::Display for Explanation {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}", self.episode)?;
        write!(out, "\nStep {}", self.step)?;
        if let Some(value) = self.value {
            write!(out, ": V(s) = {value:.3}")?;
        }
        if let Some(reward) = self.reward {
            write!(out, ", reward of the step {reward:.3}")?;
        }
        writeln!(out, "\n\nWho sees whom (a row sees the columns marked +)")?;
        out.write_str(&indented(&self.visibility()))?;
        writeln!(out, "\nCommon knowledge of pairs")?;
        self.knowledge(out)?;
        if !self.actions.is_empty() {
            writeln!(out, "\nWhat they did")?;
            let rows = self.actions.iter();
            let rows: Vec<Vec<String>> = rows
                .map(|taken| vec![format!("{}  {}", taken.agent, taken.action)])
                .collect();
            out.write_str(&indented(&output::table(&rows)))?;
        }
        match &self.controllers {
            Some(controllers) => controllers.write(out),
            None => Ok(()),
        }
    }
}

impl Explanation {
    /// The matrix of who sees whom.
    fn visibility(&self) -> String {
        let living: Vec<_> = self
            .entities
            .iter()
            .filter(|entity| entity.is_alive)
            .collect();
        let names = living.iter().map(|entity| entity.name.clone());
        let mut rows = vec![
            std::iter::once(String::new())
                .chain(names)
                .collect::<Vec<_>>(),
        ];
        for view in self.views.iter().filter(|view| !view.sees.is_empty()) {
            let cells = living.iter().map(|entity| {
                let mark = if view.sees.contains(&entity.name) {
                    "+"
                } else {
                    "."
                };
                mark.to_owned()
            });
            rows.push(std::iter::once(view.agent.clone()).chain(cells).collect());
        }
        output::table(&rows)
    }

    fn knowledge(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut left_out = 0;
        for knowledge in &self.knowledge {
            if knowledge.common.is_empty() && self.knowledge.len() > PAIRS_LISTED {
                left_out += 1;
                continue;
            }
            knowledge.write(out)?;
        }
        match left_out {
            0 => Ok(()),
            pairs => writeln!(out, "  {pairs} other pairs know nothing in common"),
        }
    }
}

impl Knowledge {
    fn write(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let common = if self.common.is_empty() {
            "nothing".to_owned()
        } else {
            self.common.join(", ")
        };
        writeln!(
            out,
            "  {}: {common}, because {}",
            self.group.join(", "),
            self.why
        )?;
        if !self.mutual_but_not_common.is_empty() {
            let entities = self.mutual_but_not_common.join(", ");
            writeln!(
                out,
                "      both see {entities}, which is not common knowledge"
            )?;
        }
        for private in &self.private {
            let (seers, entities) = (private.seen_by.join(", "), private.entities.join(", "));
            writeln!(out, "      only {seers} sees {entities}")?;
        }
        Ok(())
    }
}

impl Controllers {
    fn write(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.partitions.is_empty() {
            writeln!(out, "\nPartitions (> was chosen)")?;
            let mut rows = vec![words(["  partition", "probability", "posterior"])];
            rows.extend(self.partitions.iter().map(|partition| {
                vec![
                    format!("{} {}", mark(partition.is_chosen), partition.groups),
                    format!("{:.4}", partition.probability),
                    format!("{:.4}", partition.posterior),
                ]
            }));
            out.write_str(&indented(&output::table(&rows)))?;
        }
        if !self.pairs.is_empty() {
            writeln!(out, "\nPairs (> was taken)")?;
            let rows: Vec<Vec<String>> = self.pairs.iter().flat_map(Pair::rows).collect();
            out.write_str(&indented(&output::table(&rows)))?;
        }
        writeln!(
            out,
            "\nAgents alone (> was taken by the agent, jointly or alone)"
        )?;
        let rows = self.agents.iter().flat_map(|agent| {
            agent.options.iter().map(|option| {
                let name = format!(
                    "{}: {} {}",
                    agent.agent,
                    mark(option.is_taken),
                    option.action
                );
                vec![name, format!("{:.4}", option.probability)]
            })
        });
        out.write_str(&indented(&output::table(&rows.collect::<Vec<_>>())))?;
        writeln!(out, "\nThe way that was taken")?;
        let mut rows: Vec<Vec<String>> = (self.path.iter())
            .map(|chosen| {
                let name = format!("{}: {}", chosen.controller, chosen.choice);
                vec![name, format!("{:.4}", chosen.probability)]
            })
            .collect();
        rows.push(words(["product", &scientific(self.path_probability)]));
        let marginal = scientific(self.marginal_probability);
        rows.push(words(["over all ways, p(u)", &marginal]));
        out.write_str(&indented(&output::table(&rows)))
    }
}

impl Pair {
    fn rows(&self) -> Vec<Vec<String>> {
        let members = self.members.join(", ");
        let delegate = format!(
            "{members}: {} delegate",
            mark(self.choice == Some(GroupChoice::Delegate))
        );
        let mut rows = vec![vec![delegate, format!("{:.4}", self.delegate_probability)]];
        rows.extend(self.joint.iter().map(|option| {
            let is_taken = option.is_taken && self.choice == Some(GroupChoice::Joint);
            let name = format!("{members}: {} {}", mark(is_taken), option.action);
            vec![name, format!("{:.4}", option.probability)]
        }));
        rows
    }
}

fn mark(is_chosen: bool) -> char {
    if is_chosen { '>' } else { ' ' }
}

/// A probability that may be tiny.
fn scientific(probability: f64) -> String {
    if probability >= 1e-3 {
        format!("{probability:.4}")
    } else {
        format!("{probability:.3e}")
    }
}

fn words<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_owned).to_vec()
}

fn indented(text: &str) -> String {
    text.lines().map(|line| format!("  {line}\n")).collect()
}
