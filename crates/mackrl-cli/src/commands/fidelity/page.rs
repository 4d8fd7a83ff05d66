//! The comparison as text, as Markdown and as a page.

use std::fmt::Write as _;

use mackrl_skirmish::fidelity::{Finding, QUANTILES, Quantity, References};

use super::{Comparison, chart};
use crate::output;

/// What stands above the table.
const INTRODUCTION: &str = "Training logs of the real StarCraft II with SMAC are public. Their first episodes are random play, and tests of \
    untrained networks repeat one action (`stop`; `attack-k`: attack enemy k if that is possible, else stop). The same policies \
    are played here. A row passes if the two means differ by no more than the tolerance, a check if all of its rows pass. Rules were chosen by the \
    rows marked fitted; the others were kept for testing them. Rows about trained teams are open: they need a learner.";

/// The table for a terminal.
pub(super) fn terminal(comparison: &Comparison) -> String {
    let heading = HEADING.map(str::to_owned).to_vec();
    let rows = comparison.checks.iter().map(|row| cells(row).to_vec());
    let rows: Vec<Vec<String>> = std::iter::once(heading).chain(rows).collect();
    format!("{}\n{}\n", output::table(&rows), verdict(comparison))
}

/// The page as Markdown; `picture` is the file of the plots.
pub(super) fn markdown(comparison: &Comparison, references: &References, picture: &str) -> String {
    let Comparison {
        command,
        simulator_version,
        ..
    } = comparison;
    let mut text = format!(
        "# The simulator beside the real game\n\n{INTRODUCTION}\n\nSimulator version {simulator_version}; this page was written by \
         `{command} --markdown docs/fidelity.md`.\n\n**{}**\n\n",
        verdict(comparison)
    );
    text += &pipes(
        &HEADING.map(str::to_owned),
        comparison.checks.iter().map(cells),
    );
    text += "\n## Lengths of episodes, random play\n\n";
    text += &format!(
        "![Shares of episodes that are over by a step, simulator and game]({picture})\n\n"
    );
    text += &pipes(&length_heading(), length_rows(comparison));
    text += "\n## Where the real numbers were read\n\nNumbers only, from training logs (`info.json` of Sacred) at these commits:\n\n";
    for source in &references.sources {
        let _ = writeln!(
            text,
            "- [{}](https://github.com/{}/tree/{}): {}",
            source.repository,
            source.repository,
            source.commit,
            source.maps.join(", ")
        );
    }
    text
}

/// The page as one HTML file.
pub(super) fn html(comparison: &Comparison, references: &References) -> String {
    let mut body = format!(
        "<h1>The simulator beside the real game</h1>\n<p>{INTRODUCTION}</p>\n<p>Simulator version {}, <code>{}</code></p>\n\
         <p><strong>{}</strong></p>\n",
        comparison.simulator_version,
        comparison.command,
        verdict(comparison)
    );
    body += &table(
        &HEADING.map(str::to_owned),
        comparison.checks.iter().map(cells),
    );
    body += "<h2>Lengths of episodes, random play</h2>\n";
    body += &chart::lengths(&comparison.lengths).to_svg();
    body += &table(&length_heading(), length_rows(comparison));
    body += "<h2>Where the real numbers were read</h2>\n<ul>\n";
    for source in &references.sources {
        let _ = writeln!(
            body,
            "<li><a href=\"https://github.com/{0}/tree/{1}\">{0}</a>: {2}</li>",
            source.repository,
            source.commit,
            source.maps.join(", ")
        );
    }
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>The simulator beside the real game</title>\n\
         <style>body{{font-family:sans-serif;max-width:64em;margin:2em auto}}td,th{{padding:.1em .6em;text-align:right}}\
         td:first-child,th:first-child{{text-align:left}}</style>\n</head>\n<body>\n{body}</ul>\n</body>\n</html>\n"
    )
}

