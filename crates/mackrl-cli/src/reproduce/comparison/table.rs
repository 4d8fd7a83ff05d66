//! The comparison as text: for a terminal, and for a page.

use std::fmt::{Display, Formatter};

use mackrl::statistics::Crossings;

use super::report::{Beside, Report, Row};
use crate::{
    output,
    reproduce::{entry, interval, page, write_verdicts},
};

const HEADING: [&str; 9] = [
    "map",
    "learner",
    "runs",
    "won at the end",
    "interquartile mean",
    "steps to 70 %",
    "steps to 90 %",
    "best, unseen battles",
    "minutes",
];

/// Of the table of what others recorded.
const BESIDE: [&str; 6] = ["map", "learner", "after steps", "ours", "runs", "recorded"];

impl Report {
    fn cells(&self) -> Vec<Vec<String>> {
        self.rows.iter().map(cells).collect()
    }

    fn beside(&self) -> Vec<Vec<String>> {
        self.beside.iter().map(beside).collect()
    }

    /// The tables, the verdicts and what made the runs, in Markdown.
    pub(super) fn markdown(&self) -> String {
        let claims = self.claims.iter().map(|claim| {
            format!(
                "- **{}**: {}. {}\n",
                claim.verdict.words(),
                claim.claim,
                claim.evidence
            )
        });
        let versions = self.provenance.first();
        let versions = versions.map(|one| format!(", made by {}", one.versions));
        let beside = match &self.beside()[..] {
            [] => String::new(),
            rows => page::table(&BESIDE, rows) + "\n",
        };
        format!(
            "{}\n{beside}{} of {} runs{}.\n\n{}",
            page::table(&HEADING, &self.cells()),
            self.finished,
            self.planned,
            versions.unwrap_or_default(),
            claims.collect::<String>()
        )
    }
}

impl Display for Report {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        let heading = HEADING.map(str::to_owned).to_vec();
        let rows = [vec![heading], self.cells()].concat();
        writeln!(formatter, "{}", output::table(&rows))?;
        if !self.beside.is_empty() {
            let heading = BESIDE.map(str::to_owned).to_vec();
            let rows = [vec![heading], self.beside()].concat();
            writeln!(formatter, "{}", output::table(&rows))?;
        }
        writeln!(formatter, "{} of {} runs\n", self.finished, self.planned)?;
        write_verdicts(formatter, &self.claims)
    }
}

fn cells(row: &Row) -> Vec<String> {
    let mut cells = vec![
        row.map.clone(),
        row.learner.clone(),
        format!("{}/{}", row.runs, row.planned),
    ];
    let Some(found) = &row.found else {
        cells.resize(HEADING.len(), "–".to_owned());
        return cells;
    };
    // One run says nothing of the spread of runs.
    let several = row.runs > 1;
    cells.extend([
        match several {
            true => entry(found.won, found.won_error),
            false => format!("{:.3}", found.won),
        },
        match several {
            true => interval(found.iqm),
            false => "–".to_owned(),
        },
    ]);
    cells.extend(found.steps_to.iter().map(steps));
    cells.push(
        found
            .best
            .map_or_else(|| "–".to_owned(), |best| format!("{best:.3}")),
    );
    cells.push(format!("{:.1}", found.minutes));
    cells
}

fn beside(beside: &Beside) -> Vec<String> {
    vec![
        beside.map.clone(),
        beside.learner.clone(),
        format!("{} k", beside.steps_env / 1000),
        match (beside.ours, beside.runs) {
            (None, _) => "–".to_owned(),
            (Some((won, _)), 1) => format!("{won:.3}"),
            (Some((won, error)), _) => entry(won, error),
        },
        beside.runs.to_string(),
        format!("{:.3}", beside.recorded),
    ]
}

/// "45 k (5/5)": the median over runs, and how many of them get there.
fn steps(crossings: &Crossings) -> String {
    let Crossings { reached, runs, .. } = crossings;
    let median = crossings.median;
    let median = median.map_or_else(
        || "–".to_owned(),
        |steps| format!("{:.0} k", steps / 1000.0),
    );
    format!("{median} ({reached}/{runs})")
}
