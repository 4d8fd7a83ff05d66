//! An explanation as text.

use std::fmt;

use mackrl::policy::GroupChoice;

use super::{Controllers, Entry, Explanation, Knowledge, Pair};
use crate::output;

/// Below this probability, entries are summed up instead of listed.
const IMPROBABLE: f32 = 0.001;
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
            let (listed, others) = apart(&self.partitions, |partition| {
                (
                    partition.probability.max(partition.posterior),
                    partition.is_chosen,
                )
            });
            rows.extend(listed.iter().map(|partition| {
                vec![
                    format!("{} {}", mark(partition.is_chosen), partition.groups),
                    format!("{:.4}", partition.probability),
                    format!("{:.4}", partition.posterior),
                ]
            }));
            rows.extend(and_others("", &others, |partition| partition.probability));
            out.write_str(&indented(&output::table(&rows)))?;
        }
        if let Some(team) = &self.team {
            writeln!(out, "\nThe whole team (> was taken)")?;
            let rows = entries(&team.members.join(", "), &team.joint, |option| {
                option.is_taken
            });
            out.write_str(&indented(&output::table(&rows)))?;
        }
        if !self.pairs.is_empty() {
            writeln!(out, "\nPairs (> was taken)")?;
            let rows: Vec<Vec<String>> = self.pairs.iter().flat_map(Pair::rows).collect();
            out.write_str(&indented(&output::table(&rows)))?;
        }
        if !self.agents.is_empty() {
            writeln!(
                out,
                "\nAgents alone (> was taken by the agent, jointly or alone)"
            )?;
            let rows = self
                .agents
                .iter()
                .flat_map(|agent| entries(&agent.agent, &agent.options, |option| option.is_taken));
            out.write_str(&indented(&output::table(&rows.collect::<Vec<_>>())))?;
        }
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
        let acted_jointly = self.choice == Some(GroupChoice::Joint);
        rows.extend(entries(&members, &self.joint, |option| {
            option.is_taken && acted_jointly
        }));
        rows
    }
}

/// The entries of a controller's table, of which improbable ones are summed up.
fn entries(controller: &str, all: &[Entry], is_taken: impl Fn(&Entry) -> bool) -> Vec<Vec<String>> {
    let (listed, others) = apart(all, |entry| (entry.probability, is_taken(entry)));
    let rows = listed.iter().map(|entry| {
        let name = format!("{controller}: {} {}", mark(is_taken(entry)), entry.action);
        vec![name, format!("{:.4}", entry.probability)]
    });
    let others = and_others(&format!("{controller}: "), &others, |entry| {
        entry.probability
    });
    rows.chain(others).collect()
}

/// What is listed one by one, and what is improbable and was not taken.
fn apart<T>(all: &[T], of: impl Fn(&T) -> (f32, bool)) -> (Vec<&T>, Vec<&T>) {
    let (listed, others): (Vec<&T>, Vec<&T>) = all.iter().partition(|entry| {
        let (probability, is_taken) = of(entry);
        is_taken || probability >= IMPROBABLE
    });
    match others.len() {
        // A line of its own says more than "and 1 other".
        1 => (all.iter().collect(), Vec::new()),
        _ => (listed, others),
    }
}

/// "and 34 others", with their probability together.
fn and_others<T>(
    controller: &str,
    others: &[&T],
    probability: impl Fn(&T) -> f32,
) -> Option<Vec<String>> {
    let together: f32 = others.iter().map(|entry| probability(entry)).sum();
    let name = format!("{controller}  and {} others", others.len());
    (!others.is_empty()).then(|| vec![name, format!("{together:.4}")])
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
