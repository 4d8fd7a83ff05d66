//! A figure as text.

use std::fmt::{Display, Formatter, Result};

use super::{
    Body, Report,
    report::{Moment, Panel, Variant},
};
use crate::{
    output,
    reproduce::{entry, interval, number, write_verdicts},
};

/// Tests that a table shows, at most.
const ROWS: usize = 12;

impl Display for Report {
    fn fmt(&self, out: &mut Formatter<'_>) -> Result {
        let map = self.map.as_deref().unwrap_or_default();
        writeln!(out, "{}", self.text(self.figure.heading, map))?;
        writeln!(out, "{}", self.command)?;
        match &self.body {
            Body::Panels(panels) => {
                (panels.iter()).try_for_each(|panel| write_panel(out, panel, &self.steps))?;
            }
            Body::Moments(moments) => write_moments(out, moments)?,
            Body::Variants(variants) => write_variants(out, variants)?,
        }
        writeln!(out)?;
        write_verdicts(out, &self.claims)
    }
}

fn write_panel(out: &mut Formatter<'_>, panel: &Panel, steps: &[u64]) -> Result {
    writeln!(out)?;
    let mut row = |first: &str, mackrl: &str, central_v: &str| {
        writeln!(out, "{first:>10}  {mackrl:<15} {central_v:<15}")
    };
    row(&panel.map, "MACKRL", "Central-V")?;
    let every = steps.len().div_ceil(ROWS).max(1);
    let shown = (0..steps.len()).rev().step_by(every).collect::<Vec<_>>();
    shown.into_iter().rev().try_for_each(|test| {
        let [mackrl, central_v] =
            [&panel.mackrl, &panel.central_v].map(|curve| entry(curve.mean[test], curve.sem[test]));
        row(&steps[test].to_string(), &mackrl, &central_v)
    })
}

fn write_moments(out: &mut Formatter<'_>, moments: &[Moment]) -> Result {
    writeln!(out)?;
    let mut row = |when: &str, whose: &str, cells: Vec<String>| {
        let cells: String = cells.iter().map(|cell| format!("{cell:>8}")).collect();
        writeln!(out, "{when:>18}  {whose:<10}{cells}")
    };
    let enemies = moments.first().map_or(0, |moment| moment.rates.len());
    row(
        "",
        "",
        (0..enemies).map(|count| count.to_string()).collect(),
    )?;
    for moment in moments {
        let ours = moment.rates.iter().map(|rate| number(rate.mean));
        let published = moment.published.iter().map(|&rate| number(Some(rate)));
        row(&moment.when(), "ours", ours.collect())?;
        row("", "published", published.collect())?;
    }
    Ok(())
}

fn write_variants(out: &mut Formatter<'_>, variants: &[Variant]) -> Result {
    let heading = ["", "mean ± error", "IQM [95 %]", "− MACKRL", "P(better)"];
    let rows = variants.iter().map(|variant| {
        let versus = variant.versus_mackrl.as_ref();
        vec![
            format!("{} ({})", variant.arm.label, variant.curve.runs),
            entry(variant.final_mean, variant.final_error),
            interval(variant.final_iqm),
            versus.map_or_else(String::new, |versus| {
                format!("{:+.3} ± {:.3}", versus.difference, versus.error)
            }),
            versus.map_or_else(String::new, |versus| {
                let better = versus.probability_of_improvement;
                format!(
                    "{:.2} [{:.2}, {:.2}]",
                    better.estimate, better.low, better.high
                )
            }),
        ]
    });
    let heading = heading.map(str::to_owned).to_vec();
    let rows: Vec<Vec<String>> = std::iter::once(heading).chain(rows).collect();
    writeln!(out, "\n{}", output::table(&rows))?;
    writeln!(
        out,
        "P(better): that a run of the variant ends higher than a run of MACKRL\n"
    )?;
    variants.iter().skip(1).try_for_each(|variant| {
        let arm = variant.arm;
        writeln!(out, "  {:<28} asks {}", arm.label, arm.question)
    })
}