/// How many checks pass, in words.
fn verdict(comparison: &Comparison) -> String {
    let passed = comparison.summary.iter().filter(|check| check.pass).count();
    let failed: Vec<&str> = comparison
        .summary
        .iter()
        .filter(|check| !check.pass)
        .map(|check| check.name.as_str())
        .collect();
    let mut text = format!(
        "{passed} of {} checks pass on {} episodes each",
        comparison.summary.len(),
        comparison.episodes
    );
    if !failed.is_empty() {
        text += &format!("; not {}", failed.join(", "));
    }
    let mut open: Vec<&str> = comparison
        .checks
        .iter()
        .filter(|row| row.pass.is_none())
        .map(|row| row.name.as_str())
        .collect();
    open.dedup();
    if !open.is_empty() {
        text += &format!("; open: {}", open.join(", "));
    }
    text
}

const HEADING: [&str; 9] = [
    "check",
    "map",
    "policy",
    "quantity",
    "real",
    "tolerance",
    "ours",
    "passes",
    "fitted",
];

fn cells(row: &Finding) -> [String; 9] {
    let digits = match row.quantity {
        Quantity::Length | Quantity::MedianLength => 1,
        _ => 2,
    };
    let digits = if row.tolerance < 0.5 { 2 } else { digits };
    let number = |value: f64| format!("{value:.digits$}");
    let real = match row.error {
        Some(error) => format!("{} ± {error:.2}", number(row.real)),
        None => number(row.real),
    };
    [
        row.name.clone(),
        row.map.clone(),
        row.policy
            .map_or("trained".to_owned(), |policy| policy.to_string()),
        word(row.quantity).to_owned(),
        real,
        number(row.tolerance),
        row.ours.map_or_else(String::new, number),
        match row.pass {
            Some(true) => "yes",
            Some(false) => "NO",
            None => "open",
        }
        .to_owned(),
        if row.fitted { "fitted" } else { "" }.to_owned(),
    ]
}

const fn word(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Length => "length",
        Quantity::LengthSd => "sd of length",
        Quantity::MedianLength => "median length",
        Quantity::Return => "return",
        Quantity::Killed => "enemies killed",
        Quantity::Lost => "agents lost",
        Quantity::AllLost => "all agents lost",
        Quantity::Won => "battles won",
    }
}

fn length_heading() -> [String; 7] {
    let mut heading = QUANTILES
        .map(|part| format!("{:.0} %", 100.0 * part))
        .to_vec();
    heading.insert(0, "episodes".to_owned());
    heading.insert(0, "map".to_owned());
    heading.try_into().expect("two and five")
}

fn length_rows(comparison: &Comparison) -> impl Iterator<Item = [String; 7]> + '_ {
    comparison.lengths.iter().flat_map(|row| {
        let cells = |who: &str, count: usize, quantiles: [f64; 5]| {
            let [a, b, c, d, e] = quantiles.map(|value| format!("{value:.0}"));
            [
                format!("{}, {who}", row.map),
                count.to_string(),
                a,
                b,
                c,
                d,
                e,
            ]
        };
        [
            cells("real", row.real_episodes, row.real),
            cells("ours", row.ours.count, row.ours.quantiles),
        ]
    })
}

/// A table in Markdown.
fn pipes<const N: usize>(heading: &[String; N], rows: impl Iterator<Item = [String; N]>) -> String {
    let line = |cells: &[String; N]| format!("| {} |\n", cells.join(" | "));
    let mut text = line(heading) + &format!("|---|{}\n", "---:|".repeat(N - 1));
    rows.for_each(|row| text += &line(&row));
    text
}

/// A table in HTML.
fn table<const N: usize>(heading: &[String; N], rows: impl Iterator<Item = [String; N]>) -> String {
    let line = |tag: &str, cells: &[String; N]| {
        let cells = cells.iter().map(|cell| format!("<{tag}>{cell}</{tag}>"));
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let mut text = "<table>\n".to_owned() + &line("th", heading);
    rows.for_each(|row| text += &line("td", &row));
    text + "</table>\n"
}
