//! Figure 6 as text.

use std::fmt::{self, Display, Formatter};

use super::{Figure6Report, Panel};

/// Tests that a table shows, at most.
const ROWS: usize = 12;

impl Display for Figure6Report {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        writeln!(
            formatter,
            "Figure 6, share of battles won in greedy tests: mean ± standard error over seeds"
        )?;
        writeln!(formatter, "{}", self.command)?;
        for panel in &self.panels {
            write_panel(formatter, panel, &self.steps)?;
        }
        writeln!(formatter, "\nVerdicts")?;
        self.claims
            .iter()
            .try_for_each(|claim| claim.write(formatter))
    }
}

fn write_panel(formatter: &mut Formatter<'_>, panel: &Panel, steps: &[u64]) -> fmt::Result {
    writeln!(
        formatter,
        "\n{:>10}  {:<15} {:<15}",
        panel.map, "MACKRL", "Central-V"
    )?;
    let every = steps.len().div_ceil(ROWS).max(1);
    let shown = (0..steps.len()).rev().step_by(every).collect::<Vec<_>>();
    for &test in shown.iter().rev() {
        let [mackrl, central_v] = [&panel.mackrl, &panel.central_v]
            .map(|curve| format!("{:.3} ± {:.3}", curve.mean[test], curve.sem[test]));
        writeln!(
            formatter,
            "{:>10}  {mackrl:<15} {central_v:<15}",
            steps[test]
        )?;
    }
    Ok(())
}
