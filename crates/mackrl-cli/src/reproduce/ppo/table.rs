//! The comparison as text: for a terminal, and for a page.

use std::fmt::{Display, Formatter};

use mackrl::statistics::Crossings;

use super::report::{Report, Row};
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

impl Report {
    fn cells(&self) -> Vec<Vec<String>> {
        self.rows.iter().map(cells).collect()
    }

    /// The table, the verdicts and what made the runs, in Markdown.
    pub(super) fn markdown(&self) -> String {
        let claims = self.claims.iter().map(|claim| {
            format!(
                "- **{}**: {}. {}\n",
                claim.verdict.words(),
                claim.claim,
                claim.evidence
            )
        });
        let versions = self.provenance.first().map(|one| one.versions.to_string());
        format!(
            "{}\n{} of {} runs, made by {}.\n\n{}",
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
