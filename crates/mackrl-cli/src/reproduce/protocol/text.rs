//! The protocol's outcome as text.

use std::fmt::{Display, Formatter, Result};

use super::{CellReport, ProtocolReport, delegation::Moment, study::Quantity};
use crate::{
    output,
    reproduce::{claim::write_verdict, interval, number},
};

impl Display for ProtocolReport {
    fn fmt(&self, out: &mut Formatter<'_>) -> Result {
        writeln!(
            out,
            "Share of battles won in greedy tests: interquartile mean over seeds with its 95 % bootstrap interval\n"
        )?;
        writeln!(out, "{}", averages(&self.cells))?;
        writeln!(
            out,
            "Runs that end below one half, and the median of the steps to a test with so many wins\n"
        )?;
        writeln!(out, "{}", levels(&self.cells))?;
        let chosen = self.chosen.as_deref();
        writeln!(
            out,
            "Configuration chosen, as the one under which both learners together win most over training on 2s3z: {}",
            chosen.unwrap_or("none yet, runs are missing")
        )?;
        for judged in &self.verdicts {
            let mark = if chosen == Some(&*judged.configuration) {
                " (chosen)"
            } else {
                ""
            };
            writeln!(out, "\nVerdicts for {}{mark}", judged.configuration)?;
            for claim in &judged.claims {
                let verdict = claim.judgement.verdict;
                let texts = [&*claim.claim, &*claim.judgement.evidence];
                write_verdict(out, verdict, claim.source, texts)?;
            }
        }
        if let Some(delegation) = &self.delegation {
            writeln!(
                out,
                "\nFigure 7, share of chosen pairs that delegate on 2s3z, by commonly known enemies: mean over runs"
            )?;
            writeln!(out, "\n{}", moments(&delegation.training, "training"))?;
            writeln!(out, "{}", moments(&delegation.tests, "greedy tests"))?;
        }
        Ok(())
    }
}

fn averages(cells: &[CellReport]) -> String {
    let quantities = Quantity::REPORTED.map(|quantity| quantity.to_string());
    let heading = [
        ["".to_owned(), "runs".to_owned()].to_vec(),
        quantities.to_vec(),
    ]
    .concat();
    let row = |cell: &CellReport| {
        let mut row = vec![
            cell.name.clone(),
            format!("{} of {}", cell.runs, cell.planned),
        ];
        row.extend(cell.averages.iter().map(|average| {
            let of = average.interquartile_mean;
            // A run that ends before a step has no score there.
            if of.estimate.is_finite() {
                interval(of)
            } else {
                "–".to_owned()
            }
        }));
        row
    };
    output::table(
        &std::iter::once(heading)
            .chain(cells.iter().map(row))
            .collect::<Vec<_>>(),
    )
}

fn levels(cells: &[CellReport]) -> String {
    let heading = ["", "below .5", "to .5", "to .7", "to .9"].map(str::to_owned);
    let row = |cell: &CellReport| {
        let mut row = vec![cell.name.clone(), cell.below_half.to_string()];
        row.extend(cell.levels.0.iter().map(|level| {
            let when = level
                .median
                .map_or("–".to_owned(), |steps| format!("{:.0} k", steps / 1000.0));
            format!("{when} ({} of {})", level.reached, level.runs)
        }));
        row
    };
    output::table(
        &std::iter::once(heading.to_vec())
            .chain(cells.iter().map(row))
            .collect::<Vec<_>>(),
    )
}

fn moments(moments: &[Moment], source: &str) -> String {
    let enemies = moments.first().map_or(0, |moment| moment.mean.len());
    let heading: Vec<String> = [source.to_owned(), String::new()]
        .into_iter()
        .chain((0..enemies).map(|count| count.to_string()))
        .collect();
    let mut rows = vec![heading];
    for moment in moments {
        let when = match moment.steps {
            0 => "at first".to_owned(),
            steps => format!("{} k steps", steps / 1000),
        };
        let published: Vec<Option<f64>> = moment.published.iter().copied().map(Some).collect();
        let all = [
            (when.as_str(), "ours", &moment.mean),
            ("", "published", &published),
            ("", "share of cases", &moment.cases),
        ];
        rows.extend(all.into_iter().map(|(when, whose, rates)| {
            let rates = rates.iter().map(|rate| number(*rate));
            let row = [when.to_owned(), whose.to_owned()].into_iter().chain(rates);
            row.collect::<Vec<String>>()
        }));
    }
    output::table(&rows)
}
